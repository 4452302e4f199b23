//! Options of the command line that several programs share: how ours is asked, and what that may cost.

use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use nearmiss::{
    Budget, CollideOptions, Contact, Deadline, Detail, Evidence, Interpolation, Method, Metric, Order,
    PointId, Reason, Sampling, SurfelSize, Verdict,
};

/// Orders by name.
pub const ORDERS: [(&str, Order); 4] = [
    ("depth", Order::DepthFirst),
    ("overlap", Order::Overlap),
    ("sides", Order::Sides),
    ("sides-by-gap", Order::SidesByGap),
];

/// How leaves are compared, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    /// By tangent discs of their points
    Traversal,
    /// By random test points (Klein & Zachmann 2004, section 5.3)
    Sampling,
    /// By searches along paths of the proximity graph (Klein & Zachmann 2005)
    Interpolation,
}

/// How a program asks ours.
#[derive(Debug, Clone, Copy, Args)]
pub struct Asking {
    /// Ask for a witness, not for the verdict alone
    #[arg(long)]
    pub witness: bool,
    /// Ask for certified evidence
    #[arg(long)]
    pub certified: bool,
    /// How leaves are compared
    #[arg(long, value_enum, default_value_t = MethodName::Traversal)]
    pub method: MethodName,
    /// Test points of a pair of leaves, with `--method sampling`
    #[arg(long, value_name = "N", default_value_t = Sampling::default().test_points)]
    pub test_points: u32,
    /// What |f_A| + |f_B| of a test point must be less than, in sampling radii, with `--method sampling`
    #[arg(long, value_name = "RADII", default_value_t = Sampling::default().tolerance)]
    pub tolerance: f64,
    /// The number of surfels, with `--method interpolation`
    #[arg(long, value_name = "N")]
    pub surfels: Option<u32>,
    /// The width of a surfel in sampling radii, with `--method interpolation`; overrides `--surfels`
    #[arg(long, value_name = "RADII")]
    pub surfel_radius: Option<f64>,
    /// Leave the hierarchy out, with `--method sampling` or `interpolation`
    #[arg(long)]
    pub flat: bool,
    /// Which pairs of nodes are looked at first
    #[arg(long, value_parser = orders())]
    pub order: Option<Order>,
    /// Let sphere coverings part nodes whose boxes overlap
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
        let options = CollideOptions::default()
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

/// The parser of the name of an order.
#[must_use]
pub fn orders() -> impl TypedValueParser<Value = Order> {
    named(ORDERS)
}

/// The parser of the name of a kernel.
#[must_use]
pub fn kernels() -> impl TypedValueParser<Value = Metric> {
    named([Metric::Euclidean, Metric::Geodesic].map(|kernel| (kernel.name(), kernel)))
}

/// The parser of these names, which gives what each stands for.
fn named<T, const N: usize>(all: [(&'static str, T); N]) -> impl TypedValueParser<Value = T>
where
    T: Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(all.each_ref().map(|(name, _)| *name)).try_map(move |given| {
        let found = all.iter().find(|(name, _)| *name == given);
        found.map(|(_, value)| value.clone()).ok_or("expected one of the names listed by --help")
    })
}

/// What a query may cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct Limits {
    /// Work units of a query
    #[arg(long, value_name = "N")]
    pub work: Option<u64>,
    /// Time of a query, in microseconds
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
    /// The budget of a query that begins now.
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

/// The best-effort answer: what is likelier, where a budget ended the search.
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
