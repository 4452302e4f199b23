//! The search methods of Klein & Zachmann's papers, for comparison:
//!
//! - test points (2004, §5.3);
//! - searches along the graph (2005, §4);
//! - priorities by sample points on either side (2004, §5.2);
//! - the order by well-filled cells (slides, 2003);
//! - sphere coverings (2004, §5.1);
//! - a resolution (2004, §1).
//!
//! They are visitors of the same descent as the default search and share its contacts and
//! certificates. The default search does not depend on them.

mod cells;
mod interpolation;
pub(crate) mod pacer;
mod priority;
mod random;
mod resolution;
mod sampling;

use std::ops::ControlFlow;

use nearmiss_hierarchy::{BoxVisitor, NodePair, Open, PairVisitor, Plunging, descend};

use crate::ask::answer::{Answer, Reason};
use crate::ask::options::{Method, Order};
use crate::contact::collide::{Asked, ContactScratch, Frontiers, Outputs, collide_by};
use crate::contact::search::Surfaces;
use crate::pair::meter::NODE_PAIRS_A_LEAF_PAIR;
use cells::CountedCells;
use interpolation::InterpolationScratch;

/// Memory that is reused between queries.
#[derive(Debug, Clone, Default)]
pub(crate) struct PapersScratch {
    interpolation: InterpolationScratch,
    /// The points of a in the box of b.
    members: Vec<u32>,
    /// The well-filled cells of both scans.
    cells: [CountedCells; 2],
}

/// A search for a crossing by one of the papers' methods.
struct Papers<'p, 'a> {
    search: &'p mut Surfaces<'a>,
    scratch: &'p mut PapersScratch,
    method: Method,
    order: Order,
    coverings: bool,
    /// Nodes whose samples are within this distance of their surface, in a's stored frame, are not
    /// split. Negative: all are split.
    resolution: f32,
    /// The least |f_A| + |f_B| of any test point, in the world.
    estimate: f64,
}

/// Answers a question that [uses a method of the papers](crate::CollidePlan::is_of_papers). A hint
/// is neither used nor changed.
pub(crate) fn collide(
    asked: Asked<'_>,
    (scratch, papers): (&mut ContactScratch, &mut PapersScratch),
    outputs: Outputs<'_>,
) -> Answer {
    let (options, budget) = (asked.plan.options(), asked.budget);
    let order = options.order.unwrap_or(if budget.may_end() { Order::Overlap } else { Order::DepthFirst });
    let [a, _] = asked.scans.map(|view| view.scan());
    let test_points = match options.method {
        Method::Traversal => 0,
        Method::Sampling(sampling) => u64::from(sampling.test_points),
        Method::Interpolation(_) => u64::from(a.leaf_size()),
    };
    let looked_at = match order {
        Order::Sides | Order::SidesByGap => a.arrays().samples(0).len() as u64,
        Order::DepthFirst | Order::Overlap | Order::Cells => 0,
    };
    let evaluations = 2 * test_points + NODE_PAIRS_A_LEAF_PAIR * looked_at;
    let mut estimate = f64::INFINITY;
    let outputs = Outputs { hint: None, ..outputs };
    let answer = collide_by(asked, evaluations, scratch, outputs, |search, frontiers| {
        let resolution = budget.resolution.map_or(-1.0, |length| search.pair.stored(length));
        let (method, coverings) = (options.method, options.coverings);
        let mut papers = Papers { search, scratch: papers, method, order, coverings, resolution, estimate };
        let flow = papers.look(frontiers);
        estimate = papers.estimate;
        flow
    });
    Answer { distance_estimate: Some(estimate).filter(|distance| distance.is_finite()), ..answer }
}

impl Papers<'_, '_> {
    fn look(&mut self, Frontiers { stack, heap }: &mut Frontiers) -> ControlFlow<()> {
        match self.method {
            Method::Sampling(sampling) if sampling.flat => return self.test_all(&sampling),
            Method::Interpolation(interpolation) => {
                self.scratch.interpolation.sides.clear();
                if interpolation.flat {
                    return self.interpolate_all(&interpolation);
                }
                if self.search.pair.views[0].graph().is_none() {
                    self.search.doubt = Some(Reason::NoGraph);
                    return ControlFlow::Continue(());
                }
            }
            Method::Sampling(_) | Method::Traversal => {}
        }
        if self.order == Order::Cells {
            let [a, b] = &mut self.scratch.cells;
            a.start(self.search.pair.a);
            b.start(self.search.pair.b);
        }
        let (relative, level) = (self.search.pair.relative, self.search.pair.level);
        let trees = self.search.pair.trees(&relative, self.search.reach);
        match self.order {
            Order::DepthFirst if self.search.wants_any() => {
                descend(trees, level, &mut Plunging::new(stack), self)
            }
            Order::DepthFirst => descend(trees, level, stack, self),
            _ => descend(trees, level, heap, self),
        }
    }
}

impl BoxVisitor for Papers<'_, '_> {
    const LOOKS_CLOSER: bool = true;

    fn urgency(&mut self, pair: NodePair, share: f32) -> Option<f32> {
        let is_by_share = matches!(self.order, Order::DepthFirst | Order::Overlap);
        let looks_closer = self.coverings || !is_by_share;
        if looks_closer { self.look_closer(pair, share) } else { Some(share) }
    }
}

impl PairVisitor for Papers<'_, '_> {
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.search.compared(pairs)
    }

    fn is_apart(&mut self, pair: NodePair) -> bool {
        self.search.pair.gap_by_leaf(pair).is_some_and(|gap| gap > self.search.reach)
    }

    fn is_fine(&self, pair: NodePair) -> [bool; 2] {
        if self.resolution >= 0.0 { self.nodes_are_fine(pair) } else { [false; 2] }
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], open: &Open) -> ControlFlow<()> {
        self.search.begin_leaves(leaves);
        let nodes = open.pair;
        let tries = self.search.tries;
        match self.method {
            Method::Traversal => self.search.compare_leaves(leaves, true),
            Method::Interpolation(interpolation) => {
                self.test_edges(nodes, &interpolation)?;
                if self.search.tries > tries {
                    return ControlFlow::Continue(());
                }
                self.search.compare_leaves(leaves, true)
            }
            Method::Sampling(sampling) => {
                self.search.compare_leaves(leaves, false)?;
                if self.search.tries > tries {
                    return ControlFlow::Continue(());
                }
                self.test_leaves(nodes, &sampling)
            }
        }
    }

    fn fine_pair(&mut self, pair: NodePair) -> ControlFlow<()> {
        if self.search.notes_leaves {
            self.search.compared.push(pair);
        }
        self.samples_meet(pair)
    }
}
