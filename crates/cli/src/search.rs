//! The search options of `collide`: methods, orders and resolution.

use std::path::Path;

use clap::{Args, ValueEnum};
use nearmiss::{
    Brackets, CollideOptions, GraphOptions, Interpolation, Method, Order, Paths, Refinement, Sampling, Scan,
    SurfelSize,
};

use crate::error::CliError;
use crate::input::prepare_again;
use crate::parse::parse_radius;

/// Options of `collide` that control the search.
#[derive(Debug, Clone, Copy, Args)]
pub struct SearchArgs {
    /// Method that compares leaves
    ///
    /// `sampling` and `interpolation` compare surfaces alone, as --surface-only does.
    #[arg(long, value_enum, default_value_t = MethodName::Traversal, help_heading = "Research", hide_short_help = true)]
    pub method: MethodName,
    /// Search without the hierarchy, with `--method sampling` or `interpolation`
    #[arg(long, help_heading = "Research", hide_short_help = true)]
    pub flat: bool,
    /// Test points for each pair of leaves, with `--method sampling`
    #[arg(long, value_name = "N", default_value_t = Sampling::default().test_points, help_heading = "Research", hide_short_help = true)]
    pub test_points: u32,
    /// Largest |f_A| + |f_B| at which a test point counts as a contact, in sampling radii, with
    /// `--method sampling`
    #[arg(long, value_name = "RADII", default_value_t = Sampling::default().tolerance, help_heading = "Research", hide_short_help = true)]
    pub tolerance: f64,
    /// Number of surfels into which the surface of A is divided, with `--method interpolation --flat`
    ///
    /// A number, or `adapted` for surfels that are 8 sampling radii wide. The default is the number
    /// that `density --store` kept in the file of A, or else 30.
    #[arg(long, value_name = "A", value_parser = parse_surfels, help_heading = "Research", hide_short_help = true)]
    pub surfels: Option<SurfelSize>,
    /// Probability that every surfel contains a drawn point, with `--method interpolation --flat`
    #[arg(long, value_name = "P", default_value_t = Interpolation::default().probability, help_heading = "Research", hide_short_help = true)]
    pub probability: f64,
    /// Source of the second point of a bracket, with `--method interpolation --flat`
    #[arg(long, value_enum, default_value_t = BracketsName::Drawn, help_heading = "Research", hide_short_help = true)]
    pub brackets: BracketsName,
    /// Method that finds a point on both surfaces, with `--method interpolation`
    #[arg(long, value_enum, default_value_t = RefinementName::Newton, help_heading = "Research", hide_short_help = true)]
    pub refinement: RefinementName,
    /// Seed of random points
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Research", hide_short_help = true)]
    pub seed: u64,
    /// Order in which node pairs are visited; by default `depth`, or `overlap` with a budget
    #[arg(long, value_enum, help_heading = "Research", hide_short_help = true)]
    pub order: Option<OrderName>,
    /// Prune nodes by their sphere coverings where their boxes overlap
    #[arg(long, help_heading = "Research", hide_short_help = true)]
    pub coverings: bool,
    /// Finest resolution, in world units
    ///
    /// If the samples of a node cover its surface to within this length, the samples are compared and
    /// the node is not split. The answer is then estimated.
    #[arg(long, value_name = "LEN", allow_hyphen_values = true, value_parser = parse_radius, help_heading = "Budget and evidence")]
    pub resolution: Option<f64>,
}

/// The names of the methods that compare leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    /// By the tangent discs of their points
    Traversal,
    /// By random test points (Klein & Zachmann 2004, section 5.3); slower, not exhaustive
    Sampling,
    /// By searches along the proximity graphs of both scans, which `preprocess --graph` adds
    /// (Klein & Zachmann 2005); with --flat not exhaustive
    Interpolation,
}

/// The names of the sources of the second end of a bracket.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BracketsName {
    /// The nearest randomly drawn point on the other side
    Drawn,
    /// A point on the other side, about two surfel radii away, from the close-pairs map of A, which
    /// `preprocess --close-pairs` adds (Klein & Zachmann 2005, section 4.3)
    Annulus,
}

/// The names of the methods that find a point on both surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RefinementName {
    /// By Newton's method on both surfaces
    Newton,
    /// By random points in a sphere, to within 0.1 sampling radii of both surfaces (Klein & Zachmann
    /// 2005, section 4.6)
    Sphere,
    /// By a regular grid in a sphere, to within 0.1 sampling radii of both surfaces
    Grid,
}

/// The tolerance of `Sphere` and `Grid`: the largest distance from both surfaces, in sampling
/// radii.
const IN_A_SPHERE: f64 = 0.1;

/// The width of surfels adapted to the sampling density, in sampling radii.
const ADAPTED: f64 = 8.0;

fn parse_surfels(text: &str) -> Result<SurfelSize, String> {
    if text == "adapted" {
        return Ok(SurfelSize::Radius(ADAPTED));
    }
    let count = text.parse().ok().filter(|count| (1..=65_536).contains(count)).map(SurfelSize::Count);
    count.ok_or_else(|| "expected a number from 1 to 65536, or `adapted`".into())
}

/// The names of the traversal orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OrderName {
    /// Depth first; of the children of a pair, the one whose boxes overlap most comes first
    Depth,
    /// Pairs whose boxes overlap most come first
    Overlap,
    /// Pairs with many sample points of A on both sides of the surface of B come first (Klein &
    /// Zachmann 2004, section 5.2)
    Sides,
    /// As `sides`, with sample points weighted by the eigenvalue gap (Klein & Zachmann 2004, section 7)
    SidesByGap,
    /// First the pair for which the number of grid cells that both surfaces are expected to fill is
    /// greatest (Klein & Zachmann, slides, 2003)
    Cells,
}

impl SearchArgs {
    /// Returns `true` if the method searches along the proximity graphs of the scans.
    pub(crate) fn wants_graphs(&self) -> bool {
        self.method == MethodName::Interpolation
    }

    /// Returns `true` if the method looks up close pairs of a.
    fn wants_close_pairs(&self) -> bool {
        self.wants_graphs() && self.flat && self.brackets == BracketsName::Annulus
    }

    /// Returns the options of the graphs that the method needs.
    pub(crate) fn graph_options(&self) -> GraphOptions {
        GraphOptions::default().with_close_pairs(self.wants_close_pairs().then_some(Paths::Rebuilt))
    }

    /// Fails if a scan lacks the graph or the close pairs that the method needs. `paths` are those
    /// of the scans.
    pub(crate) fn check(&self, scans: [&Scan; 2], paths: [&Path; 2]) -> Result<(), CliError> {
        if !self.wants_graphs() {
            return Ok(());
        }
        for (scan, path) in scans.into_iter().zip(paths) {
            if scan.graph().is_none() {
                return Err(CliError::Usage(format!(
                    "{}: expected a proximity graph in both scans for --method interpolation, got none in this one; \
                     {}, or use --method traversal",
                    path.display(),
                    prepare_again(path, "--graph")
                )));
            }
        }
        let (a, path) = (scans[0], paths[0]);
        if self.wants_close_pairs() && a.graph().is_none_or(|graph| graph.close_pairs().is_none()) {
            return Err(CliError::Usage(format!(
                "{}: expected close pairs in the first scan for --brackets annulus, got none; {}, or use --brackets drawn",
                path.display(),
                prepare_again(path, "--close-pairs")
            )));
        }
        Ok(())
    }

    /// Returns `options` with these options applied. `a` provides the stored density.
    pub(crate) fn apply(&self, options: CollideOptions, a: &Scan) -> Result<CollideOptions, CliError> {
        if self.flat && self.method == MethodName::Traversal {
            let what = "--flat: expected --method sampling or interpolation, got --method traversal; change the method, or leave out --flat";
            return Err(CliError::Usage(what.into()));
        }
        let sampling = Sampling::default()
            .with_test_points(self.test_points)
            .with_tolerance(self.tolerance)
            .with_seed(self.seed)
            .with_flat(self.flat);
        let stored = a.density().map(|density| SurfelSize::Count(density.surfels.clamp(1, 65_536)));
        let interpolation = Interpolation::default()
            .with_surfels(self.surfels.or(stored).unwrap_or(Interpolation::default().surfels))
            .with_probability(self.probability)
            .with_brackets(match self.brackets {
                BracketsName::Drawn => Brackets::Drawn,
                BracketsName::Annulus => Brackets::Annulus,
            })
            .with_refinement(match self.refinement {
                RefinementName::Newton => Refinement::Newton,
                RefinementName::Sphere => Refinement::Sphere(IN_A_SPHERE),
                RefinementName::Grid => Refinement::Grid(IN_A_SPHERE),
            })
            .with_seed(self.seed)
            .with_flat(self.flat);
        let method = match self.method {
            MethodName::Traversal => Method::Traversal,
            MethodName::Sampling => Method::Sampling(sampling),
            MethodName::Interpolation => Method::Interpolation(interpolation),
        };
        let order = self.order.map(|order| match order {
            OrderName::Depth => Order::DepthFirst,
            OrderName::Overlap => Order::Overlap,
            OrderName::Sides => Order::Sides,
            OrderName::SidesByGap => Order::SidesByGap,
            OrderName::Cells => Order::Cells,
        });
        let options = options.with_method(method).with_coverings(self.coverings);
        Ok(order.map_or(options, |order| options.with_order(order)))
    }
}
