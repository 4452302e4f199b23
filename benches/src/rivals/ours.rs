//! Ours, as a user would call it.

use nearmiss::{
    Answer, CollideOptions, CollidePlan, CollideScratch, Evidence, Method as Search, Metric, Pose, Scan,
    Verdict, collide_with,
};

use crate::Failure;
use crate::asked::{Limits, best_effort};
use crate::rivals::{Method, Reply};

/// A prepared scan against a copy of itself, with a scratch that is kept.
#[derive(Debug, Clone)]
pub struct Ours<'a> {
    scan: &'a Scan,
    plan: CollidePlan,
    limits: Limits,
    scratch: CollideScratch,
}

impl<'a> Ours<'a> {
    /// Asks with these `options`, without a limit.
    ///
    /// # Errors
    /// When there is no plan for that.
    pub fn new(scan: &'a Scan, options: &CollideOptions) -> Result<Self, Failure> {
        let plan = CollidePlan::new(options, scan, scan)?;
        Ok(Self { scan, plan, limits: Limits::default(), scratch: CollideScratch::default() })
    }

    /// The same, each question within `limits`; hits are then best efforts.
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// The whole answer.
    pub fn answer(&mut self, a: &Pose, b: &Pose) -> Answer {
        let (a, b) = (self.scan.at(a), self.scan.at(b));
        collide_with(&a, &b, &self.plan, &self.limits.begin(), &mut self.scratch)
    }
}

impl Method for Ours<'_> {
    fn name(&self) -> String {
        let options = self.plan.options();
        let certified = if options.evidence == Evidence::Certified { ", certified" } else { "" };
        let order = match options.order {
            None => String::new(),
            Some(order) => format!(", {order:?}"),
        };
        let method = match options.method {
            Search::Sampling(sampling) => format!(", sampling {}", sampling.test_points),
            _ => String::new(),
        };
        let kernel = if options.metric == Some(Metric::Geodesic) { ", geodesic" } else { "" };
        let coverings = if options.coverings { ", coverings" } else { "" };
        format!("nearmiss ({:?}{certified}{kernel}{method}{order}{coverings})", options.detail).to_lowercase()
    }

    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply {
        let Answer { verdict, statistics, .. } = self.answer(a, b);
        let hit = matches!(best_effort(verdict), Verdict::Intersecting { .. });
        Reply { hit, evaluations: statistics.evaluations, node_pairs: statistics.node_pairs }
    }
}
