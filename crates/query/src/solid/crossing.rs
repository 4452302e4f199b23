//! Where a ray meets the part of one point, in double precision.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::SLAB;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::elements::Elements;
use crate::solid::ray::StoredRay;

type Vector = Vector3<f64>;

/// A place where a ray meets the part of a point, in the stored frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crossing {
    pub(crate) t: f64,
    pub(crate) i: usize,
    /// The distance from the centre of the disc, in disc radii; at most 1 on the disc.
    pub(crate) beside: f64,
    /// How much the ray turns the distance from the plane into its own length; 1 for balls.
    pub(crate) cosine: f64,
}

impl Crossing {
    /// Returns `true` if the ray meets the disc or ball itself.
    pub(crate) fn is_sure(&self) -> bool {
        self.beside <= 1.0
    }

    /// Returns `true` if the ray is the path of a ball that touches the disc or ball before it moves.
    pub(crate) fn is_at_start(&self, ray: &StoredRay) -> bool {
        ray.radius > 0.0 && self.t == 0.0 && self.is_sure()
    }

    /// The length of the ray in which it may meet other discs of the same sheet: through half the
    /// thickness of the sheet, and no more than a local radius.
    pub(crate) fn layer(&self, elements: &Elements<'_>) -> f64 {
        let radius = f64::from(elements.arrays.radii[self.i]);
        radius * (f64::from(SLAB) / self.cosine).min(1.0)
    }
}

/// The distance at which a ray enters a ball; 0 if it starts inside.
pub(crate) fn enters(ray: &StoredRay, centre: &Vector, radius: f64) -> Option<f64> {
    let middle = (centre - ray.origin).dot(&ray.direction);
    let off_sq = (centre - ray.at(middle)).norm_squared();
    let half_sq = radius * radius - off_sq;
    let half = if half_sq >= 0.0 { half_sq.sqrt() } else { return None };
    (middle + half >= 0.0).then(|| (middle - half).max(0.0))
}

/// Where a ray meets a disc, or the plane of the disc up to `cell` from its centre.
pub(crate) fn meets(ray: &StoredRay, disc: &FlatDisc, i: usize, cell: f64) -> Option<Crossing> {
    let cosine = disc.normal.dot(&ray.direction);
    let height = disc.normal.dot(&(ray.origin - disc.centre));
    if ray.radius == 0.0 {
        let t = -height / cosine;
        if !(t >= 0.0 && t.is_finite()) {
            return None;
        }
        let beside = (ray.at(t) - disc.centre).norm();
        return (beside <= cell).then(|| Crossing {
            t,
            i,
            beside: beside / disc.radius,
            cosine: cosine.abs(),
        });
    }
    let touches = |t: f64| {
        let x = ray.at(t);
        let way = x - disc.nearest(&x);
        let distance = way.norm();
        (distance - ray.radius, if distance > 0.0 { way.dot(&ray.direction) / distance } else { -1.0 })
    };
    // As a shape at rest, the ball touches within the thickness of the disc.
    if touches(0.0).0 <= disc.thickness() {
        let beside = (disc.nearest(&ray.origin) - disc.centre).norm() / disc.radius;
        return Some(Crossing { t: 0.0, i, beside: beside.min(1.0), cosine: cosine.abs() });
    }
    let middle = (disc.centre - ray.origin).dot(&ray.direction);
    let mut t = (middle - disc.radius - ray.radius).max(0.0);
    // The distance is convex along the ray, so Newton's steps from before do not pass the first zero.
    for _ in 0..64 {
        let (apart, slope) = touches(t);
        if apart <= 1e-9 * (ray.radius + disc.radius) {
            let on_disc = disc.nearest(&ray.at(t));
            let beside = (on_disc - disc.centre).norm() / disc.radius;
            return Some(Crossing { t, i, beside: beside.min(1.0), cosine: cosine.abs() });
        }
        if slope >= 0.0 {
            break;
        }
        t -= apart / slope;
    }
    // A ball may also pass between discs.
    let t = (-height + ray.radius.copysign(height)) / cosine;
    let beside = (ray.at(t) - disc.centre - disc.normal * ray.radius.copysign(height)).norm();
    let is_hole = t >= 0.0 && t.is_finite() && beside > disc.radius && beside <= cell;
    is_hole.then(|| Crossing { t, i, beside: beside / disc.radius, cosine: cosine.abs() })
}

/// Returns `true` if a ray, with its radius, may pass through the cell of a point on a sheet.
pub(crate) fn passes_cell(elements: &Elements<'_>, ray: &StoredRay, i: usize, cell: f64) -> bool {
    let (centre, normal) = (elements.position(i), elements.normal(i));
    let middle = (centre - ray.origin).dot(&ray.direction);
    let off_sq = (centre - ray.at(middle)).norm_squared();
    let reach = cell.max(f64::from(elements.arrays.obstacle_reach(i))) + ray.radius;
    let half_sq = reach * reach * (1.0 + 1e-9) - off_sq;
    if half_sq < 0.0 {
        return false;
    }
    let half = half_sq.sqrt();
    let (from, to) = ((middle - half).max(0.0), (middle + half).min(ray.max));
    let layer = f64::from(SLAB * elements.arrays.radii[i]) * (1.0 + 1e-6) + ray.radius;
    let heights = [from, to].map(|t| normal.dot(&(ray.at(t) - centre)));
    let is_beside = heights.iter().all(|&h| h > layer) || heights.iter().all(|&h| h < -layer);
    from <= to && !is_beside
}
