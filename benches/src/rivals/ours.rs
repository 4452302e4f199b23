//! The nearmiss library, as a user would call it.

use std::hint::black_box;

use fearless_simd::Level;
use nearmiss::{
    Answer, CollideOptions, CollidePlan, Evidence, Method as Search, Metric, Pair, Pose, Scan, Scratch,
    Verdict,
};

use crate::Failure;
use crate::asked::{Limits, best_effort};
use crate::rivals::method::{Method, Reply};

/// Two prepared scans, often one and a copy of itself, with a scratch that is reused.
#[derive(Debug, Clone)]
pub struct Ours<'a> {
    scans: [&'a Scan; 2],
    plan: CollidePlan,
    limits: Limits,
    scratch: Scratch,
    level: Option<Level>,
    /// Data read before each query to evict the scan from all caches.
    evicting: Vec<u64>,
}

/// Words to read before a query: 96 MiB, more than any last-level cache gives one core.
const EVICTING: usize = 12 << 20;

impl<'a> Ours<'a> {
    /// Queries with these `options`, without limits.
    ///
    /// # Errors
    /// When the options do not fit the scan.
    pub fn new(scan: &'a Scan, options: &CollideOptions) -> Result<Self, Failure> {
        Self::of([scan, scan], options)
    }

    /// Queries about two scans.
    ///
    /// # Errors
    /// When the options do not fit the scans.
    pub fn of(scans: [&'a Scan; 2], options: &CollideOptions) -> Result<Self, Failure> {
        let plan = CollidePlan::new(options, scans[0], scans[1])?;
        let scratch = Scratch::default();
        Ok(Self { scans, plan, limits: Limits::default(), scratch, level: None, evicting: Vec::new() })
    }

    /// The same method with each query within `limits`; hits are then best efforts.
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// The same method with this instruction set.
    #[must_use]
    pub fn by_level(self, level: Level) -> Self {
        Self { scratch: Scratch::by_level(level), level: Some(level), ..self }
    }

    /// The same method with cold caches.
    #[must_use]
    pub fn evicted(self) -> Self {
        Self { evicting: (0..EVICTING as u64).collect(), ..self }
    }

    /// The complete answer.
    pub fn answer(&mut self, a: &Pose, b: &Pose) -> Answer {
        let (a, b) = (self.scans[0].at(a), self.scans[1].at(b));
        Pair::new(a, b).within(&self.limits.begin()).collide(&self.plan, &mut self.scratch)
    }
}

impl Method for Ours<'_> {
    fn prepare(&mut self) {
        black_box(self.evicting.iter().fold(0, |sum, word| sum ^ word));
    }

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
        let level = self.level.map_or(String::new(), |level| format!(", {}", level_name(level)));
        let evicted = if self.evicting.is_empty() { "" } else { ", caches evicted" };
        let detail = options.detail;
        format!("nearmiss ({detail:?}{certified}{kernel}{method}{order}{coverings}{level}{evicted})")
            .to_lowercase()
    }

    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply {
        let Answer { verdict, statistics, .. } = self.answer(a, b);
        let hit = matches!(best_effort(verdict), Verdict::Intersecting { .. });
        Reply { hit, evaluations: statistics.evaluations, node_pairs: statistics.node_pairs }
    }
}

/// The name of an instruction set.
fn level_name(level: Level) -> String {
    let name = format!("{level:?}");
    name.split('(').next().unwrap_or_default().to_owned()
}
