//! Command-line options that several programs share: options and budgets of a nearmiss query.

use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use nearmiss::{
    Budget, CollideOptions, Contact, Deadline, Detail, Evidence, Interpolation, Method, Metric, Order,
    PointId, Reason, Sampling, SurfelSize, Verdict,
};

/// Traversal orders by name.
pub const ORDERS: [(&str, Order); 5] = [
    ("depth", Order::DepthFirst),
    ("overlap", Order::Overlap),
    ("sides", Order::Sides),
    ("sides-by-gap", Order::SidesByGap),
    ("cells", Order::Cells),
];

/// Leaf tests by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    /// Tangent discs of the points
    Traversal,
    /// Random test points (Klein & Zachmann 2004, section 5.3)
    Sampling,
    /// Searches along paths of the proximity graph (Klein & Zachmann 2005)
    Interpolation,
}

/// Options of a nearmiss query.
#[derive(Debug, Clone, Copy, Args)]
pub struct Asking {
    /// Ask for a witness, not only for the verdict
    #[arg(long)]
    pub witness: bool,
    /// Ask for certified evidence
    #[arg(long)]
    pub certified: bool,
    /// The leaf test
    #[arg(long, value_enum, default_value_t = MethodName::Traversal)]
    pub method: MethodName,
    /// Test points per pair of leaves, with `--method sampling`
    #[arg(long, value_name = "N", default_value_t = Sampling::default().test_points)]
    pub test_points: u32,
    /// Upper limit of |f_A| + |f_B| at a test point, in sampling radii, with `--method sampling`
    #[arg(long, value_name = "RADII", default_value_t = Sampling::default().tolerance)]
    pub tolerance: f64,
    /// The number of surfels, with `--method interpolation`
    #[arg(long, value_name = "N")]
    pub surfels: Option<u32>,
    /// The width of a surfel in sampling radii, with `--method interpolation`; overrides
    /// `--surfels`
    #[arg(long, value_name = "RADII")]
    pub surfel_radius: Option<f64>,
    /// Skip the hierarchy, with `--method sampling` or `interpolation`
    #[arg(long)]
    pub flat: bool,
    /// The order in which node pairs are visited
    #[arg(long, value_parser = orders())]
    pub order: Option<Order>,
    /// Also prune node pairs with overlapping boxes whose sphere coverings are disjoint
    #[arg(long)]
    pub coverings: bool,
}

impl Asking {
    /// The options of a query.
    #[must_use]
    pub fn options(&self) -> CollideOptions {
        let sampling = Sampling::default()
            .with_test_points(self.test_points)
            .with_tolerance(self.tolerance)
            .with_flat(self.flat);
        let mut interpolation = Interpolation::default().with_flat(self.flat);
        let by_radius = self.surfel_radius.map(SurfelSize::Radius);
        if let Some(surfels) = by_radius.or(self.surfels.map(SurfelSize::Count)) {
            interpolation = interpolation.with_surfels(surfels);
        }
        let options = CollideOptions::estimated()
            .with_detail(if self.witness { Detail::Witness } else { Detail::Verdict })
            .with_evidence(if self.certified { Evidence::Certified } else { Evidence::Estimated })
            .with_method(match self.method {
                MethodName::Traversal => Method::Traversal,
                MethodName::Sampling => Method::Sampling(sampling),
                MethodName::Interpolation => Method::Interpolation(interpolation),
            })
            .with_coverings(self.coverings);
        self.order.map_or(options, |order| options.with_order(order))
    }
}

/// The parser of a traversal order's name.
#[must_use]
pub fn orders() -> impl TypedValueParser<Value = Order> {
    named(ORDERS)
}

/// The parser of a kernel's name.
#[must_use]
pub fn kernels() -> impl TypedValueParser<Value = Metric> {
    named([Metric::Euclidean, Metric::Geodesic].map(|kernel| (kernel.name(), kernel)))
}

/// The parser of these names; it returns the value that belongs to the name.
fn named<T, const N: usize>(all: [(&'static str, T); N]) -> impl TypedValueParser<Value = T>
where
    T: Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(all.each_ref().map(|(name, _)| *name)).try_map(move |given| {
        let found = all.iter().find(|(name, _)| *name == given);
        found.map(|(_, value)| value.clone()).ok_or("expected one of the names listed by --help")
    })
}

/// The limits of a query.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct Limits {
    /// Work units per query
    #[arg(long, value_name = "N")]
    pub work: Option<u64>,
    /// Time per query, in microseconds
    #[arg(long = "micros", value_name = "T", value_parser = microseconds)]
    pub time: Option<Duration>,
    /// Resolution, in the units of the poses
    #[arg(long, value_name = "LEN")]
    pub resolution: Option<f64>,
}

fn microseconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse::<f64>().ok().map(|micros| micros * 1e-6);
    seconds
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .ok_or_else(|| format!("expected a number of microseconds from 0 on, got {text:?}"))
}

impl Limits {
    /// The budget of a query that starts now.
    #[must_use]
    pub fn begin(&self) -> Budget {
        let mut budget = Budget::UNLIMITED;
        if let Some(units) = self.work {
            budget = budget.with_work(units);
        }
        if let Some(length) = self.resolution {
            budget = budget.with_resolution(length);
        }
        if let Some(time) = self.time {
            budget = budget.with_deadline(Deadline::within(time));
        }
        budget
    }
}

/// The best-effort answer: the likelier verdict if a budget ended the search.
#[must_use]
pub fn best_effort(verdict: Verdict) -> Verdict {
    let evidence = Evidence::Estimated;
    match verdict {
        Verdict::Undecided(Reason::Budget { likelihood }) if likelihood >= 0.5 => {
            let nowhere =
                Contact { point: [0.0; 3], normals: None, residual: 0.0, sources: [PointId(0), PointId(0)] };
            Verdict::Intersecting { contact: nowhere, evidence }
        }
        Verdict::Undecided(Reason::Budget { .. }) => Verdict::Separated { gap: 0.0, evidence },
        decided => decided,
    }
}
