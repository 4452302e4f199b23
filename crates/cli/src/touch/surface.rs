//! Shapes against the surface of a scan.

use std::time::Duration;

use nearmiss::{
    Budget, CollideOptions, Deadline, Interior, PlanError, Reason, Scan, Scratch, Semantics, Shape,
    ShapeContact, ShapePlan, ShapeVerdict, Target,
};
use serde::Serialize;

use crate::console::{Results, micros_since, now};
use crate::digits::{bounds, place, rounded, rounded_up, short};
use crate::error::CliError;
use crate::evidence::word;
use crate::label::Label;
use crate::penetration::{PenetrationReport, penetration_sentence};
use crate::touch::args::TouchArgs;
use crate::touch::shapes::ShapeFile;
use crate::units::UnitCheck;

/// The question about each shape.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    semantics: Semantics,
    pub(super) margin: f64,
    /// The inside of the scan, if the penetration is wanted.
    interior: Option<Interior>,
    /// Limits for each penetration or motion.
    time: Option<Duration>,
    work: Option<u64>,
}

impl Asked {
    /// Returns `None` if points alone count.
    pub(super) fn new(args: &TouchArgs) -> Result<Option<Self>, CliError> {
        let limits = [("--budget", args.budget.is_some()), ("--work", args.work.is_some())];
        if let Some((name, _)) = limits.into_iter().find(|(_, is_given)| *is_given)
            && !args.penetration
            && args.path.is_none()
        {
            return Err(CliError::Usage(format!(
                "{name}: expected --penetration or --path beside it, got neither; other answers take microseconds"
            )));
        }
        let semantics = match args.thickened {
            Some(radius) => Semantics::Thickened(radius),
            None if args.surface => Semantics::Obstacle,
            None if args.penetration => {
                let what =
                    "--penetration: expected --surface or --thickened beside it, got neither; add --surface";
                return Err(CliError::Usage(what.to_owned()));
            }
            None if args.path.is_some() => {
                let what = "--path: expected --surface or --thickened beside it, got neither; add --surface";
                return Err(CliError::Usage(what.to_owned()));
            }
            None if args.margin.is_some() => {
                let what = "--margin: expected --surface or --thickened beside it, got neither; points alone are \
                            compared without a margin, and `gap` tells how far they are";
                return Err(CliError::Usage(what.to_owned()));
            }
            None => return Ok(None),
        };
        let of_scan = if args.solid { Interior::Solid } else { Interior::Hollow };
        let interior = args.penetration.then_some(of_scan);
        Ok(Some(Self {
            semantics,
            margin: args.margin.unwrap_or(0.0),
            interior,
            time: args.budget,
            work: args.work,
        }))
    }

    /// Validates the question for a scan.
    pub(super) fn plan(&self, scan: &Scan) -> Result<ShapePlan, PlanError> {
        let options = CollideOptions::default().with_semantics(self.semantics).with_margin(self.margin);
        ShapePlan::new(&options, scan)
    }

    /// Returns the budget of a penetration or motion that starts now.
    pub(super) fn budget(&self) -> Budget {
        let mut budget = Budget::UNLIMITED;
        budget.work = self.work;
        budget.deadline = self.time.and_then(|time| now().checked_add(time)).map(Deadline::at);
        budget
    }
}

/// The JSON output of `touch --surface`.
#[derive(Debug, Serialize)]
struct SurfaceReport<'a> {
    #[serde(flatten)]
    label: Label,
    touches: Option<bool>,
    evidence: Option<&'static str>,
    reason: Option<&'static str>,
    lower: Option<f64>,
    upper: Option<f64>,
    contacts: &'a [ShapeContact],
    /// The local spacing, below which the scan does not tell; null for invalid shapes.
    band: f64,
    /// Absent if it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    penetration: Option<Option<PenetrationReport>>,
    micros: f64,
}

/// Tests shapes against the surface of a scan.
pub(super) fn of_surface(
    target: &Target<'_>,
    asked: Asked,
    shapes: &mut ShapeFile,
    (mut check, r, is_json): (UnitCheck, f64, bool),
) -> Result<(), CliError> {
    let (mut scratch, mut contacts, mut results) = (Scratch::default(), Vec::new(), Results::new());
    while let Some((line, text)) = shapes.next_line()? {
        let read = shapes.shape(line, &text, r);
        let (shape, label) = read.or_else(|fault| results.flush().and(Err(fault)))?;
        shape.compare(&mut check, line);
        let shape = shape.shape();
        let report = answer(target, &shape, &mut contacts, &mut scratch);
        let Some(mut report) = report else {
            return results.flush().and(Err(shapes.too_far(line)));
        };
        let penetration = asked
            .interior
            .map(|interior| target.penetration(&shape, interior, &asked.budget(), &mut scratch));
        report.penetration = penetration.as_ref().map(PenetrationReport::new);
        if is_json {
            report.label = label;
            results.json(&report)?;
        } else {
            let way = penetration
                .and_then(|found| penetration_sentence(&found, ["it", "it from the scan"], 0.01 * r));
            let way = way.map_or_else(String::new, |way| format!(" {way}"));
            results.line(format_args!(
                "line {line}{label}: {}{way}",
                sentence(&report, asked.margin, 0.01 * r)
            ))?;
        }
    }
    results.flush()
}

/// Answers all questions about a shape. `None` if it is invalid, too far away or too large.
fn answer<'c>(
    target: &Target<'_>,
    shape: &Shape<'_>,
    contacts: &'c mut Vec<ShapeContact>,
    scratch: &mut Scratch,
) -> Option<SurfaceReport<'c>> {
    let start = now();
    let answer = target.touch(shape, scratch);
    let distance = target.distance(shape, f64::INFINITY, scratch);
    target.contacts(shape, contacts, scratch);
    let micros = micros_since(start);
    let (touches, evidence, reason) = match answer.verdict {
        ShapeVerdict::Touching { evidence, .. } => (Some(true), Some(evidence), None),
        ShapeVerdict::Separated { evidence } => (Some(false), Some(evidence), None),
        ShapeVerdict::Undecided(Reason::Undersampled) => (None, None, Some("undersampled")),
        ShapeVerdict::Undecided(_) => return None,
    };
    let is_told = touches != Some(false) || distance.is_some();
    let is_told = is_told && contacts.iter().all(|contact| contact.depth.is_finite());
    is_told.then(|| SurfaceReport {
        label: Label::default(),
        touches,
        evidence: evidence.map(word),
        reason,
        lower: distance.map(|it| it.lower),
        upper: distance.map(|it| it.upper),
        contacts,
        band: answer.band,
        penetration: None,
        micros,
    })
}

/// Returns the answer as a sentence. Places are rounded to `unit`.
fn sentence(report: &SurfaceReport<'_>, margin: f64, unit: f64) -> String {
    let evidence = report.evidence.unwrap_or_default();
    match report.touches {
        Some(true) => {
            let or_near =
                if margin > 0.0 { format!(" or is within {} of it", short(margin)) } else { String::new() };
            let deepest = report.contacts.first().map_or_else(String::new, |contact| {
                let (which, what) =
                    if contact.depth >= 0.0 { ("deepest", "deep") } else { ("nearest", "away") };
                let which = match report.contacts.len() {
                    1 => "1 contact,".to_owned(),
                    more => format!("{more} contacts, the {which}"),
                };
                let (at, depth) = (place(contact.point, unit), rounded(contact.depth.abs(), unit));
                let normal = place(contact.normal, 1e-4);
                format!(" {which} {depth} {what} at {at}; the normal there is {normal}.")
            });
            format!("The shape touches it{or_near} ({evidence}).{deepest}")
        }
        Some(false) => {
            let apart = match (report.lower, report.upper) {
                (Some(lower), Some(upper)) if lower > 0.0 => {
                    let [lower, upper] = bounds([lower, upper], unit);
                    format!("{lower} to {upper} apart")
                }
                (_, Some(upper)) => format!("at most {} apart", rounded_up(upper, unit)),
                _ => "nothing is near".to_owned(),
            };
            format!("No contact ({evidence}); {apart}.")
        }
        None => "Cannot tell: the points near it are too sparse.".to_owned(),
    }
}
