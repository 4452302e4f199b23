//! Measurements, with rivals in the same run, as Markdown.
#![expect(clippy::print_stdout, reason = "a program for people")]

mod batch;
mod budgets;
mod certificates;
mod clearance;
mod coverings;
mod curves;
mod deadlines;
mod distances;
mod eigen;
mod evaluation;
mod geodesics;
mod hints;
mod kinetic;
mod mesh_answers;
mod mesh_scans;
mod meshes;
mod moving;
mod reading;
mod scans;
mod shapes;
mod slices;
mod solids;
mod sweep;
mod town;

use clap::{Parser, Subcommand};
use nearmiss_benches::Failure;

/// Measurements, with rivals in the same run, as Markdown.
///
/// An object is a file, or `dragon-5k`, `dragon-23k` (shipped with the tests), or `bumpy:POINTS` (generated).
#[derive(Debug, Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Many poses of a pair on several threads, and the broad phase of a world of many scans
    Batch(batch::Options),
    /// Wrong best-effort answers by budget, in every order
    Budgets(budgets::Arguments),
    /// Certified separations of small shapes, against the exact distance
    Certificates(certificates::Arguments),
    /// The clearance of an object that moves through a scan
    Clearance(clearance::Arguments),
    /// Samples and sphere coverings: tightness, correctness, share of pruned pairs
    Coverings(coverings::Arguments),
    /// Curves of intersection of pairs of objects, by spacing
    Curves(curves::Arguments),
    /// Overruns of queries with a deadline
    Deadlines(deadlines::Arguments),
    /// Distances of two copies of an object, over the poses of the sweep
    Distances(distances::Options),
    /// Solvers of the symmetric 3×3 eigenproblem: time and errors
    Eigen(eigen::Arguments),
    /// The cost of one evaluation of f, at a leaf and anywhere, by instruction set
    Evaluation(evaluation::Arguments),
    /// Results of proximity graphs: normals, close pairs, levels, the geodesic kernel
    Geodesics(geodesics::Arguments),
    /// Time that hints save in small motions near contact
    Hints(hints::Arguments),
    /// Kinetic trees: events, work, and refitting beside them
    Kinetic(kinetic::Options),
    /// Meshes: preparing, exact and time-critical collision, distance
    Meshes(meshes::Options),
    /// An object's mesh against scans, beside its points
    MeshScans(mesh_scans::Options),
    /// Meshes and scans that deform: refitting, renewing, preparing anew
    Moving(moving::Options),
    /// The speed of reading point files
    Reading(reading::Options),
    /// Decided and certified shares on real scans
    Scans(scans::Options),
    /// Spheres, capsules and boxes against the points of a scan
    Shapes(shapes::Arguments),
    /// Slice maps: building, boxes, avatars, slices on disk
    Slices(slices::Asked),
    /// Convex shapes and rays against the surface of a scan
    Solids(solids::Arguments),
    /// Times of boolean queries over the distance, and near contact
    Sweep(sweep::Options),
    /// Writes a generated scan of a town, of any size
    Town(town::Options),
}

fn main() -> Result<(), Failure> {
    match Arguments::parse().command {
        Command::Batch(options) => batch::run(&options),
        Command::Budgets(arguments) => budgets::run(&arguments),
        Command::Certificates(arguments) => certificates::run(&arguments),
        Command::Clearance(arguments) => clearance::run(&arguments),
        Command::Coverings(arguments) => coverings::run(&arguments),
        Command::Curves(arguments) => curves::run(&arguments),
        Command::Deadlines(arguments) => deadlines::run(&arguments),
        Command::Distances(options) => distances::run(&options),
        Command::Eigen(arguments) => eigen::run(&arguments),
        Command::Evaluation(arguments) => evaluation::run(&arguments),
        Command::Geodesics(arguments) => geodesics::run(&arguments),
        Command::Hints(arguments) => hints::run(&arguments),
        Command::Kinetic(options) => kinetic::run(&options),
        Command::Meshes(options) => meshes::run(&options),
        Command::MeshScans(options) => mesh_scans::run(&options),
        Command::Moving(options) => moving::run(&options),
        Command::Reading(options) => reading::run(&options),
        Command::Scans(options) => scans::run(&options),
        Command::Shapes(arguments) => shapes::run(&arguments),
        Command::Slices(asked) => slices::run(&asked),
        Command::Solids(arguments) => solids::run(&arguments),
        Command::Sweep(options) => sweep::run(&options),
        Command::Town(options) => town::run(&options),
    }
}
