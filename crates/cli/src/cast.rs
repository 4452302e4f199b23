//! `cast`: the first place where rays hit a scan, and depth images.

mod depth_picture;
mod hit_points;

use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::slices::Up;
use nearmiss::{Aabb, CollideOptions, Detail, Ray, RayAnswer, Scratch, ShapePlan, Target};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::console::{Console, Results, micros_since, now, warn};
use crate::digits::{percent, place, rounded};
use crate::error::CliError;
use crate::evidence::word;
use crate::input::Opening;
use crate::json_lines::JsonLines;
use crate::label::Label;
use crate::parse::parse_radius;
use crate::posing;
use crate::preprocess::parse_threads;
use crate::sentence::world_bounds;
use crate::units::{UnitCheck, UnitName};
use crate::viewpoint::ViewArgs;
use crate::{output, picture};
use depth_picture::Viewer;
use hit_points::HitPoints;

/// Options of `cast`.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("asked").required(true).multiple(true).args(["rays", "from", "image"]))]
pub struct CastArgs {
    /// Prepared scan (.nm), or a point cloud or mesh, which is prepared on the fly
    pub scan: PathBuf,
    /// Rays in world units, one JSON object on each line; `-` reads standard input
    ///
    /// `{"origin":[x,y,z],"direction":[x,y,z]}`, with `"max":d` for a ray that ends after the length d,
    /// and `"radius":r` for a ball that moves along the ray. Each ray gets one line of output, in order.
    #[arg(long, value_name = "FILE.jsonl")]
    pub rays: Option<PathBuf>,
    /// Pose of the scan: `x y z qx qy qz qw`, a 4×4 matrix, or a file that holds either
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub pose: Option<String>,
    /// Unit of the scan; rays, poses and answers are then in metres
    ///
    /// The scan is scaled to metres before --pose is applied. Without it, all are in the unit of the scan.
    #[arg(long, value_enum, value_name = "UNIT")]
    pub units: Option<UnitName>,
    /// Threads to prepare a raw input; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Advanced", hide_short_help = true)]
    pub threads: Option<usize>,
    /// Check prepared scans in full before use: checksums and all values
    #[arg(long, help_heading = "Advanced", hide_short_help = true)]
    pub verify: bool,
    /// Cast one ray from this place towards --to; with --image, the place of the camera
    ///
    /// The ray goes on beyond --to.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true, requires = "to")]
    pub from: Option<[f64; 3]>,
    /// A place that the ray passes; with --image, the place that the camera looks at
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true, requires = "from")]
    pub to: Option<[f64; 3]>,
    /// Radius of a ball that moves along the ray from --from, or along those of the image; 0 for rays
    ///
    /// Rays of a file have a `"radius"` each.
    #[arg(
        long,
        value_name = "R",
        value_parser = parse_radius,
        allow_hyphen_values = true,
        requires = "from"
    )]
    pub radius: Option<f64>,
    /// Draw a depth image as PNG: one ray for each pixel, coloured by its length
    ///
    /// The camera is at --from and looks at --to.
    #[arg(long, value_name = "OUT.png", requires_all = ["from", "to"], help_heading = "Depth image")]
    pub image: Option<PathBuf>,
    /// Width of the view in degrees, from 1 to 170; by default 75
    #[arg(long, value_name = "DEGREES", value_parser = parse_angle, requires = "image", help_heading = "Depth image")]
    pub angle: Option<f64>,
    /// Columns and rows of the image, and of its rays, such as 640x480
    ///
    /// By default 1080x720. Narrow images are enlarged to be as wide.
    #[arg(long, value_name = "WxH", value_parser = parse_size, requires = "image", help_heading = "Depth image")]
    pub size: Option<[usize; 2]>,
    /// Axis that points up in the image: x, y, z, -x, -y or -z; by default z
    #[arg(
        long,
        value_name = "AXIS",
        allow_hyphen_values = true,
        requires = "image",
        help_heading = "Depth image"
    )]
    pub up: Option<Up>,
    /// Write the places that are hit as points, in PLY: a simulated scan
    ///
    /// Each point has a normal, the index `source` of the measured point, the number `ray` of its ray
    /// and the length `t` of the ray. Rays are counted from 0, in the order of the file, or by rows of
    /// the image from the top left.
    #[arg(long, value_name = "OUT.ply", help_heading = "Output")]
    pub points: Option<PathBuf>,
    /// Print one JSON object for each ray, and one for the image
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

/// The JSON output of `cast`.
#[derive(Debug, Serialize)]
struct CastReport {
    #[serde(flatten)]
    label: Label,
    /// The length of the ray up to the hit.
    t: Option<f64>,
    point: Option<[f64; 3]>,
    normal: Option<[f64; 3]>,
    /// The index of the measured point.
    source: Option<u32>,
    evidence: &'static str,
    micros: f64,
}

/// The JSON output of `cast --image`.
#[derive(Debug, Serialize)]
struct ImageReport {
    columns: usize,
    rows: usize,
    hits: usize,
    /// The least and the greatest length of a ray that hits.
    nearest: Option<f64>,
    furthest: Option<f64>,
    micros: f64,
}

/// Parses a place in the world.
fn parse_place(text: &str) -> Result<[f64; 3], String> {
    let between = if text.contains(',') { ',' } else { ' ' };
    let parts = text.split(between).map(str::trim).filter(|part| between == ',' || !part.is_empty());
    let numbers: Option<Vec<f64>> = parts.map(|part| part.parse().ok()).collect();
    let place = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    let place = place.filter(|place| place.iter().all(|c| c.is_finite()));
    place.ok_or_else(|| "expected X,Y,Z in world units, such as 1.5,0,2".into())
}

/// Parses the width of a view.
fn parse_angle(text: &str) -> Result<f64, String> {
    let angle = text.parse().ok().filter(|angle| (1.0..=170.0).contains(angle));
    angle.ok_or_else(|| "expected an angle from 1 to 170 degrees".into())
}

/// Parses the size of an image.
fn parse_size(text: &str) -> Result<[usize; 2], String> {
    let parts = text.split_once(['x', 'X', '×']);
    let size = parts.and_then(|(columns, rows)| Some([columns.parse().ok()?, rows.parse().ok()?]));
    let size = size.filter(|size: &[usize; 2]| size.iter().all(|side| (1..=4096).contains(side)));
    size.ok_or_else(|| "expected columns and rows from 1 to 4096, such as 640x480".into())
}

impl CastArgs {
    /// The places of `--from` and `--to`, if they are given.
    fn ends(&self) -> Option<[[f64; 3]; 2]> {
        self.from.zip(self.to).map(|(from, to)| [from, to])
    }
}

pub(crate) fn run(args: &CastArgs) -> Result<(), CliError> {
    let matrix = posing::in_metres("--pose", args.pose.as_deref(), args.units)?;
    if args.ends().is_some_and(|[from, to]| from == to) {
        return Err(same_places());
    }
    let mut rays = args.rays.as_deref().map(RayFile::open).transpose()?;
    check_outputs(args)?;
    let console = Console::new(args.quiet);
    let opening = Opening { threads: args.threads.unwrap_or(0), verify: args.verify, console };
    let scan = opening.open(&args.scan)?;
    // The rays of an image are enough for an index to pay off.
    let scan = if args.image.is_some() { scan.with_shapes() } else { scan };
    let pose = posing::of_object(&matrix, &scan)
        .map_err(|refused| CliError::Pose { place: "--pose".into(), refused })?;
    let mut results = Results::new();
    let plan = ShapePlan::new(&CollideOptions::default(), &scan)?;
    let unit = 0.01 * scan.sampling_radius() * pose.scale();
    let target = Target::new(scan.at(&pose), &plan);
    let points = args.points.is_some().then(HitPoints::default);
    let mut asked = Asked { target: &target, unit, is_json: args.json, points };
    let mut check = UnitCheck::new(world_bounds(&scan.at(&pose)), 0.0, args.units);
    if let Some(from) = args.from {
        check.compare(&Aabb { min: from, max: from }, "the place of --from");
    }
    if let Some([from, to]) = args.ends().filter(|_| args.image.is_none()) {
        let ray = Ray::new(from, [0, 1, 2].map(|k| to[k] - from[k])).with_radius(args.radius.unwrap_or(0.0));
        asked.answer(&ray, (None, Label::default()), (&mut Scratch::default(), &mut results))?;
    }
    if let Some(rays) = &mut rays {
        asked.answer_all(rays, (&mut check, &mut results))?;
    }
    let mut points = asked.points;
    if let Some(path) = &args.image {
        let plan = ShapePlan::new(&CollideOptions::default().with_detail(Detail::Verdict), &scan)?;
        draw(args, &Target::new(scan.at(&pose), &plan), (path, console), (&mut points, &mut results))?;
    }
    if let Some((path, points)) = args.points.as_ref().zip(points) {
        points.write(path)?;
    }
    results.flush()
}

/// Fails if a file cannot be written, before any work.
fn check_outputs(args: &CastArgs) -> Result<(), CliError> {
    let inputs = [Some(&args.scan), args.rays.as_ref()];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
    if let Some(path) = &args.image {
        output::check_apart(path, &inputs)?;
        picture::check_name(path)?;
    }
    let Some(path) = &args.points else { return Ok(()) };
    if args.from.is_some() && args.rays.is_some() {
        let what =
            "--points: expected --rays or --from beside it, got both; the numbers of their rays would mix";
        return Err(CliError::Usage(what.to_owned()));
    }
    if path.extension().is_some_and(|extension| !extension.eq_ignore_ascii_case("ply")) {
        return Err(CliError::Usage(format!(
            "{}: expected a file name that ends in .ply; points are written as PLY",
            path.display()
        )));
    }
    output::check_apart(path, &inputs)
}

/// The questions about rays.
struct Asked<'a> {
    target: &'a Target<'a>,
    /// The length to which places are rounded.
    unit: f64,
    is_json: bool,
    /// The hits so far, if they are wanted.
    points: Option<HitPoints>,
}

impl Asked<'_> {
    /// Answers all rays of a file.
    fn answer_all(
        &mut self,
        rays: &mut RayFile,
        (check, results): (&mut UnitCheck, &mut Results),
    ) -> Result<(), CliError> {
        let mut scratch = Scratch::default();
        while let Some((line, text)) = rays.next_line()? {
            // Answers to the lines before a faulty one are written before the error.
            let (ray, label) = rays.ray(line, &text).or_else(|fault| results.flush().and(Err(fault)))?;
            let origin = ray.origin;
            check.compare(&Aabb { min: origin, max: origin }, format_args!("the ray on line {line}"));
            self.answer(&ray, (Some(line), label), (&mut scratch, results))?;
        }
        Ok(())
    }

    /// Answers one ray of a line, if it has one.
    fn answer(
        &mut self,
        ray: &Ray,
        (line, label): (Option<u64>, Label),
        (scratch, results): (&mut Scratch, &mut Results),
    ) -> Result<(), CliError> {
        let start = now();
        let answer = self.target.cast(ray, scratch);
        let micros = micros_since(start);
        if let Some(points) = &mut self.points {
            points.add(answer.hit.as_ref());
        }
        if !self.is_json {
            let start = line.map_or_else(String::new, |line| format!("line {line}{label}: "));
            return results.line(format_args!("{start}{}", sentence(&answer, self.unit)));
        }
        let RayAnswer { hit, evidence } = answer;
        results.json(&CastReport {
            label,
            t: hit.map(|hit| hit.t),
            point: hit.map(|hit| hit.point),
            normal: hit.map(|hit| hit.normal),
            source: hit.map(|hit| hit.source.0),
            evidence: word(evidence),
            micros,
        })
    }
}

/// The error about equal places of `--from` and `--to`.
fn same_places() -> CliError {
    CliError::Usage("--to: expected another place than --from, got the same".into())
}

/// Draws the depth image.
fn draw(
    args: &CastArgs,
    target: &Target<'_>,
    (path, console): (&Path, Console),
    (points, results): (&mut Option<HitPoints>, &mut Results),
) -> Result<(), CliError> {
    let Some(ends) = args.ends() else { return Ok(()) };
    let view = ViewArgs { up: args.up.or(Some(Up::Z)), view: None };
    let [columns, rows] = args.size.unwrap_or([1080, 720]);
    let viewer = Viewer::new(&view, target, ends, (args.angle.unwrap_or(75.0), [columns, rows]))
        .ok_or_else(same_places)?;
    let bar = console.spinner(format_args!("painting {}", path.display()));
    let name = args.scan.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let start = now();
    let hits = depth_picture::shoot(target, &viewer, args.radius.unwrap_or(0.0));
    let micros = micros_since(start);
    let (picture, share) = (depth_picture::paint(&hits, &viewer, &name), depth_picture::share(&hits));
    if let Some(points) = points {
        hits.iter().for_each(|hit| points.add(hit.as_ref()));
    }
    drop(bar);
    output::save_picture(&picture, path)?;
    if share == 0.0 {
        warn("no ray of the image hits the scan; `nearmiss inspect` tells its bounds for --from and --to");
    }
    if args.json {
        let lengths = || hits.iter().flatten().map(|hit| hit.t);
        let ends = (share > 0.0).then(|| lengths().fold([f64::MAX, 0.0], |[a, b], t| [t.min(a), t.max(b)]));
        return results.json(&ImageReport {
            columns,
            rows,
            hits: lengths().count(),
            nearest: ends.map(|ends| ends[0]),
            furthest: ends.map(|ends| ends[1]),
            micros,
        });
    }
    if args.quiet {
        return Ok(());
    }
    results.line(format_args!("{} of the rays hit; drawn in {}", percent(share), path.display()))
}

/// Returns the answer as a sentence. Places are rounded to `unit`.
fn sentence(answer: &RayAnswer, unit: f64) -> String {
    let evidence = word(answer.evidence);
    match answer.hit {
        Some(hit) => {
            let (at, t) = (place(hit.point, unit), rounded(hit.t, unit));
            format!("It hits {at} after {t} ({evidence}), at point {}.", hit.source.0)
        }
        None => format!("It hits nothing ({evidence})."),
    }
}

/// The form of a line, for messages.
const RAY_LINE: &str =
    r#"a line is {"origin":[x,y,z],"direction":[x,y,z]}, with "max":d and "radius":r if wanted"#;

/// A line of a file of rays. It may have a name or an id, but no other fields, since a misspelt radius
/// would be none.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object")]
struct RayLine {
    origin: [f64; 3],
    direction: [f64; 3],
    max: Option<f64>,
    #[serde(default)]
    radius: f64,
    name: Option<Value>,
    id: Option<Value>,
}

/// A file with a ray on each line.
struct RayFile {
    lines: JsonLines,
}

impl RayFile {
    fn open(path: &Path) -> Result<Self, CliError> {
        Ok(Self { lines: JsonLines::open(path, "rays", RAY_LINE)? })
    }

    /// Returns the number of the next line with a ray, counted from 1, and its text.
    fn next_line(&mut self) -> Result<Option<(u64, String)>, CliError> {
        self.lines.next_line()
    }

    /// Parses the ray on line `number`, whose text is `text`, and its label.
    fn ray(&self, number: u64, text: &str) -> Result<(Ray, Label), CliError> {
        let line: RayLine = self.lines.parse(number, text)?;
        let RayLine { origin, direction, max, radius, name, id } = line;
        let fault = |what: &str| Err(self.lines.fault_on(number, what));
        if direction == [0.0; 3] {
            return fault("expected a direction with a length above zero in `direction`, got [0, 0, 0]");
        }
        if max.is_some_and(|max| max < 0.0) {
            return fault("expected a length of zero or more in `max`, got a negative one");
        }
        if radius < 0.0 {
            return fault("expected a length of zero or more in `radius`, got a negative one");
        }
        let ray = Ray::new(origin, direction).with_max(max.unwrap_or(f64::INFINITY)).with_radius(radius);
        Ok((ray, Label { name, id }))
    }
}
