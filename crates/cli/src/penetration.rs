//! The penetration of two scans, two meshes, or a shape and a scan, for scripts and for people.

use clap::ValueEnum;
use nearmiss::{Evidence, Interior, Penetration};
use serde::Serialize;

use crate::digits::{rounded, rounded_down, rounded_up, short};
use crate::evidence::word;

/// The names of the scans whose inside counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SolidName {
    /// The first scan
    A,
    /// The second scan
    B,
    /// Both scans
    Both,
}

/// Returns the insides of two scans.
pub(crate) fn interiors(solid: Option<SolidName>) -> [Interior; 2] {
    let of = |is_solid| if is_solid { Interior::Solid } else { Interior::Hollow };
    [SolidName::A, SolidName::B].map(|own| of(solid == Some(own) || solid == Some(SolidName::Both)))
}

/// The JSON output about things that overlap.
#[derive(Debug, Serialize)]
pub(crate) struct PenetrationReport {
    lower: f64,
    upper: f64,
    /// The unit vector along which b, or the shape, is moved.
    direction: [f64; 3],
    /// The evidence for the separation after that.
    evidence: &'static str,
    /// `false` if the budget ended the search; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    complete: Option<bool>,
}

impl PenetrationReport {
    /// Creates the report; `None` for things that are separate, and for invalid poses.
    pub(crate) fn new(found: &Penetration) -> Option<Self> {
        overlaps(found).then(|| Self {
            lower: found.lower,
            upper: found.upper,
            direction: found.direction,
            evidence: word(found.evidence),
            complete: (!found.complete).then_some(false),
        })
    }
}

/// Returns `true` if the things may overlap.
fn overlaps(found: &Penetration) -> bool {
    found.upper > 0.0 && found.upper.is_finite()
}

/// Returns both bounds; `None` for things that are separate, and for invalid poses.
pub(crate) fn bounds(found: &Penetration) -> Option<[f64; 2]> {
    overlaps(found).then_some([found.lower, found.upper])
}

/// Returns the penetration as a sentence: `moved` is moved away `from` another thing; `None` for things
/// that are separate, and for invalid poses. The lower bound is rounded down, the upper one up.
pub(crate) fn penetration_sentence(
    found: &Penetration,
    [moved, from]: [&str; 2],
    unit: f64,
) -> Option<String> {
    if !overlaps(found) {
        return None;
    }
    let [x, y, z] = found.direction.map(|x| rounded(x, 1e-5));
    let upper = rounded_up(found.upper, unit);
    let within = match found.evidence {
        Evidence::Estimated => {
            format!(" (estimated; gaps below {} cannot be told from contact)", short(found.band))
        }
        Evidence::Certified => String::new(),
    };
    let least = match (found.lower > 0.0, found.evidence) {
        (true, Evidence::Certified) => {
            format!("no move below {} is enough (certified)", rounded_down(found.lower, unit))
        }
        (true, Evidence::Estimated) => format!("no move below {} is enough", rounded_down(found.lower, unit)),
        (false, _) => "a shorter move may be enough".to_owned(),
    };
    let unfinished = if found.complete { "" } else { " The budget ran out; raise --budget or --work." };
    Some(format!(
        "Moving {moved} by {upper} along ({x}, {y}, {z}) separates {from}{within}; {least}.{unfinished}"
    ))
}
