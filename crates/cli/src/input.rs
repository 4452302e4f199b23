//! Reading of scans, prepared or raw, and of text files line by line.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use nearmiss::io::{Format, Model, glance};
use nearmiss::store::Progress;
use nearmiss::{BuildOptions, Check, GraphOptions, Metric, Paths, Scan, Workspace};

use crate::console::{self, Console};
use crate::digits::short;
use crate::error::CliError;
use crate::estimate;
use crate::guarded::ReadingLimit;
use crate::progress::{Counter, Told, short_name};

/// The first bytes of a prepared scan. They do not change if a transfer translates line ends.
const MAGIC: &[u8] = b"\x8Enmiss";

/// A warning is given if faces with an edge longer than [`LONG`] cover more than this share of a
/// mesh.
const LONG_SHARE: f64 = 0.05;

/// The length of a long edge, in sampling radii.
const LONG: f64 = 3.0;

/// A warning is given if the sampling radius of a mesh's vertices exceeds this share of the mesh's
/// diagonal. The vertices of a sphere with 200 vertices reach it.
const COARSE: f64 = 0.1;

/// The largest length of a line of text, in bytes.
const LONGEST_LINE: u64 = 1 << 20;

/// Returns `true` if the file is a prepared scan, or is named like one.
pub(crate) fn is_prepared(path: &Path) -> bool {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("nm"));
    let mut head = [0; MAGIC.len()];
    // Checked before opening, because opening a pipe waits for its other end.
    let is_file = path.metadata().is_ok_and(|m| m.is_file());
    named || is_file && File::open(path).and_then(|mut f| f.read_exact(&mut head)).is_ok() && head == MAGIC
}

/// Fails if there is no file at `path`, with the same message for every kind of input.
pub(crate) fn check_there(path: &Path) -> Result<(), CliError> {
    match path.metadata() {
        Err(cause) if cause.kind() == ErrorKind::NotFound => Err(CliError::Missing { path: path.to_owned() }),
        _ => Ok(()),
    }
}

/// The settings for opening scans.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Opening {
    /// Number of threads to prepare raw inputs; 0 for all cores.
    pub(crate) threads: usize,
    /// `true` to check prepared scans in full; `false` to check only what keeps indices within
    /// their arrays.
    pub(crate) verify: bool,
    pub(crate) console: Console,
}

impl Opening {
    /// Creates settings with all cores.
    pub(crate) fn new(verify: bool, console: Console) -> Self {
        Self { threads: 0, verify, console }
    }

    /// Opens a prepared scan, or prepares a raw input with default options.
    pub(crate) fn open(self, path: &Path) -> Result<Scan, CliError> {
        self.open_for(None, path)
    }

    /// As [`Self::open`], for this kernel if one is given. Raw inputs are prepared for it, by
    /// default for the euclidean kernel. Fails for a scan prepared for another kernel.
    pub(crate) fn open_for(self, kernel: Option<Metric>, path: &Path) -> Result<Scan, CliError> {
        check_there(path)?;
        if is_prepared(path) {
            let check = if self.verify { Check::Full } else { Check::Structure };
            let scan = Scan::open(path, check).map_err(CliError::loading(path))?;
            return match kernel.filter(|kernel| *kernel != scan.metric()) {
                Some(kernel) => {
                    let (name, stored) = (path.display(), scan.metric());
                    let remedy = prepare_again(path, &format!("--kernel {kernel}"));
                    let what = format!(
                        "{name}: expected a scan prepared for the {kernel} kernel, got one for the {stored} kernel; \
                         {remedy}, or the other scan with `--kernel {stored}`"
                    );
                    Err(CliError::Usage(what))
                }
                None => Ok(scan),
            };
        }
        match kernel {
            None | Some(Metric::Euclidean) => Ok(self.prepare(path)?.0),
            Some(Metric::Geodesic) => {
                let options = GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt));
                with_geodesic_kernel(path, self.prepare_with_graph(path, &options)?, self.console)
            }
        }
    }

    /// Prepares a raw input with default options. Returns the scan and the input.
    fn prepare(self, path: &Path) -> Result<(Scan, Model), CliError> {
        let model = read(path, None, self.console)?;
        let options = BuildOptions::default().with_threads(self.threads);
        Ok((build(path, &model, &options, self.console)?, model))
    }

    /// Prepares a raw input with default options and a graph.
    fn prepare_with_graph(self, path: &Path, options: &GraphOptions) -> Result<Scan, CliError> {
        let (scan, model) = self.prepare(path)?;
        with_graph(path, scan, &model, (options, None), self.console)
    }

    /// Opens two scans for the same kernel: the one given, or that of the first prepared scan. If
    /// both paths are equal, the file is opened once.
    pub(crate) fn open_both(self, kernel: Option<Metric>, [a, b]: [&Path; 2]) -> Result<[Scan; 2], CliError> {
        if a == b {
            let scan = self.open_for(kernel, a)?;
            return Ok([scan.clone(), scan]);
        }
        let open_next = |like: &Scan, path| self.open_for(Some(like.metric()), path);
        if is_prepared(a) || !is_prepared(b) {
            let a = self.open_for(kernel, a)?;
            return Ok([a.clone(), open_next(&a, b)?]);
        }
        let b = self.open_for(kernel, b)?;
        Ok([open_next(&b, a)?, b])
    }

    /// Opens two scans for queries about points only, for which the kernels do not matter.
    pub(crate) fn open_points(self, [a, b]: [&Path; 2]) -> Result<[Scan; 2], CliError> {
        let first = self.open(a)?;
        let second = if a == b { first.clone() } else { self.open(b)? };
        Ok([first, second])
    }

    /// As [`Self::open_points`], and builds graphs with these options for raw inputs.
    pub(crate) fn open_both_with_graphs(
        self,
        [a, b]: [&Path; 2],
        options: &GraphOptions,
    ) -> Result<[Scan; 2], CliError> {
        let open = |path: &Path| {
            check_there(path)?;
            if is_prepared(path) { self.open(path) } else { self.prepare_with_graph(path, options) }
        };
        let first = open(a)?;
        let second = if a == b { first.clone() } else { open(b)? };
        Ok([first, second])
    }

    /// As [`Self::open`], with a graph, which has these options if it is built here. Fails for a
    /// prepared scan without one.
    pub(crate) fn open_with_graph(self, path: &Path, options: &GraphOptions) -> Result<Scan, CliError> {
        check_there(path)?;
        if is_prepared(path) {
            let scan = self.open(path)?;
            if scan.graph().is_none() {
                let what = format!(
                    "expected a scan with a graph, got one without; {}",
                    prepare_again(path, "--graph")
                );
                return Err(CliError::UnsuitableFile { path: path.to_owned(), what });
            }
            return Ok(scan);
        }
        self.prepare_with_graph(path, options)
    }
}

/// Returns the remedy for a prepared scan that lacks what `option` of `preprocess` adds.
pub(crate) fn prepare_again(path: &Path, option: &str) -> String {
    format!("prepare it again with `nearmiss preprocess INPUT -o {} {option}`", path.display())
}

/// Returns the scan, changed to the geodesic kernel.
pub(crate) fn with_geodesic_kernel(path: &Path, scan: Scan, console: Console) -> Result<Scan, CliError> {
    let progress = Progress::default();
    let name = short_name(path);
    let _bar = console.watch_points(format_args!("fitting {name} along its graph"), &progress, scan.len());
    scan.with_geodesic_kernel_watched(&progress)
        .map_err(|cause| CliError::Graph { path: path.to_owned(), cause })
}

/// Returns the scan with a proximity graph of its points.
pub(crate) fn with_graph(
    path: &Path,
    scan: Scan,
    model: &Model,
    (options, scanner): (&GraphOptions, Option<[f64; 3]>),
    console: Console,
) -> Result<Scan, CliError> {
    let progress = Progress::default();
    let name = short_name(path);
    let _bar = console.watch_points(format_args!("building the graph of {name}"), &progress, scan.len());
    scan.with_graph_watched(&model.cloud, options, scanner, &progress)
        .map_err(|cause| CliError::Graph { path: path.to_owned(), cause })
}

/// Reads a raw input.
pub(crate) fn read(path: &Path, format: Option<Format>, console: Console) -> Result<Model, CliError> {
    check_raw(path)?;
    let _limit = limit_reading(path, format);
    let expected = glance(path, format).map(|seen| seen.points).filter(|&points| points > 0);
    let count = Counter::default();
    let _bar = console.watch(format_args!("reading {}", short_name(path)), "points", {
        let count = count.clone();
        #[expect(clippy::cast_precision_loss, reason = "a rough figure")]
        // Files that are read as a whole tell nothing until the end.
        let share =
            move |count: u64| expected.filter(|_| count > 0).map(|expected| count as f64 / expected as f64);
        move || Told { share: share(count.get()), count: count.get(), may_end_early: false }
    });
    Ok(nearmiss::io::read_watched(path, format, &mut |points| count.add(points as u64))?)
}

/// Limits the memory that a child process may use to read a file.
pub(crate) fn limit_reading(path: &Path, format: Option<Format>) -> ReadingLimit {
    ReadingLimit::new(|| glance(path, format).map_or(0.0, |seen| estimate::reading(seen.points, seen.bytes)))
}

/// Returns the key of work on disk: the version of the program, and the path, length and
/// modification time of the input.
pub(crate) fn identity(path: &Path) -> Result<String, CliError> {
    let about = path.metadata().map_err(CliError::reading(path))?;
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let changed = about.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
    Ok(format!("{} {whole:?} {} {changed:?}", env!("CARGO_PKG_VERSION"), about.len()))
}

/// Fails if an input does not exist or is a prepared scan.
pub(crate) fn check_raw(path: &Path) -> Result<(), CliError> {
    check_there(path)?;
    if is_prepared(path) {
        let what = "expected a point cloud or mesh, got a prepared scan or mesh (by its content or name); give the file \
                    that it was prepared from"
            .into();
        return Err(CliError::UnsuitableFile { path: path.to_owned(), what });
    }
    Ok(())
}

/// The remedy if the vertices of a mesh are too far apart.
const INSTEAD: &str = "put points on the faces with `sample`, or compare the triangles: `collide`, `distance` and \
                       `sweep` take --as-mesh a, b or both";

/// Prepares a model, and warns if its points represent the input badly.
pub(crate) fn build(
    path: &Path,
    model: &Model,
    options: &BuildOptions,
    console: Console,
) -> Result<Scan, CliError> {
    let work = Workspace::in_memory();
    let name = short_name(path);
    let bar = console.watch_points(format_args!("preparing {name}"), work.progress(), model.cloud.len());
    let scan = Scan::build_in(&(&model.cloud).into(), options, &work);
    drop(bar);
    let scan = scan.map_err(|cause| CliError::Build { path: path.to_owned(), cause })?;
    check_step(path, &scan);
    let radius = scan.sampling_radius();
    let share = share_of_long_faces(model, LONG * radius);
    let diagonal = 2.0 * scan.bounds().half_extents().iter().map(|half| half * half).sum::<f64>().sqrt();
    if model.mesh.is_some() && radius > COARSE * diagonal {
        console::warn(format_args!(
            "{}: the vertices of this mesh are about {} apart, but the mesh is only {} long; only vertices become \
             points, so answers are as coarse as that; {INSTEAD}",
            path.display(),
            short(radius),
            short(diagonal),
        ));
    } else if share > LONG_SHARE {
        console::warn(format_args!(
            "{}: {:.0} % of the mesh's surface is in faces with edges longer than {LONG} sampling radii ({}), and the \
             scan has holes there because only vertices become points; {INSTEAD}",
            path.display(),
            100.0 * share,
            short(LONG * radius),
        ));
    }
    Ok(scan)
}

/// Warns if rounding to single precision moves points by a relevant distance, or seems to have done so before
/// they were written to the file.
pub(crate) fn check_step(path: &Path, scan: &Scan) {
    let radius = scan.sampling_radius();
    if let Some(step) = rounded_before(scan).filter(|step| *step > radius / 10.0) {
        console::warn(format_args!(
            "{}: the coordinates are multiples of {}, to which single precision rounds numbers of this size, so the \
             points may be off by half of that; export the scan in double precision, or shift it to the origin before",
            path.display(),
            short(step)
        ));
    }
    if scan.step() > radius / 100.0 {
        console::warn(format_args!(
            "{}: single precision moves points by up to {}, more than a hundredth of the sampling radius \
             ({}); split the input into parts of smaller extent",
            path.display(),
            short(scan.step()),
            short(radius)
        ));
    }
}

/// The number of points whose coordinates are looked at.
const LOOKED_AT: usize = 4096;

/// The step to which single precision rounds the greatest coordinates of a scan, if almost all of them are
/// multiples of it, and many odd ones. Coordinates of a coarser grid are even multiples.
fn rounded_before(scan: &Scan) -> Option<f64> {
    let (bounds, frame) = (scan.bounds(), scan.frame());
    let steps = (0..3).filter_map(|k| {
        let most = bounds.min[k].abs().max(bounds.max[k].abs());
        let step = f64::from(f32::EPSILON) * most.log2().floor().exp2();
        let count = scan.len().min(LOOKED_AT);
        let (mut exact, mut odd) = (0, 0);
        for n in 0..count {
            let stored = f64::from(scan.positions()[n * scan.len() / count][k]);
            let multiple = (frame.origin[k] + frame.scale * stored) / step;
            let nearest = multiple.round();
            exact += usize::from((multiple - nearest).abs() < 0.01);
            odd += usize::from((nearest * 0.5).fract() != 0.0);
        }
        (odd > 0 && exact * 100 >= count * 99 && odd * 4 >= count).then_some(step)
    });
    steps.max_by(f64::total_cmp)
}

/// Returns the share of the area in faces with an edge longer than `long`; 0 without faces.
fn share_of_long_faces(model: &Model, long: f64) -> f64 {
    let Some(mesh) = &model.mesh else { return 0.0 };
    let (mut whole, mut in_long) = (0.0, 0.0);
    for (i, corners) in mesh.triangles().iter().enumerate() {
        let [a, b, c] = corners.map(|v| mesh.vertices()[v as usize]);
        let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let area = 0.5 * cross.iter().map(|x| x * x).sum::<f64>().sqrt();
        whole += area;
        if mesh.longest_edge(i) > long {
            in_long += area;
        }
    }
    if whole > 0.0 { in_long / whole } else { 0.0 }
}

/// A reader of the lines of a text file that are not blank.
pub(crate) struct TextLines {
    path: PathBuf,
    reader: BufReader<Box<dyn Read + Send + Sync>>,
    number: u64,
    /// The bytes that were read so far.
    read: u64,
    /// The bytes of the file, if it is one.
    length: Option<u64>,
}

impl std::fmt::Debug for TextLines {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { path, number, .. } = self;
        f.debug_struct("TextLines").field("path", path).field("number", number).finish_non_exhaustive()
    }
}

/// Returns `true` if a text is an object or numbers, as on the lines of files of shapes, rays and poses.
fn is_content(text: &str) -> bool {
    let are_numbers = || text.split([' ', ',']).all(|part| part.is_empty() || part.parse::<f64>().is_ok());
    let text = text.trim();
    let is_json =
        [('{', '}'), ('[', ']')].iter().any(|&(open, close)| text.starts_with(open) && text.ends_with(close));
    is_json || text.contains([' ', ',']) && are_numbers()
}

impl TextLines {
    /// Opens a file, or standard input for `-`.
    pub(crate) fn open(path: &Path) -> Result<Self, CliError> {
        let (path, length, source): (_, _, Box<dyn Read + Send + Sync>) = if path == Path::new("-") {
            ("standard input".into(), None, Box::new(std::io::stdin()))
        } else {
            if !path.exists() && path.to_str().is_some_and(is_content) {
                let what = "expected the name of a file, got its content; write it to a file, or pass it to standard \
                            input and name it `-`";
                return Err(CliError::UnsuitableFile { path: path.to_owned(), what: what.into() });
            }
            check_there(path)?;
            if path.is_dir() {
                let what = "expected a text file, got a folder; name a file, or `-` for standard input";
                return Err(CliError::UnsuitableFile { path: path.to_owned(), what: what.into() });
            }
            let file = File::open(path).map_err(CliError::reading(path))?;
            let length = file.metadata().ok().filter(|about| about.is_file()).map(|about| about.len());
            (path.to_owned(), length, Box::new(file))
        };
        Ok(Self { path, reader: BufReader::with_capacity(1 << 16, source), number: 0, read: 0, length })
    }

    /// Returns the number of bytes that were read so far.
    pub(crate) fn bytes_read(&self) -> u64 {
        self.read
    }

    /// Returns the length of the file in bytes; `None` for standard input and pipes.
    pub(crate) fn length(&self) -> Option<u64> {
        self.length
    }

    /// Returns the number of the next line that is neither blank nor a comment, counted from 1, and its
    /// text. Comments start with `#`.
    pub(crate) fn next_filled(&mut self) -> Result<Option<(u64, String)>, CliError> {
        loop {
            let mut bytes = Vec::new();
            self.number += 1;
            let taken = (&mut self.reader).take(LONGEST_LINE).read_until(b'\n', &mut bytes);
            let length = taken.map_err(CliError::reading(&self.path))?;
            if length == 0 {
                return Ok(None);
            }
            self.read += length as u64;
            if length as u64 == LONGEST_LINE {
                return Err(self.fault(
                    "expected lines of less than 1 MiB, got a longer one; check that this is a text file",
                ));
            }
            let start: &[u8] = if self.number == 1 { b"\xef\xbb\xbf" } else { b"" };
            let text = std::str::from_utf8(bytes.strip_prefix(start).unwrap_or(&bytes)).ok();
            let text = text
                .ok_or_else(|| {
                    self.fault("expected UTF-8 text, got other bytes; check that this is a text file")
                })?
                .trim();
            if !text.is_empty() && !text.starts_with('#') {
                return Ok(Some((self.number, text.to_owned())));
            }
        }
    }

    /// Returns an error about the file as a whole.
    pub(crate) fn unsuitable(&self, what: impl Into<String>) -> CliError {
        CliError::UnsuitableFile { path: self.path.clone(), what: what.into() }
    }

    /// Returns an error about the line returned last.
    pub(crate) fn fault(&self, what: impl Into<String>) -> CliError {
        self.fault_on(self.number, what)
    }

    /// Returns an error about a line, given by its number.
    pub(crate) fn fault_on(&self, line: u64, what: impl Into<String>) -> CliError {
        CliError::Line { path: self.path.clone(), line, what: what.into() }
    }
}

/// Splits a row of numbers at white space, commas and semicolons.
pub(crate) fn pieces(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c.is_whitespace() || matches!(c, ',' | ';')).filter(|p| !p.is_empty())
}
