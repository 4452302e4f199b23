//! The commands of the front page and of the guides run as they stand there.
//!
//! Each page gets a folder of its own with `testdata/data`. Its blocks marked `sh` run in order,
//! each by `sh -e` with the built `nearmiss` first in `PATH`. Blocks with other marks are not run.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A shell block of a page.
#[derive(Debug, PartialEq, Eq)]
struct Block {
    /// The line of its first command, counted from 1.
    line: usize,
    script: String,
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The front page, and all pages of `docs/guide` in the order of their names.
fn pages() -> Vec<PathBuf> {
    let mut guides: Vec<PathBuf> = fs::read_dir(repository().join("docs/guide"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .collect();
    guides.sort();
    guides.insert(0, repository().join("README.md"));
    guides
}

/// Returns the blocks of a page that are marked `sh`.
fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lines = (1..).zip(page.lines());
    while let Some((number, line)) = lines.next() {
        let Some(mark) = line.strip_prefix("```") else { continue };
        let inside = lines.by_ref().map(|(_, line)| line).take_while(|line| *line != "```");
        let script: String = inside.map(|line| format!("{line}\n")).collect();
        if mark == "sh" {
            blocks.push(Block { line: number + 1, script });
        }
    }
    blocks
}

/// Runs the blocks of a page up to the first that fails. Returns what is wrong.
fn run(page: &Path) -> Result<(), String> {
    let name = page.strip_prefix(repository()).unwrap().display();
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("testdata")).unwrap();
    symlink(repository().join("testdata/data"), folder.path().join("testdata/data")).unwrap();
    let programs = tempfile::tempdir().unwrap();
    symlink(env!("CARGO_BIN_EXE_nearmiss"), programs.path().join("nearmiss")).unwrap();
    let others = std::env::var_os("PATH").unwrap_or_default();
    let path =
        std::env::join_paths(std::iter::once(programs.path().into()).chain(std::env::split_paths(&others)));
    let path = path.unwrap();
    for Block { line, script } in blocks(&fs::read_to_string(page).unwrap()) {
        if !script.lines().any(|line| line.starts_with("nearmiss ")) {
            return Err(format!("{name}:{line}: expected a line that starts with `nearmiss `, got none"));
        }
        // -x writes each command before it runs, so the last one written is the one that failed.
        let output = Command::new("sh")
            .args(["-e", "-x", "-c", &script])
            .current_dir(folder.path())
            .env("PATH", &path)
            .output()
            .unwrap();
        if !output.status.success() {
            let told = String::from_utf8_lossy(&output.stderr);
            return Err(format!("{name}:{line}: this block ends with {}:\n{told}", output.status));
        }
    }
    Ok(())
}

#[test]
fn every_command_of_the_pages_runs() {
    let pages = pages();
    let faults: Vec<String> = std::thread::scope(|scope| {
        let running: Vec<_> = pages.iter().map(|page| scope.spawn(|| run(page))).collect();
        running.into_iter().filter_map(|page| page.join().unwrap().err()).collect()
    });
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let commands = |page: &PathBuf| {
        let blocks = blocks(&fs::read_to_string(page).unwrap());
        blocks.iter().flat_map(|b| b.script.lines()).filter(|line| line.starts_with("nearmiss ")).count()
    };
    let found: usize = pages.iter().map(commands).sum();
    assert!(found >= 40, "expected at least 40 commands on {} pages, got {found}", pages.len());
}

#[test]
fn only_blocks_marked_sh_run() {
    let page =
        "# Title\n```text\nnearmiss no\n```\n\n```sh\nnearmiss yes <<'END'\nx\nEND\n```\n```\nsh\n```\n";
    let expected = Block { line: 7, script: "nearmiss yes <<'END'\nx\nEND\n".into() };
    assert_eq!(blocks(page), [expected]);
    assert_eq!(blocks("no block"), []);
}
