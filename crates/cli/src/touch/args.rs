//! The options of `touch`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::parse::{parse_duration, parse_radius, parse_work};
use crate::preprocess::parse_threads;
use crate::units::UnitName;

/// Options of `touch`.
#[derive(Debug, Clone, Args)]
pub struct TouchArgs {
    /// Prepared scan (.nm), or a point cloud or mesh, which is prepared on the fly
    pub scan: PathBuf,
    /// Shapes in world units, one JSON object on each line; `-` reads standard input
    ///
    /// The forms are `{"sphere":{"centre":[x,y,z],"radius":r}}`,
    /// `{"capsule":{"ends":[[x,y,z],[x,y,z]],"radius":r}}`, `{"box":{"pose":[16, 12 or 7
    /// numbers],"half":[x,y,z]}}`, `{"cylinder":{"pose":[…],"half_height":h,"radius":r}}`,
    /// `{"cone":{…}}`, `{"hull":{"points":[[x,y,z],…]}}`, `{"triangle":{"points":[…]}}` and
    /// `{"segment":{"points":[…]}}`. A cylinder's axis is the y axis of its pose; a cone has the same
    /// fields, and its tip is at +y. A `radius` also rounds boxes, hulls, triangles and segments;
    /// `rounding` rounds cylinders and cones. Each shape gets one line of output, in order.
    #[arg(long, value_name = "FILE.jsonl")]
    pub shapes: PathBuf,
    /// Pose of the scan: `x y z qx qy qz qw`, a 4×4 matrix, or a file that holds either
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub pose: Option<String>,
    /// Unit of the scan; shapes, poses and answers are then in metres
    ///
    /// The scan is scaled to metres before --pose is applied. Without it, all are in the unit of the scan.
    #[arg(long, value_enum, value_name = "UNIT")]
    pub units: Option<UnitName>,
    /// Also test the surface between the points, and report contacts and bounds of the distance
    ///
    /// Shapes are tested against the obstacle: tangent discs where points sample a sheet, small balls
    /// about all other points. Contact normals point outwards if the scan is oriented (`preprocess
    /// --graph`, or `--scanner` for a room, whose normals point inwards then), otherwise to the side on
    /// which the shape's centre lies, or to the other one where the shape is almost all behind.
    #[arg(long)]
    pub surface: bool,
    /// Test against balls of this radius about the points instead of the surface, with the same report
    /// as --surface
    #[arg(long, value_name = "R", allow_hyphen_values = true, value_parser = parse_radius)]
    pub thickened: Option<f64>,
    /// Shapes within this distance of the surface touch it; needs --surface or --thickened
    #[arg(long, value_name = "D", allow_hyphen_values = true, value_parser = parse_radius)]
    pub margin: Option<f64>,
    /// Move each shape along the poses of this file and report the first impact; needs --surface or
    /// --thickened
    ///
    /// The file has one pose on each line, in the forms that `sweep --path` takes. The poses move the
    /// shapes from where they are given to the world. From line to line the shapes move by a screw: a
    /// steady rotation about an axis and a steady shift along it. The answer proves the motion free, or
    /// gives the time of the first impact and the time up to which the motion is proven free. Times
    /// count lines from the first one, which is at 0. With --margin, shapes must keep that distance.
    #[arg(long, alias = "poses", value_name = "FILE", conflicts_with = "penetration")]
    pub path: Option<PathBuf>,
    /// Also report how far and in which direction to move each shape out of the scan; needs --surface or
    /// --thickened
    ///
    /// The distance is reported as a lower and an upper bound.
    #[arg(long)]
    pub penetration: bool,
    /// The scan's closed surface encloses a solid, so shapes inside overlap it; for --penetration
    ///
    /// Without it, the way out may lead to either side of the surface.
    #[arg(long, requires = "penetration", conflicts_with_all = ["thickened", "path"])]
    pub solid: bool,
    /// Time limit for each shape, such as 2ms; for --penetration and --path
    ///
    /// The unit is ns, us, ms or s. When time runs out, the bounds of the penetration still hold, but are
    /// less tight; of a motion, the answer states what has been proven.
    #[arg(long, value_name = "2ms", allow_hyphen_values = true, value_parser = parse_duration)]
    pub budget: Option<Duration>,
    /// Work limit for each shape; reproducible, unlike time; for --penetration and --path
    ///
    /// A unit is one test of the moved shape against the scan, or one distance query.
    #[arg(long, value_name = "N", value_parser = parse_work)]
    pub work: Option<u64>,
    /// Threads to prepare a raw input; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Advanced", hide_short_help = true)]
    pub threads: Option<usize>,
    /// Check prepared scans in full before use: checksums and all values
    #[arg(long, help_heading = "Advanced", hide_short_help = true)]
    pub verify: bool,
    /// Print one JSON object for each shape
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}
