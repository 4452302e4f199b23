//! The words for times and for undecided motions.

use nearmiss::SweepReason;

/// Returns the word for a reason in JSON.
pub(crate) fn reason_word(reason: SweepReason) -> &'static str {
    match reason {
        SweepReason::Near => "near",
        SweepReason::Budget => "budget",
        SweepReason::Pose => "pose",
        SweepReason::Shape => "shape",
        SweepReason::Geodesic => "geodesic",
        _ => "unknown",
    }
}

/// Formats a time.
pub(crate) fn time(t: f64) -> String {
    let text = format!("{t:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Formats a time up to which something is proven: never later.
pub(crate) fn time_down(t: f64) -> String {
    time((t * 1e4).floor() / 1e4)
}
