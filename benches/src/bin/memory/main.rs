//! Measurements of memory and time. They are a separate program because its allocator counts, which
//! would slow other measurements down.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a program for people")]

mod anjos2012;
mod graph;
mod preparation;

use clap::{Parser, Subcommand};
use nearmiss_benches::Failure;
use nearmiss_benches::counting::Counting;
use nearmiss_benches::figures::FigureOptions;

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

/// Measurements of memory and time.
#[derive(Debug, Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Tables 1 to 3 and Figs 5 and 6 of dos Anjos et al. 2012
    Anjos2012(FigureOptions),
    /// Proximity graphs: building time, shape, updates
    Graph(graph::Arguments),
    /// Preprocessing, saving and opening a large scan: time and memory
    Preparation(preparation::Arguments),
}

fn main() -> Result<(), Failure> {
    match Arguments::parse().command {
        Command::Anjos2012(options) => anjos2012::run(&options),
        Command::Graph(arguments) => graph::run(&arguments),
        Command::Preparation(arguments) => preparation::run(&arguments),
    }
}
