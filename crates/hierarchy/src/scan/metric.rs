//! A scan's discs for another metric: recomputes everything that follows from f at the points.
//!
//! Boxes and coverings are recomputed from the new discs. The proofs about the surface are not
//! repeated: they hold for straight distances only. Enclosures and covering radii contain the
//! discs, but must not be used for certificates.

use std::ops::Range;

use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{chunks, map};
use nearmiss_lanes::vector::dot;
use nearmiss_surface::{Evaluation, Metric};

use crate::bounds::boxes::OrientedBox;
use crate::bounds::growth::Growth;
use crate::bounds::part::Part;
use crate::patch::alignment::align_leaves;
use crate::patch::classes::vote;
use crate::patch::covering::{Covering, Ground, Solid, coverings};
use crate::patch::extents::{Discs, boxes_of_discs};
use crate::patch::samples::samples;
use crate::patch::surfels::{Fit, Surfel, fitted, surfel_of};
use crate::point::disc::{DiscRadii, PointCode};
use crate::point::kind::{PointKind, ball, obstacle_ball};
use crate::point::spacing::Look;
use crate::scan::build::PointHierarchy;

impl PointHierarchy {
    /// Returns the metric of the stored normals, kinds, discs and boxes. Enclosures and covering
    /// radii are proven to contain the surface for the Euclidean metric only.
    #[must_use]
    pub fn metric(&self) -> Metric {
        self.meta.metric
    }

    /// Fits the surface at every point by another `metric`. `fit` returns f at a stored point, and
    /// adds the points that support it there to an empty list. Normals stay on their sides if they
    /// [are oriented](Self::is_oriented), and [sparse](PointKind::is_sparse) points stay sparse. On
    /// all cores with the feature `rayon`; the result does not depend on their number.
    ///
    /// # Panics
    /// If `fit` lists a point that does not exist.
    pub fn use_metric<S: Default>(
        &mut self,
        metric: Metric,
        fit: impl Fn(u32, &mut S, &mut Vec<u32>) -> Evaluation + Sync + Send,
    ) {
        let topology = self.topology;
        let leaves: Vec<Range<usize>> =
            (0..topology.leaves()).map(|leaf| topology.points_of_leaf(leaf)).collect();
        let surfels = chunks(&leaves, |leaves| {
            let (mut scratch, mut supporting, mut near) = (S::default(), Vec::new(), Vec::new());
            let surfel = |i: usize| {
                supporting.clear();
                let at = fit(id32(i), &mut scratch, &mut supporting);
                self.gather(&supporting, &mut near);
                self.surfel(i, &at, &near)
            };
            leaves.iter().cloned().flatten().map(surfel).collect::<Vec<_>>()
        });
        let mut surfels: Vec<Surfel> = surfels.into_iter().flatten().collect();
        let mut fits: Vec<Fit> = surfels.iter().map(|s| Fit::new(s.normal, s.code.kind())).collect();
        let neighbours = BlockBoxes::new(&self.arrays.blocks, self.len());
        vote(&neighbours.over(&self.arrays.blocks), self.positions(), &self.arrays.radii, &mut fits);
        let corrected: Vec<usize> =
            (0..fits.len()).filter(|&i| fits[i].kind() != surfels[i].code.kind()).collect();
        let discs = chunks(&corrected, |points| {
            let (mut scratch, mut supporting, mut near) = (S::default(), Vec::new(), Vec::new());
            let surfel = |&i: &usize| {
                supporting.clear();
                fit(id32(i), &mut scratch, &mut supporting);
                self.gather(&supporting, &mut near);
                let fit = Fit::new(self.on_its_side(i, fits[i].normal), fits[i].kind());
                surfel_of(&fit, self.positions()[i], &near)
            };
            points.iter().map(surfel).collect::<Vec<_>>()
        });
        for (i, disc) in corrected.into_iter().zip(discs.into_iter().flatten()) {
            surfels[i] = disc;
        }
        self.meta.metric = metric;
        self.replace(&surfels);
    }

    /// Copies some points into blocks.
    fn gather(&self, points: &[u32], blocks: &mut Vec<PointBlock>) {
        blocks.clear();
        for points in points.chunks(PointBlock::WIDTH) {
            let mut block = PointBlock::EMPTY;
            for (lane, &i) in points.iter().enumerate() {
                let support_radius = self.plan.support_radius(self.arrays.radii[i as usize]);
                self.plan.put(&mut block, lane, self.positions()[i as usize], support_radius);
            }
            blocks.push(block);
        }
    }

    /// Returns the disc of point `i`, given f there and the points `near` that support it.
    fn surfel(&self, i: usize, at: &Evaluation, near: &[PointBlock]) -> Surfel {
        let look = match self.kind(i) {
            PointKind::Line => Look::Line,
            PointKind::Sparse => Look::Sparse,
            _ => Look::Area,
        };
        let fit = fitted(at, look);
        let surfel = surfel_of(&fit, self.positions()[i], near);
        Surfel { normal: self.on_its_side(i, surfel.normal), ..surfel }
    }

    /// Returns `normal` on the side of the stored normal of point `i`.
    fn on_its_side(&self, i: usize, normal: [f32; 3]) -> [f32; 3] {
        if dot(normal, self.arrays.normals[i]) < 0.0 { normal.map(|c| -c) } else { normal }
    }

    /// Replaces the discs, and recomputes boxes and coverings.
    fn replace(&mut self, surfels: &[Surfel]) {
        let leaf_size = self.meta.leaf_size as usize;
        let mut normals: Vec<[f32; 3]> = surfels.iter().map(|s| s.normal).collect();
        let codes: Vec<PointCode> = surfels.iter().map(|s| s.code).collect();
        let discs = DiscRadii { codes: &codes, ..self.discs() };
        let dense = self.meta.dense as usize;
        let ball = |(i, (s, &r)): (usize, (&Surfel, &f32))| {
            let kind = s.code.kind();
            ball(kind, r, self.meta.sampling_radius).max(obstacle_ball(i, dense, kind, r))
        };
        let balls: Vec<f32> = surfels.iter().zip(&self.arrays.radii).enumerate().map(ball).collect();
        if !self.meta.is_oriented {
            align_leaves(&mut normals, leaf_size);
        }
        let (topology, positions) = (self.topology, self.positions());
        let of_points = Discs { normals: &normals, discs, balls: &balls };
        let mut boxes: Vec<OrientedBox> = self.boxes().collect();
        boxes_of_discs(
            &topology,
            &mut boxes,
            &self.arrays.blocks,
            &map(self.arrays.blocks.len(), |number| of_points.block(number)),
        );
        let growths: Vec<Growth> = topology.ids().map(|id| self.tree().growth(Part::Surface, id)).collect();
        let flat: Vec<Solid> =
            discs.iter().zip(&balls).map(|(disc, &ball)| Solid::of_disc(disc, ball)).collect();
        let ground = Ground {
            topology: &topology,
            boxes: &boxes,
            growths: &growths,
            positions,
            normals: &normals,
            radii: &self.arrays.radii,
            discs: &flat,
            cells: &flat,
        };
        let mut covered = vec![Covering::default(); topology.len()];
        let sample = |id| samples(&self.arrays.sample_lists, &topology, id, self.meta.samples);
        coverings(&ground, sample, &mut covered);
        self.arrays.normals = normals.into();
        self.arrays.codes = codes.into();
        self.arrays.coverings = covered.into();
        self.bound(&boxes);
    }
}
