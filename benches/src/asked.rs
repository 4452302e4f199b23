//! How a program here asks ours: options of the command line that several share.

use std::time::Duration;

use nearmiss::{
    Budget, CollideOptions, Contact, Deadline, Detail, Evidence, Interpolation, Method, Metric, Order,
    PointId, Reason, Sampling, Surfels, Verdict,
};

use crate::Failure;
use crate::arguments::Arguments;

/// Orders by name.
pub const ORDERS: [(&str, Order); 4] = [
    ("depth", Order::DepthFirst),
    ("overlap", Order::Overlap),
    ("sides", Order::Sides),
    ("sides-by-gap", Order::SidesByGap),
];

/// Reads `--witness`, `--certified`, `--method traversal|sampling|interpolation`, `--test-points N`,
/// `--tolerance R`, `--surfels A`, `--surfel-radius R`, `--flat`, `--order NAME` and `--coverings`.
///
/// # Errors
/// When a value cannot be read, or names nothing.
pub fn options(arguments: &mut Arguments) -> Result<CollideOptions, Failure> {
    let detail = if arguments.flag("--witness") { Detail::Witness } else { Detail::Verdict };
    let evidence = if arguments.flag("--certified") { Evidence::Certified } else { Evidence::Estimated };
    let mut sampling = Sampling::default().with_flat(arguments.flag("--flat"));
    if let Some(test_points) = arguments.value("--test-points")? {
        sampling = sampling.with_test_points(test_points);
    }
    if let Some(tolerance) = arguments.value("--tolerance")? {
        sampling = sampling.with_tolerance(tolerance);
    }
    let mut interpolation = Interpolation::default().with_flat(sampling.flat);
    if let Some(surfels) = arguments.value("--surfels")? {
        interpolation = interpolation.with_surfels(Surfels::Count(surfels));
    }
    if let Some(radii) = arguments.value("--surfel-radius")? {
        interpolation = interpolation.with_surfels(Surfels::Radius(radii));
    }
    let method = match arguments.value::<String>("--method")?.as_deref() {
        None | Some("traversal") => Method::Traversal,
        Some("sampling") => Method::Sampling(sampling),
        Some("interpolation") => Method::Interpolation(interpolation),
        Some(other) => return Err(format!("no method {other:?}").into()),
    };
    let order = order(arguments)?;
    let options = CollideOptions::default()
        .with_detail(detail)
        .with_evidence(evidence)
        .with_method(method)
        .with_coverings(arguments.flag("--coverings"));
    Ok(order.map_or(options, |order| options.with_order(order)))
}

/// Reads `--order NAME`.
///
/// # Errors
/// When there is no such order.
pub fn order(arguments: &mut Arguments) -> Result<Option<Order>, Failure> {
    let Some(name) = arguments.value::<String>("--order")? else { return Ok(None) };
    let order = ORDERS.iter().find(|(known, _)| *known == name);
    Ok(Some(order.ok_or_else(|| format!("no order {name:?}"))?.1))
}

/// Reads `--kernel euclidean|geodesic`.
///
/// # Errors
/// When there is no such kernel.
pub fn kernel(arguments: &mut Arguments) -> Result<Metric, Failure> {
    let Some(name) = arguments.value::<String>("--kernel")? else { return Ok(Metric::default()) };
    let kernel = [Metric::Euclidean, Metric::Geodesic].into_iter().find(|kernel| kernel.name() == name);
    Ok(kernel.ok_or_else(|| format!("no kernel {name:?}"))?)
}

/// What a query may cost.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Limits {
    /// Work units.
    pub work: Option<u64>,
    /// Time.
    pub time: Option<Duration>,
    /// Resolution, in the units of the poses.
    pub resolution: Option<f64>,
}

impl Limits {
    /// Reads `--work N`, `--micros T` and `--resolution LEN`.
    ///
    /// # Errors
    /// When a value cannot be read.
    pub fn read(arguments: &mut Arguments) -> Result<Self, Failure> {
        Ok(Self {
            work: arguments.value("--work")?,
            time: arguments.value::<f64>("--micros")?.map(|t| Duration::from_secs_f64(t * 1e-6)),
            resolution: arguments.value("--resolution")?,
        })
    }

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
