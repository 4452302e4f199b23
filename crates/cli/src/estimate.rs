//! Estimates of the memory and time that a command will need, made before it starts.

use std::fmt::Write as _;
use std::path::Path;

use nearmiss::mesh::{SampleOptions, SamplePattern, SampleSize};
use nearmiss::{Aabb, TriangleMesh};

use crate::console::Console;
use crate::digits::{grouped, short_up};
use crate::error::CliError;
use crate::memory::Limit;

/// Runs expected to take longer than this many seconds are announced.
const LONG: f64 = 10.0;

/// Memory of the process itself, in bytes, whatever it does.
const BASE: f64 = 2e7;

/// Bytes per point while a file is read, in addition to the file itself: the coordinates in double
/// precision, the rounded point, and the table that finds duplicates. Counted from the arrays of
/// `io` and `PointCloud::cleaned`.
const READING: f64 = 72.0;

/// The cost of a step per point.
#[derive(Debug, Clone, Copy)]
struct Cost {
    /// Peak memory in bytes, input included.
    bytes: f64,
    /// Processor time in microseconds, on all threads together.
    micros: f64,
}

/// The products of `preprocess`, in ascending order of cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Preparation {
    /// The hierarchy alone.
    Hierarchy,
    /// A graph without the map of close pairs.
    Graph,
    /// A graph with the map of close pairs.
    ClosePairs,
    /// A graph with the map of close pairs, for the geodesic kernel.
    Geodesic,
}

impl Preparation {
    /// Returns the measured cost per point: bytes of peak resident memory less [`BASE`], and
    /// microseconds of user and system time. Measured with getrusage, with release builds on x86-64
    /// with AVX2.
    ///
    /// | points | hierarchy | graph | with close pairs |
    /// | --: | --: | --: | --: |
    /// | 100,250, an object with faces | 159 B, 8.7 µs | 613 B, 11.7 µs | 1444 B, 28.6 µs |
    /// | 753,423, a house of two storeys | 216 B, 6.4 µs | 585 B, 10.6 µs | 1257 B, 25.6 µs |
    /// | 3,072,580, an atrium, sampled | 176 B, 6.8 µs | 514 B, 9.1 µs | 1276 B, 21.8 µs |
    ///
    /// For the geodesic kernel the house takes 1183 B, 27.6 µs.
    fn cost(self) -> Cost {
        let [bytes, micros] = match self {
            Self::Hierarchy => [220.0, 7.0],
            Self::Graph => [615.0, 11.0],
            Self::ClosePairs => [1450.0, 26.0],
            Self::Geodesic => [1450.0, 28.0],
        };
        Cost { bytes, micros }
    }

    fn bytes(self, points: f64) -> f64 {
        BASE + self.cost().bytes * points
    }

    /// Returns cheaper products, each with advice on how to get it.
    fn lighter(self) -> &'static [(Self, &'static str)] {
        match self {
            Self::ClosePairs => &[(Self::Graph, "leave out --close-pairs"), (Self::Hierarchy, NO_GRAPH)],
            Self::Graph => &[(Self::Hierarchy, NO_GRAPH)],
            Self::Hierarchy | Self::Geodesic => &[],
        }
    }
}

/// The advice that leads to the cheapest product.
const NO_GRAPH: &str = "leave out the graph";

/// Refuses points that cannot be prepared in memory, and announces long runs.
#[derive(Debug)]
pub(crate) struct Forecast<'a> {
    pub(crate) path: &'a Path,
    pub(crate) limit: Limit,
    pub(crate) threads: usize,
    pub(crate) console: Console,
    pub(crate) preparation: Preparation,
    /// `true` if all filters can be applied on disk, in less memory.
    pub(crate) filters_on_disk: bool,
}

/// Returns the bytes of memory needed to read a file of `points` points and `bytes` bytes, the file
/// included.
pub(crate) fn reading(points: u64, bytes: u64) -> f64 {
    BASE + to_float(bytes) + READING * to_float(points)
}

/// The least memory, in bytes, with which work on disk is possible.
const LEAST_MEMORY: f64 = 1e8;

impl Forecast<'_> {
    /// Returns the limit of `--memory` if `points` points do not fit into it but can be prepared on
    /// disk.
    pub(crate) fn on_disk(&self, points: u64) -> Option<u64> {
        let Limit::Asked(most) = self.limit else { return None };
        let fits = self.preparation.bytes(to_float(points)) <= to_float(most);
        let can = self.preparation == Preparation::Hierarchy && self.filters_on_disk;
        (can && !fits && to_float(most) >= LEAST_MEMORY).then_some(most)
    }

    /// Fails if a file of `points` points and `bytes` bytes cannot be read in memory.
    pub(crate) fn check_reading(&self, points: u64, bytes: u64) -> Result<(), CliError> {
        let need = reading(points, bytes);
        let what = format!("reading {} points needs", grouped(points));
        self.refuse(&what, need, &["use a part of the file".to_owned()])
    }

    /// Fails if `points` points cannot be prepared in memory. `bounds` is the bounding box of the
    /// points, if known.
    pub(crate) fn check_preparing(&self, points: u64, bounds: Option<&Aabb>) -> Result<(), CliError> {
        let count = to_float(points);
        let need = self.preparation.bytes(count);
        let mut remedies = Vec::new();
        if let Some(most) = self.limit.bytes() {
            let fitting = (0.8 * (most - BASE) / self.preparation.cost().bytes).max(8.0);
            remedies.push(match bounds.and_then(|bounds| voxel_for(bounds, fitting)) {
                Some(size) => format!("use --voxel {}", short_up(size)),
                None => "use --voxel".to_owned(),
            });
            let lighter = self.preparation.lighter().iter().find(|(lighter, _)| lighter.bytes(count) <= most);
            let on_disk = self.filters_on_disk && self.preparation != Preparation::Hierarchy;
            let on_disk = (on_disk && most >= LEAST_MEMORY).then_some(NO_GRAPH);
            remedies.extend(lighter.map(|(_, option)| *option).or(on_disk).map(str::to_owned));
        }
        self.refuse(&format!("{} points need", grouped(points)), need, &remedies)
    }

    /// Announces the time and memory that it takes to prepare `points` points, if the time is long.
    pub(crate) fn announce(&self, points: u64) {
        let seconds = seconds(self.preparation.cost().micros * to_float(points), self.threads);
        if seconds > LONG {
            self.console.note(format_args!(
                "preparing {} points takes about {} and {}",
                grouped(points),
                duration(seconds),
                size(self.preparation.bytes(to_float(points)))
            ));
        }
    }

    fn refuse(&self, what: &str, need: f64, remedies: &[String]) -> Result<(), CliError> {
        let on_disk = self.filters_on_disk && self.preparation == Preparation::Hierarchy;
        let within = self.limit.bytes().map_or(1e9, |most| (0.5 * most).clamp(LEAST_MEMORY, 1e9));
        let on_disk = (on_disk && need > within)
            .then(|| format!("set --memory {:.0}MB to work on disk", (within / 1e6).floor()));
        let remedies: Vec<String> = on_disk.into_iter().chain(remedies.iter().cloned()).collect();
        refuse(self.path, self.limit, what, need, &remedies)
    }
}

/// The cost of preparing a triangle. Measured with getrusage: 106 bytes and 1.3 µs at 100,000
/// triangles as text, 150 and 1.3 at 202,520 as PLY, 187 and 1.4 at 1,598,472. Triangles that share no
/// vertices need more.
const TRIANGLE: Cost = Cost { bytes: 250.0, micros: 1.5 };

/// Fails if a file with about `points` vertices and `bytes` bytes cannot be read in memory.
pub(crate) fn check_reading_mesh(path: &Path, limit: Limit, points: u64, bytes: u64) -> Result<(), CliError> {
    let what = format!("reading {} vertices needs", grouped(points));
    refuse(path, limit, &what, reading(points, bytes), &[])
}

/// Fails if the triangles of `mesh` cannot be prepared in memory, and announces long runs.
pub(crate) fn check_mesh(
    path: &Path,
    (limit, threads): (Limit, usize),
    console: Console,
    mesh: &TriangleMesh,
) -> Result<(), CliError> {
    let triangles = to_float(mesh.triangles().len() as u64);
    let shown = grouped(mesh.triangles().len() as u64);
    let need = BASE + TRIANGLE.bytes * triangles;
    let remedy = "use fewer triangles".to_owned();
    refuse(path, limit, &format!("{shown} triangles need"), need, &[remedy])?;
    let seconds = seconds(TRIANGLE.micros * triangles, threads);
    if seconds > LONG {
        let (time, size) = (duration(seconds), size(need));
        console.note(format_args!("preparing {shown} triangles takes about {time} and {size}"));
    }
    Ok(())
}

/// The cost of a sample. Measured: 24.2 bytes at 3,453,074 and at 11,932,842 samples of an atrium.
/// The file is written while samples are made.
const SAMPLE: Cost = Cost { bytes: 24.5, micros: 0.12 };

/// The cost of a sample of blue noise at a spacing. Measured: 79 bytes at 1,070,970 samples of an
/// object and 75 at 2,238,127 of an atrium, 8.4 to 13 µs.
const DART: Cost = Cost { bytes: 85.0, micros: 12.0 };

/// The cost of a sample of blue noise by number, with its five candidates. Measured: 410 bytes at
/// 1,000,000 samples of an object; 16 µs at 100,000 and 45 µs at 1,000,000.
const CANDIDATES: Cost = Cost { bytes: 425.0, micros: 40.0 };

/// Memory for a triangle while blue noise is made, in bytes. Counted from the arrays of
/// `nearmiss::mesh`.
const BLUE_TRIANGLE: f64 = 275.0;

/// Fails if the samples of `mesh` would not fit into memory, and announces long runs.
pub(crate) fn check_sampling(
    path: &Path,
    limit: Limit,
    console: Console,
    mesh: &TriangleMesh,
    options: &SampleOptions,
) -> Result<(), CliError> {
    let (points, cost) = expected_samples(mesh, options);
    // `sample` itself refuses more samples than a point cloud can hold.
    let is_sensible = points > 0.0 && points < f64::from(u32::MAX);
    if !is_sensible {
        return Ok(());
    }
    let about = |points: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 2³²")]
        grouped(rounded(points) as u64)
    };
    let is_blue = options.pattern == SamplePattern::BlueNoise;
    let fixed = BASE + if is_blue { BLUE_TRIANGLE * to_float(mesh.triangles().len() as u64) } else { 0.0 };
    let need = fixed + cost.bytes * points;
    let fewer = limit.bytes().map(|most| {
        let share = (most - fixed).max(0.01 * most) / need;
        match options.samples {
            SampleSize::Spacing(spacing) => {
                format!("use --spacing {}", short_up(1.1 * spacing / share.sqrt()))
            }
            SampleSize::Count(_) => format!("use --points {:.0}", rounded(0.9 * share * points)),
        }
    });
    refuse(path, limit, &format!("about {} samples need", about(points)), need, &Vec::from_iter(fewer))?;
    let seconds = 1e-6 * cost.micros * points;
    if seconds > LONG {
        let (time, size) = (duration(seconds), size(need));
        console.note(format_args!("about {} samples take about {time} and {size}", about(points)));
    }
    Ok(())
}

/// Estimates the number of samples, and returns the cost of one.
fn expected_samples(mesh: &TriangleMesh, options: &SampleOptions) -> (f64, Cost) {
    let is_blue = options.pattern == SamplePattern::BlueNoise;
    match options.samples {
        SampleSize::Spacing(spacing) if is_blue => (darts(mesh, spacing), DART),
        SampleSize::Spacing(spacing) => {
            (samples(mesh, spacing, options.pattern == SamplePattern::Random), SAMPLE)
        }
        SampleSize::Count(count) => (f64::from(count), if is_blue { CANDIDATES } else { SAMPLE }),
    }
}

/// Estimates the number of samples of blue noise at a spacing, from the area of the mesh.
fn darts(mesh: &TriangleMesh, spacing: f64) -> f64 {
    // Random discs without overlap cover 54.7 % of a surface; their diameter is 0.95 spacings.
    let density = 0.547 * 4.0 / std::f64::consts::PI / (0.95 * spacing).powi(2);
    let area: f64 =
        (0..mesh.triangles().len()).map(|i| 0.5 * base_and_height(mesh, i).iter().product::<f64>()).sum();
    area * density
}

/// Estimates the number of samples that `nearmiss::mesh::sample` makes at a spacing: proportional
/// to the areas of the triangles, plus an allowance for the rounding up of rows and of places in a
/// row.
fn samples(mesh: &TriangleMesh, spacing: f64, is_jittered: bool) -> f64 {
    // The steps between rows, and between the places in a row, as in `sample`.
    let step = 2.0 / 5.0_f64.sqrt() * spacing * if is_jittered { 0.8 } else { 1.0 };
    let of_triangle = |i: usize| {
        let [base, height] = base_and_height(mesh, i);
        ((height / step + 1.5) * (0.5 * base / step + 1.5)).max(3.0)
    };
    (0..mesh.triangles().len()).map(of_triangle).sum()
}

/// Returns the length of the longest edge of triangle `i` and the height above it.
fn base_and_height(mesh: &TriangleMesh, i: usize) -> [f64; 2] {
    let [a, b, c] = mesh.triangles()[i].map(|v| mesh.vertices()[v as usize]);
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let twice_area = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
    let base = mesh.longest_edge(i);
    [base, if base > 0.0 { twice_area / base } else { 0.0 }]
}

/// Returns an edge length at which about `points` voxels are occupied, assuming that the points lie
/// on surfaces with the area of their bounding box.
fn voxel_for(bounds: &Aabb, points: f64) -> Option<f64> {
    let [x, y, z] = bounds.half_extents().map(|h| 2.0 * h);
    let area = 2.0 * (x * y + y * z + z * x);
    // A tilted surface crosses about one and a half times as many cells as one along the axes.
    let size = (1.5 * area / points).sqrt();
    (size > 0.0 && size.is_finite()).then_some(size)
}

fn refuse(path: &Path, limit: Limit, what: &str, need: f64, remedies: &[String]) -> Result<(), CliError> {
    let Some(most) = limit.bytes().filter(|most| need > *most) else { return Ok(()) };
    let of = if matches!(limit, Limit::Asked(_)) { "allowed by --memory" } else { "available" };
    let mut said = format!("{what} about {}, but {} are {of}; ", size(need), size(most));
    for remedy in remedies {
        let _ = write!(said, "{remedy}, ");
    }
    let or = if remedies.is_empty() { "" } else { "or " };
    let _ = write!(said, "{or}set --memory {} to run anyway", enough(need));
    Err(CliError::UnsuitableFile { path: path.to_owned(), what: said })
}

impl Limit {
    fn bytes(self) -> Option<f64> {
        match self {
            Self::Asked(bytes) | Self::Available(bytes) => Some(to_float(bytes)),
            Self::Unknown => None,
        }
    }
}

/// Returns the duration, in seconds, of `micros` microseconds of work on some threads; 0 for all
/// cores. Measured runs keep a second thread busy for five sixths of the time.
#[expect(clippy::cast_precision_loss, reason = "a few")]
fn seconds(micros: f64, threads: usize) -> f64 {
    let all = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = if threads == 0 { all() } else { threads } as f64;
    1e-6 * micros * (0.15 + 0.85 / threads)
}

#[expect(clippy::cast_precision_loss, reason = "an estimate")]
fn to_float(n: u64) -> f64 {
    n as f64
}

/// Rounds to two significant digits.
fn rounded(x: f64) -> f64 {
    let unit = 10.0_f64.powf((x.max(1.0).log10().floor() - 1.0).max(0.0));
    (x / unit).round() * unit
}

/// Formats a size of memory, with two digits.
fn size(bytes: f64) -> String {
    let (number, unit) = match bytes {
        ..1e6 => (bytes / 1e3, "kB"),
        1e6..1e9 => (bytes / 1e6, "MB"),
        _ => (bytes / 1e9, "GB"),
    };
    if number < 10.0 { format!("{number:.1} {unit}") } else { format!("{:.0} {unit}", rounded(number)) }
}

/// Formats a size that is sufficient, in the form that `--memory` takes.
fn enough(bytes: f64) -> String {
    let (number, unit) = if bytes < 1e9 { (bytes / 1e6, "MB") } else { (bytes / 1e9, "GB") };
    format!("{}{unit}", (1.05 * number).ceil())
}

fn duration(seconds: f64) -> String {
    match seconds {
        ..100.0 => format!("{:.0} s", rounded(seconds)),
        100.0..6000.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use nearmiss::mesh::sample;

    use super::*;

    fn forecast(limit: Limit, preparation: Preparation, path: &PathBuf) -> Forecast<'_> {
        let console = Console::new(true);
        Forecast { path, limit, threads: 2, console, preparation, filters_on_disk: false }
    }

    #[test]
    fn refusals_carry_numbers() {
        let path = PathBuf::from("big.ply");
        let bounds = Aabb { min: [0.0; 3], max: [30.0, 20.0, 3.0] };
        let limit = Limit::Available(8_000_000_000);
        let refused =
            forecast(limit, Preparation::ClosePairs, &path).check_preparing(30_000_000, Some(&bounds));
        let message = refused.unwrap_err().to_string();
        let expected = "big.ply: 30,000,000 points need about 44 GB, but 8.0 GB are available; use --voxel ";
        assert!(message.starts_with(expected), "{message}");
        assert!(message.ends_with(", leave out the graph, or set --memory 46GB to run anyway"), "{message}");
        let size: f64 = message[expected.len()..].split(',').next().unwrap().parse().unwrap();
        assert!((0.01..0.1).contains(&size), "{message}");

        let refused = forecast(Limit::Asked(20_000_000_000), Preparation::ClosePairs, &path);
        let message = refused.check_preparing(30_000_000, None).unwrap_err().to_string();
        assert!(
            message.contains(
                "but 20 GB are allowed by --memory; use --voxel, leave out --close-pairs, or set --memory "
            ),
            "{message}"
        );
        let message = refused.check_reading(1_000_000_000, 0).unwrap_err().to_string();
        assert!(message.contains("reading 1,000,000,000 points needs about 72 GB"), "{message}");

        for limit in [Limit::Unknown, Limit::Asked(60_000_000_000)] {
            assert!(
                forecast(limit, Preparation::ClosePairs, &path).check_preparing(30_000_000, None).is_ok()
            );
        }
    }

    #[test]
    fn samples_are_estimated_within_a_few_percent_where_faces_are_large() {
        // A tetrahedron, and a fan of slivers.
        let corners = vec![[0.0; 3], [1.0, 0.0, 0.2], [0.3, 2.0, 0.0], [0.0, 0.5, 1.5]];
        let solid = TriangleMesh::new(corners, vec![[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]]).unwrap();
        let rim = (0..50).map(|i| f64::from(i) * 0.1).map(|t| [t.cos(), t.sin(), 0.0]);
        let fan = std::iter::once([0.0; 3]).chain(rim).collect();
        let fan = TriangleMesh::new(fan, (1..50).map(|i| [0, i, i + 1]).collect()).unwrap();
        for (mesh, spacing, tolerance) in
            [(&solid, 0.01, 0.05), (&solid, 0.1, 0.2), (&fan, 0.01, 0.2), (&fan, 0.3, 0.5)]
        {
            for pattern in [SamplePattern::Regular, SamplePattern::Random, SamplePattern::BlueNoise] {
                let options = SampleOptions::new(SampleSize::Spacing(spacing)).with_pattern(pattern);
                let count = to_float(sample(mesh, &options).unwrap().len() as u64);
                let (expected, _) = expected_samples(mesh, &options);
                let share = expected / count;
                assert!((share - 1.0).abs() < tolerance, "{share} of {count} at {spacing}, {pattern:?}");
            }
        }
    }

    #[test]
    fn numbers_are_rounded_for_people() {
        assert_eq!([4.12e9, 1.24e10, 9.6e7, 5e4].map(size), ["4.1 GB", "12 GB", "96 MB", "50 kB"]);
        assert_eq!([1.2e10, 3.1e8].map(enough), ["13GB", "326MB"]);
        assert_eq!([12.3, 250.0, 7200.0].map(duration), ["12 s", "4 min", "2.0 h"]);
        assert_eq!([1234.0, 7.0, 98_765.0].map(rounded), [1200.0, 7.0, 99_000.0]);
    }
}
