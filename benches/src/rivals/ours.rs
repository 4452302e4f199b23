//! Ours, as a user would call it.

use nearmiss::{
    Answer, Budget, CollideOptions, CollidePlan, CollideScratch, Evidence, Pose, Scan, Verdict, collide_with,
};

use crate::Failure;
use crate::rivals::{Method, Reply};

/// A prepared scan against a copy of itself, with a scratch that is kept.
#[derive(Debug, Clone)]
pub struct Ours<'a> {
    scan: &'a Scan,
    plan: CollidePlan,
    budget: Budget,
    scratch: CollideScratch,
}

impl<'a> Ours<'a> {
    /// Asks with these `options`, without a limit.
    ///
    /// # Errors
    /// When there is no plan for that.
    pub fn new(scan: &'a Scan, options: &CollideOptions) -> Result<Self, Failure> {
        let plan = CollidePlan::new(options, scan, scan)?;
        Ok(Self { scan, plan, budget: Budget::UNLIMITED, scratch: CollideScratch::default() })
    }

    /// The same, with this budget for each question.
    #[must_use]
    pub fn with_budget(self, budget: Budget) -> Self {
        Self { budget, ..self }
    }

    /// The whole answer.
    pub fn answer(&mut self, a: &Pose, b: &Pose) -> Answer {
        let (a, b) = (self.scan.at(a), self.scan.at(b));
        collide_with(&a, &b, &self.plan, &self.budget, &mut self.scratch)
    }
}

impl Method for Ours<'_> {
    fn name(&self) -> String {
        let options = self.plan.options();
        let certified = if options.evidence == Evidence::Certified { ", certified" } else { "" };
        format!("nearmiss ({:?}{certified})", options.detail).to_lowercase()
    }

    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply {
        let Answer { verdict, statistics, .. } = self.answer(a, b);
        let hit = matches!(verdict, Verdict::Intersecting { .. });
        Reply { hit, evaluations: statistics.evaluations, node_pairs: statistics.node_pairs }
    }
}
