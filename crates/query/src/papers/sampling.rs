//! The random test of two surfaces (Klein & Zachmann 2004, §5.3).
//!
//! Test points are drawn in the sphere covering of a's leaf. The least |f_A| + |f_B| of those at
//! which both functions are defined estimates the distance of the surfaces (eq. 8). There are two
//! differences from the paper. A test point outside the volume of b's leaf is drawn again, as
//! nothing can be found there. A witness is searched for from the test point that detected the
//! intersection.

use std::ops::{ControlFlow, Range};

use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{NodePair, OrientedBox, Part};
use nearmiss_surface::{Evaluation, Status};

use crate::ask::answer::Contact;
use crate::ask::options::Sampling;
use crate::leaf::disc_pair::FAR;
use crate::pair::meter::{Meter, POINTS_A_PAIR};
use crate::pair::placed::Placed;
use crate::papers::Papers;
use crate::papers::random::{FLAT, below, place_in, stream};

/// Draws per test point inside both volumes before the test gives up.
const DRAWS: u32 = 8;

/// The cost of a draw, in node pairs.
const PAIRS_A_DRAW: u64 = 2;

/// Points visited between two clock reads.
const A_STRETCH: u32 = 256;

impl Papers<'_, '_> {
    /// `d_ε` in the world.
    fn tolerance(&self, sampling: &Sampling) -> f64 {
        let radius =
            |side: usize, own: f32| f64::from(own) * self.search.pair.views[side].stored_to_world().scale();
        sampling.tolerance
            * radius(0, self.search.pair.a.sampling_radius).max(radius(1, self.search.pair.b.sampling_radius))
    }

    /// Tests random points about the points of one leaf, in the volume of the other.
    pub(crate) fn test_leaves(&mut self, pair: NodePair, sampling: &Sampling) -> ControlFlow<()> {
        let volume =
            self.search.pair.relative.moved(&self.search.pair.b.tree.enclosure(Part::Surface, pair.b));
        let points = [
            self.search.pair.a.tree.topology().points(pair.a),
            self.search.pair.b.tree.topology().points(pair.b),
        ];
        let radius = self.search.pair.a.covering_radius(pair.a.index());
        let mut rng = stream(sampling.seed, pair);
        let mut draws = DRAWS * sampling.test_points;
        let mut accepted = 0;
        while accepted < sampling.test_points && draws > 0 {
            draws -= 1;
            self.draw()?;
            let i = points[0].start + below(&mut rng, points[0].len());
            let x = place_in(&mut rng, self.search.pair.a.position(i), radius);
            if volume.distance_sq(x) > 0.0 {
                continue;
            }
            accepted += 1;
            let contacts = self.search.all.as_ref().map(|all| all.len());
            self.test(x, [i, points[1].start], points.clone(), sampling)?;
            if self.search.all.as_ref().map(|all| all.len()) > contacts {
                break;
            }
        }
        ControlFlow::Continue(())
    }

    /// Tests random points about all points of a that are in the box of b.
    pub(crate) fn test_all(&mut self, sampling: &Sampling) -> ControlFlow<()> {
        // No volumes are compared here, so nothing is proven.
        self.search.compared.push(NodePair::ROOTS);
        let volume = self.search.pair.relative.moved(&self.search.pair.b.enclosure(0));
        let own = self.search.pair.a.tree.reach(NodeId::ROOT);
        let within = |bounds: &OrientedBox, p: [f32; 3]| bounds.distance_sq(p) <= own * own;
        self.scratch.members.clear();
        for (i, &p) in (0_u32..).zip(self.search.pair.views[0].scan().positions()) {
            if i % A_STRETCH == 0 {
                self.search.pair.meter.leaf_work(u64::from(A_STRETCH) / POINTS_A_PAIR);
                self.search.pair.meter.go_on()?;
            }
            if within(&volume, p) {
                self.scratch.members.push(i);
            }
        }
        if self.scratch.members.is_empty() {
            return ControlFlow::Continue(());
        }
        let leaf = u64::from(self.search.pair.views[0].scan().leaf_size());
        let wanted = (self.scratch.members.len() as u64 * u64::from(sampling.test_points))
            .div_ceil(leaf)
            .min(u64::from(sampling.most));
        let mut rng = stream(sampling.seed, FLAT);
        self.search.pair.meter.spent.leaf_pairs += 1;
        for _ in 0..wanted {
            self.draw()?;
            let i = self.scratch.members[below(&mut rng, self.scratch.members.len())] as usize;
            let x = place_in(&mut rng, self.search.pair.a.position(i), self.search.pair.a.radii[i]);
            if volume.distance_sq(x) <= 0.0 {
                let points = [self.search.pair.a, self.search.pair.b].map(|arrays| 0..arrays.normals.len());
                self.test(x, [i, 0], points, sampling)?;
            }
        }
        ControlFlow::Continue(())
    }

    /// Counts a draw, whether or not it becomes a test point.
    fn draw(&mut self) -> ControlFlow<()> {
        self.search.pair.meter.leaf_work(PAIRS_A_DRAW);
        self.search.pair.meter.go_on()
    }

    /// Tests one point in a's stored frame, probably near the points `about` of each scan. A
    /// contact must be near some of `points`.
    fn test(
        &mut self,
        x: [f32; 3],
        about: [usize; 2],
        points: [Range<usize>; 2],
        sampling: &Sampling,
    ) -> ControlFlow<()> {
        let [va, vb] = self.search.pair.views;
        let x = va.stored_to_world().apply(x.map(f64::from));
        let means = |at: &Evaluation| at.status == Status::Ok;
        self.search.pair.meter.evaluated(1);
        let at_a = va.evaluate_near(about[0], x, &mut self.search.gathers[0]);
        if !means(&at_a) {
            return ControlFlow::Continue(());
        }
        self.search.pair.meter.evaluated(1);
        let at_b = vb.evaluate_near(about[1], x, &mut self.search.gathers[1]);
        if !means(&at_b) {
            return ControlFlow::Continue(());
        }
        let distance = at_a.f.abs() + at_b.f.abs();
        // If all contacts are requested, a further one is as good as a nearer one.
        let nearest = if self.search.all.is_some() { f64::INFINITY } else { self.estimate };
        if distance >= nearest.min(self.tolerance(sampling)) {
            self.estimate = self.estimate.min(distance);
            return ControlFlow::Continue(());
        }
        let [of_a, of_b] = points;
        let meter = &mut self.search.pair.meter;
        let (Some(i), Some(j)) = (near(va, x, of_a, meter), near(vb, x, of_b, meter)) else {
            return ControlFlow::Continue(());
        };
        self.estimate = self.estimate.min(distance);
        let contact = Contact {
            point: x,
            normals: Some([at_a.normal, at_b.normal]),
            residual: at_a.f.abs().max(at_b.f.abs()),
            sources: [va.scan().id(i), vb.scan().id(j)],
        };
        self.search.hit(contact, i, j)
    }
}

/// The point nearest to `x`, if it is near enough for a surface to be there: f also vanishes
/// between two sheets (docs/theory). `None`, too, once the budget is spent.
fn near(view: &Placed<'_>, x: [f64; 3], points: Range<usize>, meter: &mut Meter) -> Option<usize> {
    let placed = view.stored_to_world();
    let local = placed.apply_inverse(x);
    let away_sq = |p: [f32; 3]| (Vector3::from(p.map(f64::from)) - Vector3::from(local)).norm_squared();
    let mut nearest = (f64::INFINITY, points.start);
    for start in points.clone().step_by(A_STRETCH as usize) {
        meter.go_on().continue_value()?;
        let end = points.end.min(start + A_STRETCH as usize);
        meter.leaf_work((end - start) as u64 / POINTS_A_PAIR);
        for i in start..end {
            let away = away_sq(view.scan().arrays().position(i));
            nearest = if away < nearest.0 { (away, i) } else { nearest };
        }
    }
    let (away, i) = nearest;
    let radius = f64::from(FAR * view.scan().radii()[i]);
    (away <= radius * radius).then_some(i)
}
