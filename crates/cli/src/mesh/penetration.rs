//! The penetration of two meshes, for scripts and for people.

use nearmiss::Penetration;
use serde::Serialize;

use crate::digits::{rounded, rounded_down};

/// The JSON output about meshes that overlap.
#[derive(Debug, Serialize)]
pub(crate) struct PenetrationReport {
    lower: f64,
    upper: f64,
    /// The unit vector along which b is moved.
    direction: [f64; 3],
    /// `false` if the budget ended the search; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    complete: Option<bool>,
}

impl PenetrationReport {
    /// Creates the report; `None` for meshes that are separate, and for invalid poses.
    pub(crate) fn new(found: &Penetration) -> Option<Self> {
        overlaps(found).then(|| Self {
            lower: found.lower,
            upper: found.upper,
            direction: found.direction,
            complete: (!found.complete).then_some(false),
        })
    }
}

/// Returns `true` if the meshes may overlap.
fn overlaps(found: &Penetration) -> bool {
    found.upper > 0.0 && found.upper.is_finite()
}

/// Returns the penetration as a sentence; `None` for meshes that are separate, and for invalid
/// poses. The lower bound is rounded down, the upper one up.
pub(crate) fn penetration_sentence(found: &Penetration, unit: f64) -> Option<String> {
    if !overlaps(found) {
        return None;
    }
    let [x, y, z] = found.direction.map(|x| rounded(x, 1e-5));
    let least = if found.lower > 0.0 {
        format!("no shift below {} does", rounded_down(found.lower, unit))
    } else {
        "a shorter shift may do".to_owned()
    };
    let unfinished = if found.complete { "" } else { " The budget ran out; raise --budget or --work." };
    let upper = rounded(found.upper + 0.5 * unit, unit);
    Some(format!(
        "Moving b by {upper} along ({x}, {y}, {z}) separates them; {least} (certified).{unfinished}"
    ))
}
