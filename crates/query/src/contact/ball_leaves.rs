//! Comparison of leaves of which at least one contains balls. The lane tests of
//! [`leaf::ball_pair`](crate::leaf::ball_pair) find the pairs that meet; where a ball meets a
//! sheet, a witness is searched for on the sheet.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::LeafBlock;
use nearmiss_lanes::wide::{Bits, blocks_of, lanes_of};
use nearmiss_surface::project;

use crate::ask::answer::{Contact, Evidence};
use crate::contact::search::Surfaces;
use crate::leaf::ball_pair::Targets;

const WIDTH: usize = LeafBlock::WIDTH;

impl Surfaces<'_> {
    /// Compares the points of two leaves, at least one of which contains balls.
    #[cold]
    pub(crate) fn compare_balls(&mut self, [leaf_a, leaf_b]: [usize; 2]) -> ControlFlow<()> {
        let (a, b) = (self.pair.a, self.pair.b);
        let (of_a, of_b) = (a.leaves, b.leaves);
        let relative = self.pair.relative;
        // Rounding may increase the distance of two points by this much.
        let reach = self.reach + 2.0 * relative.slack();
        let level = self.pair.level;
        if of_a.has_balls(leaf_a) {
            for target in of_b.blocks(leaf_b) {
                let mut targets = None;
                for block in blocks_of(&of_a.points(leaf_a)) {
                    let near = self.pair.balls_of_a(level, block, target.0, reach)
                        & lanes_of(block, &of_a.points(leaf_a));
                    for lane in Bits(near) {
                        let i = block * WIDTH + lane;
                        let x = relative.point_back(a.position(i));
                        let radius = (a.obstacle_ball(i) + reach) * relative.scale_back();
                        let met =
                            targets.get_or_insert_with(|| Targets::new(b, target)).within(level, x, radius);
                        self.balls_meet(met, |lane| [i, target.1 + lane])?;
                    }
                }
            }
        }
        if !of_b.has_balls(leaf_b) {
            return ControlFlow::Continue(());
        }
        for target in of_a.blocks(leaf_a) {
            let mut targets = None;
            for block in blocks_of(&of_b.points(leaf_b)) {
                let near = self.pair.balls_of_b(level, block, target.0, reach)
                    & lanes_of(block, &of_b.points(leaf_b));
                for lane in Bits(near) {
                    let j = block * WIDTH + lane;
                    let x = relative.point(b.position(j));
                    let radius = b.obstacle_ball(j) * relative.scale() + reach;
                    // Balls of a were already compared with those of b.
                    let discs = targets.get_or_insert_with(|| Targets::new(a, target).discs());
                    let met = discs.within(level, x, radius);
                    self.balls_meet(met, |lane| [target.1 + lane, j])?;
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Records the contacts among the point pairs that have a bit in `near`.
    fn balls_meet(&mut self, near: u32, points: impl Fn(usize) -> [usize; 2]) -> ControlFlow<()> {
        for lane in Bits(near) {
            let pair = points(lane);
            self.pair.meter.leaf_work(1);
            let Some((contact, evidence)) = self.pair.single(pair).ball_contact(self.margin) else {
                continue;
            };
            self.tries += 1;
            self.met.get_or_insert(pair);
            let certified = match evidence {
                Evidence::Certified => Some(contact),
                Evidence::Estimated if self.is_settled() => None,
                Evidence::Estimated => self.ball_on_sheet(&contact, pair),
            };
            let enough = self.is_settled() || certified.is_some();
            let flow = self.record(contact, certified);
            if enough {
                return flow;
            }
        }
        ControlFlow::Continue(())
    }

    /// Returns a verified point on one scan's sheet inside the other's ball, or within the margin
    /// of it.
    fn ball_on_sheet(&mut self, contact: &Contact, [i, j]: [usize; 2]) -> Option<Contact> {
        if !self.verifies() {
            return None;
        }
        let [ra, rb] = self.pair.balls([i, j]);
        let (side, k) = if ra > 0.0 { (1, j) } else { (0, i) };
        let centre = [self.pair.views[0].point(i), self.pair.views[1].point(j)][1 - side];
        let (view, scratch) = (self.pair.views[side], &mut self.gathers[side]);
        let mut near = view.near(k, scratch);
        let foot = project(centre, |y| near.evaluate(y));
        self.pair.meter.evaluated(u64::from(foot.evaluations));
        let apart = (Vector3::from(foot.point) - Vector3::from(centre)).norm();
        let holds = foot.converged && apart <= ra + rb + self.margin && view.is_obstacle(k, foot.point);
        holds.then_some(Contact { point: foot.point, residual: 0.5 * apart, ..*contact })
    }
}
