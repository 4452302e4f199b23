//! Verified points of the surface in a shape.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::project;

use crate::ask::options::Semantics;
use crate::pair::placed::ViewScratch;
use crate::solid::core::Solid;
use crate::solid::elements::Elements;

/// Projections of a search; each takes up to twelve evaluations.
const ROUNDS: u32 = 6;

/// The greatest distance of a point of the shape from the surface, in bandwidths.
const ON_SURFACE: f64 = 1e-6;

/// A verified point further than this from where the search started belongs to another contact. In
/// local radii.
const NEARBY: f64 = 4.0;

/// Looks for a point of the surface that is in the shape or within the margin, near point `i`, from a
/// place near both. Alternates between the nearest points of both.
pub(crate) fn verified_in(
    elements: &Elements<'_>,
    solid: &Solid<'_>,
    (i, start): (usize, Vector3<f64>),
    scratch: &mut ViewScratch,
) -> Option<[f64; 3]> {
    let placed = &elements.placed;
    if !placed.verifies() {
        return None;
    }
    let (mut x, scale) = (elements.in_world(&start), elements.scale());
    let most = NEARBY * elements.band(i);
    for _ in 0..ROUNDS {
        let foot = project(x, |y| placed.evaluate_near(i, y, scratch));
        let moved = (Vector3::from(foot.point) - Vector3::from(elements.in_world(&start))).norm();
        if !foot.converged || moved > most {
            return None;
        }
        let own = Vector3::from(placed.stored_to_world().apply_inverse(foot.point));
        let on_core = solid.nearest(&own);
        let beyond = (own - on_core).norm() - solid.radius;
        if beyond <= elements.margin + ON_SURFACE * foot.at.bandwidth / scale {
            let is_part = elements.semantics == Semantics::Surface || placed.is_obstacle(i, foot.point);
            return is_part.then_some(foot.point);
        }
        let way = (own - on_core).normalize();
        x = elements.in_world(&(on_core + way * solid.radius));
    }
    None
}
