//! The `nearmiss` command; see the library beside it.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    nearmiss_cli::run(std::env::args_os())
}
