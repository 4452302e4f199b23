//! The words for evidence.

use nearmiss::Evidence;

/// Returns the word for evidence in JSON and in sentences.
pub(crate) fn word(evidence: Evidence) -> &'static str {
    match evidence {
        Evidence::Certified => "certified",
        Evidence::Estimated => "estimated",
    }
}
