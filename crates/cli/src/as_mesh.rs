//! The option `--as-mesh` of commands about pairs: which inputs are compared by their triangles, and
//! which other options apply then.

use clap::ValueEnum;

use crate::collide::{CollideArgs, DetailName};
use crate::distance::DistanceArgs;
use crate::error::CliError;
use crate::search::{MethodName, OrderName, SearchArgs};

/// The names of the inputs that are compared as meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum AsMeshName {
    /// The first input
    A,
    /// The second input
    B,
    /// Both inputs
    Both,
}

impl AsMeshName {
    /// Returns the value as it is written.
    fn word(self) -> &'static str {
        match self {
            Self::A => "a",
            Self::B => "b",
            Self::Both => "both",
        }
    }

    /// Fails if `collide` was given an option that does not apply to meshes.
    pub(crate) fn check_collide(self, args: &CollideArgs) -> Result<(), CliError> {
        let of_meshes = self == Self::Both;
        let SearchArgs { order, resolution, .. } = args.search;
        let of_papers = matches!(order, Some(OrderName::Sides | OrderName::SidesByGap));
        self.refuse(&[
            ("--kernel", of_meshes && args.kernel.is_some()),
            ("--surface-only", of_meshes && args.meaning.surface_only),
            ("--thickened", of_meshes && args.meaning.thickened.is_some()),
            ("--margin", of_meshes && args.margin > 0.0),
            ("--evidence", of_meshes && args.evidence.is_some()),
            (
                "--detail",
                args.detail == DetailName::Manifold || of_meshes && args.detail == DetailName::Verdict,
            ),
            ("--order", of_papers || of_meshes && order.is_some()),
            ("--prove", args.prove.is_some()),
            ("--method", args.search.method != MethodName::Traversal),
            ("--flat", args.search.flat),
            ("--coverings", args.search.coverings),
            ("--resolution", resolution.is_some()),
            ("--surfels", args.search.surfels.is_some()),
            ("--image", args.image.is_some()),
        ])
    }

    /// Fails if `distance` was given an option that does not apply to meshes.
    pub(crate) fn check_distance(self, args: &DistanceArgs) -> Result<(), CliError> {
        let of_meshes = self == Self::Both;
        let relative = nearmiss::DistanceOptions::default().relative;
        self.refuse(&[
            ("--kernel", of_meshes && args.kernel.is_some()),
            ("--surface-only", of_meshes && args.meaning.surface_only),
            ("--thickened", of_meshes && args.meaning.thickened.is_some()),
            ("--relative", of_meshes && args.relative.to_bits() != relative.to_bits()),
            ("--image", args.image.is_some()),
        ])
    }

    /// Fails with the first option that was given.
    fn refuse(self, options: &[(&str, bool)]) -> Result<(), CliError> {
        let Some((name, _)) = options.iter().find(|(_, is_given)| *is_given) else { return Ok(()) };
        let what = if self == Self::Both { "two meshes" } else { "a mesh and a scan" };
        Err(CliError::Usage(format!(
            "--as-mesh {}: expected options that apply to {what}, got {name}; leave out {name}, or leave out \
             --as-mesh to compare points",
            self.word()
        )))
    }
}
