//! Shapes that move past a scan along a path of poses.

use std::path::Path;

use nearmiss::{
    Aabb, Budget, Evidence, Motion, MotionError, Pose, Scratch, ShapeContact, ShapeSweep, ShapeSweepVerdict,
    SweepReason, Target,
};
use serde::Serialize;

use crate::console::{Results, micros_since, now};
use crate::digits::{count, place, rough, rounded_down, rounded_up, short};
use crate::error::CliError;
use crate::evidence::word;
use crate::label::Label;
use crate::motion_words::{reason_word, time, time_down};
use crate::posing::{Posable, PoseFile};
use crate::touch::shapes::{ReadShape, ShapeFile};
use crate::touch::surface::Asked;
use crate::units::UnitCheck;

/// The JSON output of `touch --path`. Times count lines of the path from the first one, which is at 0.
#[derive(Debug, Serialize)]
struct SweptReport {
    #[serde(flatten)]
    label: Label,
    verdict: &'static str,
    evidence: Option<&'static str>,
    /// The motion is proven free up to this time.
    t_free: f64,
    t_hit: Option<f64>,
    /// The deepest contact at `t_hit`.
    contact: Option<ShapeContact>,
    /// The distance that is proven for the whole motion.
    clearance: Option<f64>,
    /// The time of the least distance that was measured, and that distance from above.
    clearance_at: Option<f64>,
    clearance_upper: Option<f64>,
    reason: Option<&'static str>,
    /// The local spacing where the shape was nearest.
    band: Option<f64>,
    distances: u32,
    micros: f64,
}

/// A shape that the poses of a path place.
struct Rigid {
    bounds: Aabb,
    /// The sampling radius of the scan.
    r: f64,
}

impl Posable for Rigid {
    fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    fn tolerance(&self) -> (f64, &'static str) {
        (0.1 * self.r, "a tenth of the sampling radius")
    }
}

/// The poses of a path.
pub(super) struct Route {
    file: PoseFile,
    lines: Vec<(u64, String)>,
}

impl Route {
    /// Reads the lines of a file of poses.
    pub(super) fn read(path: &Path) -> Result<Self, CliError> {
        let mut file = PoseFile::open(path, [None; 2], [1.0; 2])?;
        let mut lines = Vec::new();
        while let Some(line) = file.next_line()? {
            lines.push(line);
        }
        Ok(Self { file, lines })
    }

    /// The error about a pose at a distance that is not finite.
    fn too_far(&self) -> CliError {
        let what = "expected poses within measurable distance, got one too far away; check its units";
        self.file.fault_on(self.lines.last().map_or(0, |line| line.0), what)
    }

    /// The motion of a shape along the path.
    fn of(&self, shape: &Rigid) -> Result<Motion, CliError> {
        let mut poses = Vec::with_capacity(self.lines.len());
        for (line, text) in &self.lines {
            let [a, b] = self.file.poses(*line, text, [shape, shape])?.poses;
            if a != Pose::IDENTITY {
                let what = "expected poses of the shapes, got one of `a`, the scan; place it with --pose";
                return Err(self.file.fault_on(*line, what));
            }
            poses.push(b);
        }
        Motion::through(&poses).map_err(|refused| {
            let index = match refused {
                MotionError::NotFinite { index } | MotionError::Scale { index, .. } => index,
                _ => 0,
            };
            let line = self.lines.get(index).map_or(0, |line| line.0);
            self.file.fault_on(line, refused.to_string())
        })
    }
}

/// Moves each shape along the path.
pub(super) fn along_path(
    (target, asked): (&Target<'_>, Asked),
    route: &Route,
    shapes: &mut ShapeFile,
    (mut check, r, is_json): (UnitCheck, f64, bool),
) -> Result<(), CliError> {
    let (mut scratch, mut results) = (Scratch::default(), Results::new());
    while let Some((line, text)) = shapes.next_line()? {
        let mut ask = || -> Result<_, CliError> {
            let (shape, label) = shapes.shape(line, &text, r)?;
            let Some(bounds) = shape.shape().bounds() else { return Err(shapes.too_far(line)) };
            let motion = route.of(&Rigid { bounds, r })?;
            let first = Aabb::of(bounds.corners().map(|corner| motion.at(0.0).apply(corner)));
            check.compare(&first, format_args!("the shape on line {line}, at the first pose,"));
            match answer(target, (&shape, label), (&motion, &asked.budget()), &mut scratch) {
                (_, report) if report.reason == Some("shape") => Err(shapes.too_far(line)),
                (_, report) if report.reason == Some("pose") => Err(route.too_far()),
                told => Ok(told),
            }
        };
        // Answers to the lines before a faulty one are written before the error.
        let (answer, report) = ask().or_else(|fault| results.flush().and(Err(fault)))?;
        if is_json {
            results.json(&report)?;
        } else {
            let label = &report.label;
            results
                .line(format_args!("line {line}{label}: {}", sentence(&answer, asked.margin, 0.01 * r)))?;
        }
    }
    results.flush()
}

/// Moves a shape past the scan.
fn answer(
    target: &Target<'_>,
    (shape, label): (&ReadShape, Label),
    (motion, budget): (&Motion, &Budget),
    scratch: &mut Scratch,
) -> (ShapeSweep, SweptReport) {
    let start = now();
    let answer = target.sweep_within(&shape.shape(), motion, budget, scratch);
    let micros = micros_since(start);
    let mut report = SweptReport {
        label,
        verdict: "undecided",
        evidence: None,
        t_free: 0.0,
        t_hit: None,
        contact: None,
        clearance: None,
        clearance_at: None,
        clearance_upper: None,
        reason: None,
        band: Some(answer.band).filter(|band| band.is_finite()),
        distances: answer.distances,
        micros,
    };
    match answer.verdict {
        ShapeSweepVerdict::Free { clearance, upper, at } => {
            (report.verdict, report.evidence) = ("free", Some(word(Evidence::Certified)));
            report.t_free = motion.duration();
            (report.clearance, report.clearance_upper) = (Some(clearance), Some(upper));
            report.clearance_at = Some(at);
        }
        ShapeSweepVerdict::Impact { t_free, t_hit, contact } => {
            (report.verdict, report.evidence) = ("impact", Some(word(Evidence::Estimated)));
            (report.t_free, report.t_hit, report.contact) = (t_free, Some(t_hit), Some(contact));
        }
        ShapeSweepVerdict::Undecided { t_free, reason } => {
            (report.t_free, report.reason) = (t_free, Some(reason_word(reason)));
        }
    }
    (answer, report)
}

/// Returns the answer as a sentence. Places are rounded to `unit`.
fn sentence(answer: &ShapeSweep, margin: f64, unit: f64) -> String {
    let verb = if margin > 0.0 {
        format!("comes within {} of the scan", short(margin))
    } else {
        "hits the scan".into()
    };
    let free_to = |t: f64| match t > 0.0 {
        true => format!(" Proven free up to t = {}.", time_down(t)),
        false => " Nothing before that is proven free.".to_owned(),
    };
    let told = match answer.verdict {
        ShapeSweepVerdict::Free { clearance, upper, at } => {
            let kept = if clearance > 0.0 { rounded_down(clearance, unit) } else { "0".to_owned() };
            format!(
                "The whole motion is free (certified): always at least {kept} from the scan, at most {} at t = {}.",
                rounded_up(upper, unit),
                short(at)
            )
        }
        ShapeSweepVerdict::Impact { t_free, t_hit, contact } => {
            let (at, normal) = (place(contact.point, unit), place(contact.normal, 1e-4));
            let when =
                if t_hit > 0.0 { format!("at t = {}", time(t_hit)) } else { "at the start".to_owned() };
            let proven = if t_hit > 0.0 { free_to(t_free) } else { String::new() };
            format!("The shape {verb} {when}, at {at}; the normal there is {normal}.{proven}")
        }
        ShapeSweepVerdict::Undecided { t_free, reason } => {
            let why = match reason {
                SweepReason::Near => format!(
                    "at t = {} the shape is nearer than can be proven apart; where it is nearest, points are {} apart",
                    time_down(t_free),
                    rough(answer.band)
                ),
                SweepReason::Budget => "the search reached its limit".to_owned(),
                _ => "the scan proves no separation".to_owned(),
            };
            let proven = if t_free > 0.0 { free_to(t_free) } else { String::new() };
            format!("Cannot tell: {why}; no contact was found.{proven}")
        }
    };
    format!("{told} {}", count(u64::from(answer.distances), "distance query").replace("querys", "queries"))
}
