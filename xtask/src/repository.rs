//! Paths and members of the repository, and how to run cargo on it.

use std::error::Error;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The result of a chore.
pub(crate) type Outcome<T = ()> = Result<T, Box<dyn Error>>;

/// Returns the root of the repository.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}

/// Returns a command of the cargo that runs this program.
pub(crate) fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo")));
    command.current_dir(root());
    command
}

/// Runs cargo with these arguments and shows its output.
pub(crate) fn run_cargo(args: &[&str]) -> Outcome {
    run(cargo().args(args), &format!("cargo {}", args.join(" ")))
}

/// Runs a command and shows its output.
pub(crate) fn run(command: &mut Command, name: &str) -> Outcome {
    let status = command.status()?;
    if status.success() { Ok(()) } else { Err(format!("`{name}` failed: {status}").into()) }
}

/// Returns the output of cargo with these arguments.
pub(crate) fn ask_cargo(args: &[&str]) -> Outcome<String> {
    let output = cargo().args(args).stderr(std::process::Stdio::inherit()).output()?;
    if !output.status.success() {
        return Err(format!("`cargo {}` failed: {}", args.join(" "), output.status).into());
    }
    Ok(String::from_utf8(output.stdout)?)
}

/// A member of the workspace.
#[derive(Debug, Clone)]
pub(crate) struct Member {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
    pub(crate) published: bool,
    /// Members and other crates that this one depends on, without development dependencies.
    pub(crate) dependencies: Vec<String>,
}

/// Returns the members of the workspace by name.
pub(crate) fn members() -> Outcome<Vec<Member>> {
    let text = ask_cargo(&["metadata", "--no-deps", "--format-version", "1"])?;
    let metadata: serde_json::Value = serde_json::from_str(&text)?;
    let packages =
        metadata["packages"].as_array().ok_or("expected packages from `cargo metadata`, got none")?;
    let mut members: Vec<Member> = packages.iter().filter_map(member).collect();
    members.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(members)
}

fn member(package: &serde_json::Value) -> Option<Member> {
    let dependencies = package["dependencies"].as_array()?;
    let normal = dependencies.iter().filter(|d| d["kind"].is_null());
    Some(Member {
        name: package["name"].as_str()?.to_owned(),
        folder: Path::new(package["manifest_path"].as_str()?).parent()?.to_owned(),
        published: package["publish"].is_null(),
        dependencies: normal.filter_map(|d| d["name"].as_str().map(str::to_owned)).collect(),
    })
}
