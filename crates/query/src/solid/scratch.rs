//! Reusable memory of questions about shapes and rays.

use crate::solid::answer::ShapeContact;
use crate::solid::contacts::Candidates;
use crate::solid::crossing::Crossing;

/// Reusable memory; never influences an answer.
#[derive(Debug, Clone, Default)]
pub(crate) struct SolidScratch {
    pub(crate) candidates: Candidates,
    pub(crate) crossings: Vec<Crossing>,
    pub(crate) contacts: Vec<ShapeContact>,
}
