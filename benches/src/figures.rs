//! What the programs that make the figures of a paper are asked for, and where these go.

use std::path::PathBuf;

use crate::Failure;
use crate::arguments::Arguments;
use crate::plot::{Panel, figure};

/// `-o FOLDER [--data FOLDER] [--poses N] [--seed N] [--only NUMBER] [--quick]`.
#[derive(Debug, Clone)]
pub struct FigureOptions {
    /// The folder to write to, which is there.
    pub out: PathBuf,
    /// Where objects are.
    pub data: Option<PathBuf>,
    /// How many poses at each distance.
    pub poses: usize,
    /// Seed of all that is random.
    pub seed: u64,
    /// The number of one figure, of all.
    pub only: Option<u32>,
    /// A look rather than a measurement.
    pub quick: bool,
}

impl FigureOptions {
    /// Takes them out of what `program` was given; `poses` by default, the former number if quick. Makes the
    /// folder.
    ///
    /// # Errors
    /// When one cannot be read, there is no folder to write to, or it cannot be made.
    pub fn take(arguments: &mut Arguments, program: &str, poses: [usize; 2]) -> Result<Self, Failure> {
        let quick = arguments.flag("--quick");
        let named: Option<PathBuf> = arguments.value("--data")?;
        let out: Option<PathBuf> = arguments.value("-o")?;
        let usage = || format!("usage: {program} -o FOLDER [--data FOLDER] [--poses N] [--only NUMBER]");
        let options = Self {
            out: out.ok_or_else(usage)?,
            data: named.or_else(|| std::env::var_os("NEARMISS_DATA").map(PathBuf::from)),
            poses: arguments.value("--poses")?.unwrap_or(poses[usize::from(!quick)]),
            seed: arguments.value("--seed")?.unwrap_or(1),
            only: arguments.value("--only")?,
            quick,
        };
        std::fs::create_dir_all(&options.out)?;
        Ok(options)
    }

    /// Whether any of these figures is asked for.
    #[must_use]
    pub fn wants(&self, figures: &[u32]) -> bool {
        self.only.is_none_or(|only| figures.contains(&only))
    }

    /// Writes a figure of `panels`, as SVG.
    ///
    /// # Errors
    /// When it cannot be drawn or written.
    pub fn save(&self, name: &str, panels: &[Panel]) -> Result<(), Failure> {
        Ok(std::fs::write(self.out.join(name), figure(panels)?)?)
    }
}
