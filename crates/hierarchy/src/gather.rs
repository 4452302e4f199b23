//! The points that f(x) needs: those whose horizon reaches x, by a short descent in canonical order.

use nearmiss_surface::{Centre, Evaluation, Neighbourhood, PointBlock, SurfacePlan};

use crate::boxes::{OrientedBox, dot, sub};
use crate::split::id32;
use crate::topology::Node;

/// Room for a descent that keeps at most one sibling a level: trees of 2³² points have 31 levels at most.
pub(crate) const TREE_STACK: usize = 64;

/// Reused between evaluations; never influences a result.
#[derive(Debug, Clone, Default)]
pub struct GatherScratch {
    pub(crate) near: Neighbourhood,
    /// Points that may reach some point of a ball, in canonical order.
    candidates: Vec<([f32; 3], f32)>,
    /// The candidates side by side.
    blocks: Vec<PointBlock>,
    /// The same about a larger ball: the points that may reach a surface point nearest to one of the smaller.
    pub(crate) surroundings: Vec<([f32; 3], f32)>,
    /// How much larger.
    pub(crate) reach: f32,
}

impl GatherScratch {
    /// Keeps the points whose horizon may reach the ball of `radius` about `centre`.
    pub(crate) fn collect(&mut self, index: &Index<'_>, centre: [f32; 3], radius: f32) {
        let Self { candidates, .. } = self;
        candidates.clear();
        let within = |d_sq: f32, reach: f32| {
            let far = (index.plan.horizon(reach) + radius) * (1.0 + 1e-5);
            d_sq < far * far
        };
        index.descend(
            |id| within(index.boxes[id].distance_sq(centre), index.boxes[id].reach),
            |node| {
                for i in node.points() {
                    let d = sub(index.positions[i], centre);
                    if within(dot(d, d), index.radii[i]) {
                        candidates.push((index.positions[i], index.radii[i]));
                    }
                }
            },
        );
    }

    /// As [`Self::collect`], and collects what may reach a surface point nearest to one of the ball; `guess` is what
    /// the greatest local radius near it may be.
    pub(crate) fn collect_widely(
        &mut self,
        index: &Index<'_>,
        centre: [f32; 3],
        radius: f32,
        mut guess: f32,
    ) {
        // The wider collection comes first, for the narrower is part of it. A good guess saves a second descent.
        loop {
            self.collect(index, centre, radius + 0.5 * index.plan.horizon(guess));
            let Self { candidates, surroundings, .. } = self;
            std::mem::swap(candidates, surroundings);
            candidates.clear();
            let mut greatest = 0.0_f32;
            for &(p, own) in &*surroundings {
                let d = sub(p, centre);
                let far = (index.plan.horizon(own) + radius) * (1.0 + 1e-5);
                if dot(d, d) < far * far {
                    candidates.push((p, own));
                    greatest = greatest.max(own);
                }
            }
            self.reach = 0.5 * index.plan.horizon(greatest);
            if greatest <= guess {
                self.pack(index.plan);
                return;
            }
            guess = greatest;
        }
    }

    /// Puts the candidates side by side.
    pub(crate) fn pack(&mut self, plan: &SurfacePlan) {
        let Self { candidates, blocks, .. } = self;
        blocks.clear();
        for chunk in candidates.chunks(PointBlock::WIDTH) {
            let mut block = PointBlock::EMPTY;
            for (lane, &(p, radius)) in chunk.iter().enumerate() {
                block.set(lane, plan, p, radius);
            }
            blocks.push(block);
        }
    }

    /// As [`Index::gather`], from the points collected about a ball in which `x` lies.
    pub(crate) fn gather_collected(&mut self, plan: &SurfacePlan, x: [f64; 3]) {
        let Self { near, blocks, .. } = self;
        near.clear();
        let centre = Centre::new(x);
        for block in &*blocks {
            near.offer_block(plan, &centre, block);
        }
    }
}

/// A scan near some place: several evaluations there share one descent.
#[derive(Debug)]
pub struct Vicinity<'a> {
    index: Index<'a>,
    scratch: &'a mut GatherScratch,
    centre: [f64; 3],
    radius: f64,
}

impl<'a> Vicinity<'a> {
    pub(crate) fn new(
        index: Index<'a>,
        centre: [f64; 3],
        radius: f64,
        scratch: &'a mut GatherScratch,
    ) -> Self {
        let rounded = Centre::new(centre).rounded();
        // Grown by more than the rounding of the centre.
        let reach = centre.iter().fold(radius, |m, c| m.max(c.abs()));
        #[expect(clippy::cast_possible_truncation, reason = "grown by more than the rounding")]
        scratch.collect(&index, rounded, (radius + 1e-6 * reach) as f32);
        scratch.pack(index.plan);
        Self { index, scratch, centre, radius }
    }

    /// f at `x`: the same to the last bit as [`crate::PointHierarchy::evaluate`], anywhere.
    pub fn evaluate(&mut self, x: [f64; 3]) -> Evaluation {
        let away = (0..3).map(|k| (x[k] - self.centre[k]).powi(2)).sum::<f64>();
        if away <= self.radius * self.radius {
            self.scratch.gather_collected(self.index.plan, x);
        } else {
            self.index.gather(x, &mut self.scratch.near);
        }
        self.scratch.near.evaluate(self.index.plan, x)
    }
}

/// What a descent to neighbours reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Index<'a> {
    pub(crate) nodes: &'a [Node],
    pub(crate) boxes: &'a [OrientedBox],
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) radii: &'a [f32],
    pub(crate) plan: &'a SurfacePlan,
}

impl Index<'_> {
    /// Fills `near` with the points whose horizon reaches `x`, in canonical order.
    pub(crate) fn gather(&self, x: [f64; 3], near: &mut Neighbourhood) {
        near.clear();
        let centre = Centre::new(x);
        let rounded = centre.rounded();
        self.descend(
            |id| {
                let horizon = self.plan.horizon(self.boxes[id].reach);
                self.boxes[id].distance_sq(rounded) < horizon * horizon
            },
            |node| {
                for i in node.points() {
                    near.offer(self.plan, &centre, self.positions[i], self.radii[i]);
                }
            },
        );
    }

    /// Calls `visit` for every leaf that `admit` lets through together with all its ancestors, in order.
    pub(crate) fn descend(&self, admit: impl Fn(usize) -> bool, mut visit: impl FnMut(&Node)) {
        let mut stack = [0_u32; TREE_STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let id = stack[top] as usize;
            if !admit(id) {
                continue;
            }
            let node = &self.nodes[id];
            if node.is_leaf() {
                visit(node);
            } else if top + 2 <= TREE_STACK {
                stack[top] = node.right;
                stack[top + 1] = id32(id) + 1;
                top += 2;
            }
        }
    }
}
