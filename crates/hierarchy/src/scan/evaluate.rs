//! Evaluation of f, and the nearest stored point.

use nearmiss_index::PointBlock;
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_surface::{Centre, Evaluation};

use crate::point::gather::{GROUP, GROWN, GatherScratch, Index};
use crate::scan::build::PointHierarchy;

/// The distance, in local radii, up to which positions share the points that support them. Steps
/// onto a surface are seldom longer.
const SHARED: f32 = 0.25;

/// The implicit function near a stored point, for several positions. Returned by
/// [`PointHierarchy::near`].
#[derive(Debug)]
pub struct NearField<'a> {
    index: Index<'a>,
    scratch: &'a mut GatherScratch,
    margin: f32,
    /// The points that support positions within a distance of `centre` are gathered in `scratch`.
    centre: [f32; 3],
    within: f32,
}

impl NearField<'_> {
    /// Evaluates f at `x`, in the stored frame. Equals [`PointHierarchy::evaluate_with`].
    pub fn evaluate(&mut self, x: [f64; 3]) -> Evaluation {
        let centre = Centre::new(x);
        let d = sub(centre.rounded(), self.centre);
        let is_gathered = dot(d, d) <= self.within * self.within && self.within >= 0.0;
        if !is_gathered {
            self.gather(centre.rounded());
        }
        self.index.evaluate_gathered(x, &centre, self.scratch)
    }

    /// Gathers the points that support positions near `place`.
    fn gather(&mut self, place: [f32; 3]) {
        let distance = [self.margin, 0.0]
            .into_iter()
            .find(|&distance| self.index.list(self.scratch.block, place, distance * GROWN).is_some());
        let distance = distance.unwrap_or(0.0);
        self.index.gather(place, distance, self.scratch);
        (self.centre, self.within) = (place, distance);
    }
}

impl PointHierarchy {
    /// Evaluates f at `x`, in the stored frame.
    pub fn evaluate_with(&self, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        self.index().evaluate(x, scratch)
    }

    /// Like [`Self::evaluate_with`], but faster if `x` is within about a local radius of the stored
    /// point `i`: the list of that point's block is tried first.
    pub fn evaluate_near(&self, i: usize, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        scratch.block = i / PointBlock::WIDTH;
        self.index().evaluate(x, scratch)
    }

    /// Returns f for several positions near the stored point `i`, that is within about a local
    /// radius of it. If there is no such point, evaluations are slower.
    pub fn near<'a>(&'a self, i: usize, scratch: &'a mut GatherScratch) -> NearField<'a> {
        scratch.block = i / PointBlock::WIDTH;
        let margin = SHARED * self.arrays.radii.get(i).copied().unwrap_or(0.0);
        NearField { index: self.index(), scratch, margin, centre: [0.0; 3], within: -1.0 }
    }

    /// Like [`Self::evaluate_with`], but faster for a sequence of nearby positions along the
    /// surface that share the same scratch. If the last list is not complete at `x`, the list of
    /// the nearest block in it is tried. If that is not complete either, the list of the nearest
    /// point's block is used, which is complete on the surface.
    pub fn evaluate_onward(&self, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        let index = self.index();
        let place = Centre::new(x).rounded();
        if index.list(scratch.block, place, 0.0).is_none() {
            let next = index.next_block(scratch.block, place);
            scratch.block =
                next.filter(|&next| index.list(next, place, 0.0).is_some()).unwrap_or_else(|| {
                    let start = (scratch.block * PointBlock::WIDTH).min(self.len() - 1);
                    self.nearest_point_near(start, x) as usize / PointBlock::WIDTH
                });
        }
        index.evaluate(x, scratch)
    }

    /// Like [`Self::evaluate_with`], with n, and therefore the sign of f, on the side of Σ wᵢ nᵢ
    /// over the stored normals of the points that support x: f is positive below the surface. The
    /// status is ambiguous where these normals disagree, as between two sheets. Unless normals [are
    /// oriented](Self::is_oriented) the result is that of [`Self::evaluate_with`].
    pub fn evaluate_oriented_with(&self, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        let at = self.evaluate_with(x, scratch);
        if !self.meta.is_oriented || at.support == 0 {
            return at;
        }
        self.index().collect(scratch.level, Centre::new(x).rounded(), 0.0, &mut scratch.found);
        let (blocks, normals): (&[PointBlock], &[[f32; 3]]) = (&self.arrays.blocks, &self.arrays.normals);
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for &group in &scratch.found {
            let first = group as usize * GROUP;
            for (i, normal) in (first..).zip(&normals[first..(first + GROUP).min(normals.len())]) {
                let (block, lane) = (&blocks[i / PointBlock::WIDTH], i % PointBlock::WIDTH);
                let d = [0, 1, 2].map(|k| f64::from(block.position[k][lane]) - x[k]);
                let t = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
                    * f64::from(self.plan.decay(block.support_radius[lane]));
                if t < f64::from(self.plan.reach_sq()) {
                    #[expect(clippy::cast_possible_truncation, reason = "weights are single precision")]
                    let w = f64::from(self.plan.kernel().weight(t as f32));
                    total += w;
                    for (sum, n) in sum.iter_mut().zip(normal) {
                        *sum += w * f64::from(*n);
                    }
                }
            }
        }
        at.turned_to(sum, total)
    }

    /// Returns the stored point nearest to `x`, in the stored frame. Of equally near points it
    /// returns the first.
    #[must_use]
    pub fn nearest_point(&self, x: [f64; 3]) -> u32 {
        self.nearest_point_near(0, x)
    }

    /// Like [`Self::nearest_point`], but faster if `x` is near the stored point `i`.
    ///
    /// # Panics
    /// If there is no such point.
    #[must_use]
    pub fn nearest_point_near(&self, i: usize, x: [f64; 3]) -> u32 {
        self.nearest_listed(i, x).unwrap_or_else(|| self.nearest_point_within(i, x, f64::INFINITY).0)
    }

    /// Evaluates f at `x`, in the stored frame, with a newly allocated scratch.
    #[must_use]
    pub fn evaluate(&self, x: [f64; 3]) -> Evaluation {
        self.evaluate_with(x, &mut GatherScratch::default())
    }

    #[inline(always)]
    pub(crate) fn index(&self) -> Index<'_> {
        Index {
            tree: self.tree(),
            blocks: &self.arrays.blocks,
            groups: &self.arrays.groups,
            lists: &self.arrays.lists,
            listed: &self.arrays.listed,
            plan: &self.plan,
            supports: None,
        }
    }
}
