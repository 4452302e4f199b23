//! The depths of hard clashes.
//!
//! The depth of a clash is the penetration of the parts of both things around it. The parts grow until the
//! shift that separates them is short against them, so that what was left out does not matter.

mod mesh_part;
mod mesh_scan;
mod meshes;
mod scan_part;
mod scans;

use nearmiss_geometry::Aabb;
use nearmiss_lanes::parallel::map_with;

use crate::ask::budget::Budget;
use crate::clash::group::ContactGroup;
use crate::penetration::answer::Penetration;

/// The maximum number of points or triangles around a clash. With more, the whole thing takes the place of
/// its part.
const MOST_ITEMS: usize = 200_000;

/// The first part extends beyond the contacts by this share of their diagonal.
const FIRST: f64 = 0.25;

/// A part is large enough if it extends this many times as far beyond the contacts as the things are
/// shifted.
const ROOM: f64 = 2.0;

/// A depth above this share of the penetration of the whole things is replaced by it.
const NEARLY: f64 = 0.98;

/// The clashes between two reports of the progress.
const TOLD: usize = 64;

/// The penetration of the parts around a clash.
enum OfParts {
    /// The parts are the whole things.
    Whole,
    /// One of the parts is too small for an answer.
    Unknown,
    Found(Penetration),
}

/// Maps each group on all threads, and passes the share of the groups that are done to `told`.
fn each<S: Send>(
    groups: &[&ContactGroup],
    told: &mut dyn FnMut(f64),
    scratch: impl Fn() -> S + Sync + Send,
    of: impl Fn(&ContactGroup, &mut S) -> Penetration + Sync + Send,
) -> Vec<Penetration> {
    let mut found = Vec::with_capacity(groups.len());
    for some in groups.chunks(TOLD) {
        found.extend(map_with(some.len(), &scratch, |scratch, i| of(some[i], scratch)));
        #[expect(clippy::cast_precision_loss, reason = "a share")]
        told(found.len() as f64 / groups.len() as f64);
    }
    found
}

/// Bounds the depth of a clash whose things have this penetration. `of_parts` takes the bounding box of the
/// contacts, grown to every side by a length that is first at least `first`.
fn depth(
    bounds: &Aabb,
    whole: &Penetration,
    (first, budget): (f64, &Budget),
    mut of_parts: impl FnMut(&Aabb) -> OfParts,
) -> Penetration {
    let diagonal = 2.0 * bounds.half_extents().into_iter().fold(0.0, f64::hypot);
    let mut room = (FIRST * diagonal).max(first);
    let most = (ROOM * whole.upper).max(room);
    // The shift of the whole things frees this clash too. Their lower bound may be that of another place.
    let mut answer = Penetration { lower: 0.0, ..*whole };
    if !most.is_finite() {
        return answer;
    }
    while budget.go_on(0).is_continue() {
        room = room.min(most);
        match of_parts(&bounds.grown(room)) {
            // The bound of the whole things may be that of another clash.
            OfParts::Whole => break,
            OfParts::Unknown => {}
            OfParts::Found(found) => {
                answer.lower = answer.lower.max(found.lower).min(answer.upper);
                if found.upper <= whole.upper * NEARLY && ROOM * found.upper <= room {
                    // The bounds of smaller parts hold as well.
                    return Penetration { lower: answer.lower.min(found.upper), ..found };
                }
                if !found.complete {
                    break;
                }
                if found.upper > whole.upper * NEARLY {
                    if room >= most || whole.lower <= answer.lower {
                        break;
                    }
                    // The shift is known. The greatest parts may have a better lower bound.
                    room = most;
                    continue;
                }
                // A greater part needs a shift that is at least about as long.
                room = room.max(0.5 * ROOM * found.upper);
            }
        }
        if room >= most {
            break;
        }
        room *= 2.0;
    }
    answer
}
