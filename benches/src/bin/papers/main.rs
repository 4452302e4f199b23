//! Tables and figures of papers, measured on today's machine: Markdown and SVGs in a folder.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a program for people")]

mod klein2004;
mod klein2005;

use clap::{Parser, Subcommand};
use nearmiss_benches::Failure;

/// Tables and figures of papers, measured on today's machine: Markdown and SVGs in a folder.
#[derive(Debug, Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Table 1 and Figs 8 to 12 of Klein & Zachmann 2004
    Klein2004(klein2004::Options),
    /// Figs 7 and 9 to 11 of Klein & Zachmann 2005
    Klein2005(klein2005::Options),
}

fn main() -> Result<(), Failure> {
    match Arguments::parse().command {
        Command::Klein2004(options) => klein2004::run(&options),
        Command::Klein2005(options) => klein2005::run(&options),
    }
}
