//! The side of b on which a point is, and its distance.
//!
//! Klein & Zachmann 2005 uses f_B for this everywhere, with its sign turned to the normal of the
//! nearest point. Here f_B is used only within the support radius; beyond, the nearest point gives
//! both, as in Hoppe et al. 1992.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::Status;

use super::sides::{CERTAIN, Side};
use crate::papers::Papers;

impl Papers<'_, '_> {
    /// The side of a world point; fast if `hint` is a point of b near it.
    pub(crate) fn side_at(&mut self, x: [f64; 3], hint: u32) -> Side {
        let [_, vb] = self.search.pair.views;
        let local = vb.stored_to_world().apply_inverse(x);
        // Beyond all support radii only the side matters.
        let reach = f64::from(vb.scan().plan().support_radius(self.search.pair.b.sampling_radius));
        let (near, steps) = vb.scan().nearest_point_within(hint as usize, local, reach);
        let meter = &mut self.search.pair.meter;
        meter.spent.neighbour_steps += u64::from(steps);
        meter.evaluated(1);
        let j = near as usize;
        let towards = Vector3::from(vb.point(j)) - Vector3::from(x);
        let away = towards.norm();
        let radius = self.search.pair.b.radii[j];
        let support_radius =
            f64::from(vb.scan().plan().support_radius(radius)) * vb.stored_to_world().scale();
        let sure = vb.graph().is_some_and(|graph| graph.confidence()[j] >= CERTAIN);
        let is_known = sure && vb.scan().is_oriented();
        if away < support_radius {
            let at = vb.evaluate_near(j, x, &mut self.search.gathers[1]);
            if at.status == Status::Ok {
                return Side { distance: -at.f, near, away, is_known };
            }
        }
        let normal = Vector3::from(self.search.pair.b.normals[j].map(f64::from));
        let normal = Vector3::from(vb.stored_to_world().rotate(normal.into()));
        let distance = if normal.dot(&towards) > 0.0 { -away } else { away };
        Side { distance, near, away, is_known }
    }

    /// The side of a point of a.
    pub(crate) fn side(&mut self, i: u32, hint: u32) -> Side {
        let [va, _] = self.search.pair.views;
        self.side_at(va.point(i as usize), hint)
    }

    /// The same, cached.
    pub(crate) fn side_again(&mut self, i: u32, hint: u32) -> Side {
        match *self.scratch.interpolation.sides.slot(i) {
            Some((point, side)) if point == i => side,
            _ => {
                let side = self.side(i, hint);
                *self.scratch.interpolation.sides.slot(i) = Some((i, side));
                side
            }
        }
    }
}
