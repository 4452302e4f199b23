//! The option `--as-mesh` of commands about pairs: the inputs that are compared by their triangles.

use clap::ValueEnum;

use crate::error::CliError;

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

    /// Fails with the first of these options that was given.
    pub(crate) fn refuse(self, options: &[(&str, bool)]) -> Result<(), CliError> {
        let Some((name, _)) = options.iter().find(|(_, is_given)| *is_given) else { return Ok(()) };
        let what = if self == Self::Both { "two meshes" } else { "a mesh and a scan" };
        Err(CliError::Usage(format!(
            "--as-mesh {}: expected options that apply to {what}, got {name}; leave out {name}, or leave out \
             --as-mesh to compare points",
            self.word()
        )))
    }
}
