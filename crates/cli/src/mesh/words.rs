//! Answers about meshes as sentences.

use nearmiss::{MeshAnswer, MeshContact, MeshDistance, MeshVerdict};

use crate::digits::{bounds, place, rounded, rounded_up, short};

/// The sentence about invalid poses.
const POSE: &str = "Cannot tell: a pose is not finite, or makes one mesh vanishingly small beside the other; check the poses.";

/// Returns a verdict as a sentence. It states a clearance if `distance` is given.
pub(crate) fn sentence(answer: &MeshAnswer, distance: Option<&MeshDistance>, unit: f64) -> String {
    match &answer.verdict {
        MeshVerdict::Intersecting(contact) => {
            format!("They touch at {} (certified).", place(contact.point, unit))
        }
        MeshVerdict::Separated => {
            let apart = distance.filter(|distance| distance.upper > 0.0);
            let apart = apart.map_or(String::new(), |distance| format!("; {}", apart_by(distance, unit)));
            format!("No contact{apart} (certified).")
        }
        MeshVerdict::Pose => POSE.to_owned(),
        MeshVerdict::Undecided(region) => {
            let [percent, centre] = [format!("{:.0}", 100.0 * answer.likelihood), place(region.centre, unit)];
            format!(
                "Undecided: they touch with a probability of {percent} %, likeliest within {} of {centre}.",
                rounded_up(region.radius, unit)
            )
        }
        _ => "Cannot tell: the budget ran out; raise --budget or --work.".to_owned(),
    }
}

/// Returns a distance as a sentence.
pub(crate) fn distance_sentence(found: &MeshDistance, unit: f64) -> String {
    if found.upper.is_infinite() {
        return POSE.to_owned();
    }
    let unfinished =
        if found.complete { "" } else { " The budget ran out; raise --budget or --work for tighter bounds." };
    if found.upper <= 0.0 {
        return format!("They touch at {} (certified).", place(found.points[0], unit));
    }
    format!("They are {} (certified).{unfinished}", apart_by(found, unit))
}

/// Returns a distance as a clause. A lower bound is rounded down, an upper one up.
fn apart_by(found: &MeshDistance, unit: f64) -> String {
    if found.complete {
        return format!("{} apart", rounded(found.upper, unit));
    }
    let [lower, upper] = bounds([found.lower, found.upper], unit);
    if found.lower > 0.0 {
        format!("between {lower} and {upper} apart")
    } else {
        format!("at most {upper} apart")
    }
}

/// Returns a contact of a list as a line.
pub(crate) fn contact_line(contact: &MeshContact, unit: f64) -> String {
    let [a, b] = contact.triangles;
    let [p, q] = contact.ends;
    let length = [0, 1, 2].map(|k| q[k] - p[k]).into_iter().fold(0.0, f64::hypot);
    let along = if length > 0.0 { format!(", along {}", short(length)) } else { String::new() };
    format!("  {}, between triangle {a} of a and triangle {b} of b{along}", place(contact.point, unit))
}
