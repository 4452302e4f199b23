//! The options of `collide`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};

use crate::as_mesh::AsMeshName;
use crate::contacts::ContactArgs;
use crate::error::CliError;
use crate::eval::KernelName;
use crate::meaning::MeaningArgs;
use crate::parse::{parse_duration, parse_radius, parse_threads, parse_work};
use crate::path::PathArgs;
use crate::penetration::SolidName;
use crate::posing::PairArgs;
use crate::search::{MethodName, OrderName, SearchArgs};
use crate::viewpoint::ViewArgs;

/// Options of `collide`.
#[derive(Debug, Clone, Args)]
pub struct CollideArgs {
    /// The scans and their poses
    #[command(flatten)]
    pub pair: PairArgs,
    /// The options for many poses
    #[command(flatten)]
    pub path: PathArgs,
    /// Stop at the first contact of --poses
    #[arg(long, requires = "poses")]
    pub first: bool,
    /// Metric of the kernel that defines the surfaces; by default the one the scans were prepared for
    ///
    /// Raw inputs are prepared for the kernel given here. With the geodesic kernel, surfaces alone are
    /// compared and separations are estimated.
    #[arg(long, value_enum, conflicts_with = "thickened", help_heading = "Research", hide_short_help = true)]
    pub kernel: Option<KernelName>,
    /// The meaning of the scans
    #[command(flatten)]
    pub meaning: MeaningArgs,
    /// Compare the triangles of these inputs instead of points
    ///
    /// `both` does what `mesh-collide` does. With `a` or `b`, the other input is a scan. Like scans,
    /// meshes are hollow: what is wholly inside one does not touch it. Only --penetration counts that as
    /// an overlap.
    #[arg(long, value_enum, value_name = "WHICH")]
    pub as_mesh: Option<AsMeshName>,
    /// Count scans as touching if they come nearer than this, in world units
    #[arg(long, value_name = "D", allow_hyphen_values = true, value_parser = parse_radius, default_value = "0")]
    pub margin: f64,
    /// Evidence required of a separation
    ///
    /// A certified separation is proven. With the proof, a query takes 1.5 times as long on average,
    /// and two to three times near contact. The default is `certified`, or `estimated` with the
    /// geodesic kernel.
    #[arg(long, value_enum, help_heading = "Budget and evidence")]
    pub evidence: Option<EvidenceName>,
    /// Write the proof of each certified answer as a line of JSON, for an independent check
    #[arg(long, value_name = "FILE", conflicts_with = "thickened", help_heading = "Output")]
    pub prove: Option<PathBuf>,
    /// Time limit for each query, such as 200us
    ///
    /// The unit is ns, us, ms or s; 50us to 1ms is common. When time runs out, the answer is
    /// undecided, with a likelihood of contact.
    #[arg(long, value_name = "200us", allow_hyphen_values = true, value_parser = parse_duration, help_heading = "Budget and evidence")]
    pub budget: Option<Duration>,
    /// Work limit for each query; reproducible, unlike time
    ///
    /// A unit is one evaluation of f or one node pair; 500 to 10000 is common.
    #[arg(long, value_name = "N", value_parser = parse_work, help_heading = "Budget and evidence")]
    pub work: Option<u64>,
    /// Level of detail of a contact
    #[arg(long, value_enum, default_value_t = DetailName::Witness)]
    pub detail: DetailName,
    /// Find all contacts, not one
    ///
    /// One contact is reported for each pair of leaves that touch, or with --flat for each bracket.
    /// Contacts are accurate to first order.
    #[arg(long)]
    pub all: bool,
    /// The treatment of the contacts
    #[command(flatten)]
    pub contacts: ContactArgs,
    /// Also report how far and in which direction to move B out of A
    ///
    /// The distance is reported as a lower and an upper bound, which hold even if --budget or --work ends the
    /// search. Name scans with a closed surface by --solid.
    #[arg(long)]
    pub penetration: bool,
    /// Scans whose closed surface encloses a solid, for --penetration
    ///
    /// Not for meshes: their closed parts are solid. What is inside a solid overlaps it. Other scans
    /// are surfaces without inside, such as rooms. Without a solid scan there is no lower bound, except
    /// with --thickened.
    #[arg(long, value_enum, value_name = "WHICH", requires = "penetration", conflicts_with = "thickened")]
    pub solid: Option<SolidName>,
    /// The search options
    #[command(flatten)]
    pub search: SearchArgs,
    /// Threads; 0 for all cores
    ///
    /// By default, raw inputs are prepared on all cores and --poses are answered on one. The answers do
    /// not depend on the number of threads.
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Budget and evidence")]
    pub threads: Option<usize>,
    /// Draw both scans and the place where they touch, as PNG
    #[arg(long, value_name = "OUT.png", conflicts_with = "poses", help_heading = "Output")]
    pub image: Option<PathBuf>,
    /// From where the picture is taken
    #[command(flatten)]
    pub view: ViewArgs,
    /// Print one JSON object for each query
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

/// The names of the levels of detail of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DetailName {
    /// Existence only, to first order; fastest
    Verdict,
    /// A point on both surfaces, verified where possible
    Witness,
    /// Several well-spread points, each with a normal and a gap, for a solver
    Manifold,
}

/// The names of the kinds of evidence of a separation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EvidenceName {
    /// Proven: volumes that enclose the scans are disjoint
    Certified,
    /// Found by an exhaustive search, without proof; faster
    Estimated,
}

impl CollideArgs {
    /// Fails if an option was given that does not apply to meshes.
    pub(crate) fn check_as_mesh(&self, which: AsMeshName) -> Result<(), CliError> {
        let of_meshes = which == AsMeshName::Both;
        let SearchArgs { order, resolution, .. } = self.search;
        let of_papers = matches!(order, Some(OrderName::Sides | OrderName::SidesByGap | OrderName::Cells));
        which.refuse(&[
            ("--kernel", of_meshes && self.kernel.is_some()),
            ("--surface-only", of_meshes && self.meaning.surface_only),
            ("--thickened", of_meshes && self.meaning.thickened.is_some()),
            ("--margin", of_meshes && self.margin > 0.0),
            ("--evidence", of_meshes && self.evidence.is_some()),
            (
                "--detail",
                self.detail == DetailName::Manifold || of_meshes && self.detail == DetailName::Verdict,
            ),
            ("--order", of_papers || of_meshes && order.is_some()),
            ("--solid", of_meshes && self.solid.is_some()),
            ("--solid a", which == AsMeshName::A && self.solid == Some(SolidName::A)),
            ("--solid b", which == AsMeshName::B && self.solid == Some(SolidName::B)),
            ("--solid both", self.solid == Some(SolidName::Both)),
            ("--prove", self.prove.is_some()),
            ("--method", self.search.method != MethodName::Traversal),
            ("--flat", self.search.flat),
            ("--coverings", self.search.coverings),
            ("--resolution", resolution.is_some()),
            ("--surfels", self.search.surfels.is_some()),
            ("--image", !of_meshes && self.image.is_some()),
        ])
    }
}
