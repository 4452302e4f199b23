//! How `collide` searches: methods, orders, resolution.

use clap::{Args, ValueEnum};
use nearmiss::{CollideOptions, Method, Order, Sampling};

use crate::collide::parse_radius;
use crate::error::CliError;

/// Options of `collide` that say how to search.
#[derive(Debug, Clone, Copy, Args)]
pub struct SearchArgs {
    /// How leaves are compared
    #[arg(long, value_enum, default_value_t = MethodName::Traversal)]
    pub method: MethodName,
    /// Leave the hierarchy out: test points about all points of a in the box of b
    #[arg(long)]
    pub flat: bool,
    /// Test points for each pair of leaves, with `--method sampling`
    #[arg(long, value_name = "N", default_value_t = Sampling::default().test_points)]
    pub test_points: u32,
    /// What |f_A| + |f_B| of a test point must be less than, in sampling radii, with `--method sampling`
    #[arg(long, value_name = "RADII", default_value_t = Sampling::default().tolerance)]
    pub tolerance: f64,
    /// What random test points come from
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Which pairs of nodes are looked at first; by default depth first, or by overlap under a budget
    #[arg(long, value_enum)]
    pub order: Option<OrderName>,
    /// Let sphere coverings part nodes whose boxes overlap
    #[arg(long)]
    pub coverings: bool,
    /// Look no finer than this, in world units: samples answer for what is below
    #[arg(long, value_name = "LEN", allow_hyphen_values = true, value_parser = parse_radius)]
    pub resolution: Option<f64>,
}

/// How leaves are compared, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    /// By tangent discs of their points
    Traversal,
    /// By random test points (Klein & Zachmann 2004, section 5.3): slower, and not exhaustive
    Sampling,
}

/// Orders, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OrderName {
    /// Depth first, of siblings the deepest overlap first
    Depth,
    /// Of all pairs those whose boxes overlap most of each other
    Overlap,
    /// Of all pairs those with most sample points on either side of the other surface (section 5.2)
    Sides,
    /// The same, weighing with the eigenvalue gap
    SidesByGap,
}

impl SearchArgs {
    /// `options` with these.
    pub(crate) fn apply(&self, options: CollideOptions) -> Result<CollideOptions, CliError> {
        if self.flat && self.method != MethodName::Sampling {
            let what = "--flat leaves the hierarchy out of --method sampling; say that, or leave --flat out";
            return Err(CliError::Usage(what.into()));
        }
        let sampling = Sampling::default()
            .with_test_points(self.test_points)
            .with_tolerance(self.tolerance)
            .with_seed(self.seed)
            .with_flat(self.flat);
        let method = match self.method {
            MethodName::Traversal => Method::Traversal,
            MethodName::Sampling => Method::Sampling(sampling),
        };
        let order = self.order.map(|order| match order {
            OrderName::Depth => Order::DepthFirst,
            OrderName::Overlap => Order::Overlap,
            OrderName::Sides => Order::Sides,
            OrderName::SidesByGap => Order::SidesByGap,
        });
        let options = options.with_method(method).with_coverings(self.coverings);
        Ok(order.map_or(options, |order| options.with_order(order)))
    }
}
