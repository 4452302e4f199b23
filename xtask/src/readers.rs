//! Installs third-party readers in a Python environment of the repository's own. A test compares
//! their points with ours, and is skipped without them.

use std::process::Command;

use crate::repository::{Outcome, root, run as run_command};

/// Creates the environment `target/readers` and installs `readers/requirements.txt` there.
pub(crate) fn run() -> Outcome {
    let environment = root().join("target/readers");
    run_command(Command::new("python3").args(["-m", "venv"]).arg(&environment), "python3")?;
    let mut pip = Command::new(environment.join("bin/pip"));
    let requirements = root().join("xtask/readers/requirements.txt");
    run_command(pip.args(["install", "--quiet", "--requirement"]).arg(requirements), "pip")?;
    println!("installed in {}; `cargo test -p nearmiss-cli independent` uses them", environment.display());
    Ok(())
}
