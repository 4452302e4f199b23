//! Queries of a tree at its clock: boxes, rays, frusta.

use nearmiss_geometry::Aabb;

use crate::nodes::ROOT;
use crate::tree::KineticTree;

/// A ray that is cut where something was hit.
struct Ray {
    origin: [f64; 3],
    direction: [f64; 3],
    limit: f64,
}

impl Ray {
    /// Returns the parameter at which the ray enters the box; `None` if it misses it.
    fn enters(&self, bounds: &Aabb) -> Option<f64> {
        let [mut enter, mut exit] = [0.0_f64, self.limit];
        for k in 0..3 {
            let [low, high] = [bounds.min[k] - self.origin[k], bounds.max[k] - self.origin[k]];
            if self.direction[k] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let [a, b] = [low / self.direction[k], high / self.direction[k]];
            enter = enter.max(a.min(b));
            exit = exit.min(a.max(b));
        }
        (enter <= exit).then_some(enter)
    }
}

/// Returns `true` if no half-space `n · x + d ≥ 0` excludes the whole box.
fn is_within_all(bounds: &Aabb, planes: &[[f64; 4]]) -> bool {
    planes.iter().all(|plane| {
        let far = |k: usize| plane[k] * if plane[k] > 0.0 { bounds.max[k] } else { bounds.min[k] };
        far(0) + far(1) + far(2) + plane[3] >= 0.0
    })
}

impl KineticTree {
    /// Calls `visit` with each primitive whose box now has a point in common with `bounds`.
    pub fn in_box(&self, bounds: &Aabb, visit: impl FnMut(u32)) {
        self.find(|own| own.meets(bounds), visit);
    }

    /// Calls `visit` with each primitive whose box is now in or partly in all half-spaces
    /// `n · x + d ≥ 0`, given as `[n.x, n.y, n.z, d]`: with the six planes of a camera, all that it
    /// may see. Boxes near an edge of the frustum, outside it, may be found too.
    pub fn in_frustum(&self, planes: &[[f64; 4]], visit: impl FnMut(u32)) {
        self.find(|own| is_within_all(own, planes), visit);
    }

    /// Calls `visit` with primitives whose boxes now meet the ray `origin + s direction`, 0 ≤ s ≤
    /// `limit`, and with the s at which it enters them. `visit` returns the new limit: the same
    /// one to find all, the s of its own hit to find the first. Nearer nodes come first.
    pub fn on_ray(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        limit: f64,
        mut visit: impl FnMut(u32, f64) -> f64,
    ) {
        let mut ray = Ray { origin, direction, limit };
        if ray.enters(&self.node_box(ROOT)).is_some() {
            self.cast(ROOT, &mut ray, &mut visit);
        }
    }

    fn cast(&self, at: u32, ray: &mut Ray, visit: &mut impl FnMut(u32, f64) -> f64) {
        let node = self.nodes.link(at);
        if node.is_leaf() {
            for &primitive in self.nodes.primitives_of(at) {
                if let Some(enter) = self.primitive_bounds(primitive).and_then(|own| ray.enters(&own)) {
                    ray.limit = visit(primitive, enter);
                }
            }
            return;
        }
        let enters = |child| ray.enters(&self.node_box(child)).map(|enter| (enter, child));
        let mut children = [enters(node.children), enters(node.children + 1)];
        if let [Some(a), Some(b)] = children
            && b.0 < a.0
        {
            children.swap(0, 1);
        }
        for (enter, child) in children.into_iter().flatten() {
            if enter <= ray.limit {
                self.cast(child, ray, visit);
            }
        }
    }

    /// Calls `visit` with each primitive whose box, and the boxes of all nodes above, are wanted.
    fn find(&self, wanted: impl Fn(&Aabb) -> bool, mut visit: impl FnMut(u32)) {
        self.find_below(ROOT, &wanted, &mut visit);
    }

    fn find_below(&self, at: u32, wanted: &impl Fn(&Aabb) -> bool, visit: &mut impl FnMut(u32)) {
        let node = self.nodes.link(at);
        if !wanted(&self.node_box(at)) {
            return;
        }
        if node.is_leaf() {
            for &primitive in self.nodes.primitives_of(at) {
                if self.primitive_bounds(primitive).is_some_and(|own| wanted(&own)) {
                    visit(primitive);
                }
            }
            return;
        }
        self.find_below(node.children, wanted, visit);
        self.find_below(node.children + 1, wanted, visit);
    }
}
