//! `cargo xtask test tidy`: checks that compilers do not make.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::circles::circles;
use crate::repository::{Outcome, ask_cargo, members, root};
use crate::words::{PublicTypes, banned_openings};

/// The maximum number of lines of a file: a longer one holds more than one noun or one step.
const MOST_LINES: usize = 500;

/// The last column that a comment may reach.
const COMMENT_WIDTH: usize = 110;

/// Names that do not describe the content.
const VAGUE: [&str; 4] = ["utils.rs", "helpers.rs", "types.rs", "common.rs"];

/// The members of the workspace that each crate may use; the table of ARCHITECTURE.md.
const LAYERS: [(&str, &[&str]); 24] = [
    ("nearmiss-geometry", &[]),
    ("nearmiss-lanes", &[]),
    ("nearmiss-index", &["nearmiss-geometry", "nearmiss-lanes", "nearmiss-store"]),
    ("nearmiss-store", &[]),
    ("nearmiss-draw", &["nearmiss-geometry"]),
    ("nearmiss-io", &["nearmiss-geometry"]),
    ("nearmiss-filter", &["nearmiss-geometry", "nearmiss-lanes", "nearmiss-index"]),
    ("nearmiss-surface", &["nearmiss-geometry", "nearmiss-lanes", "nearmiss-index"]),
    (
        "nearmiss-graph",
        &[
            "nearmiss-geometry",
            "nearmiss-lanes",
            "nearmiss-index",
            "nearmiss-mesh",
            "nearmiss-surface",
            "nearmiss-store",
        ],
    ),
    (
        "nearmiss-hierarchy",
        &[
            "nearmiss-geometry",
            "nearmiss-lanes",
            "nearmiss-index",
            "nearmiss-mesh",
            "nearmiss-surface",
            "nearmiss-store",
        ],
    ),
    (
        "nearmiss-query",
        &[
            "nearmiss-geometry",
            "nearmiss-lanes",
            "nearmiss-index",
            "nearmiss-surface",
            "nearmiss-graph",
            "nearmiss-hierarchy",
            "nearmiss-mesh",
        ],
    ),
    ("nearmiss-kinetic", &["nearmiss-geometry", "nearmiss-lanes", "nearmiss-store"]),
    ("nearmiss-mesh", &["nearmiss-geometry"]),
    ("nearmiss-slices", &["nearmiss-geometry", "nearmiss-lanes", "nearmiss-store", "nearmiss-mesh"]),
    (
        "nearmiss",
        &[
            "nearmiss-geometry",
            "nearmiss-lanes",
            "nearmiss-index",
            "nearmiss-store",
            "nearmiss-io",
            "nearmiss-filter",
            "nearmiss-surface",
            "nearmiss-graph",
            "nearmiss-hierarchy",
            "nearmiss-query",
            "nearmiss-kinetic",
            "nearmiss-mesh",
            "nearmiss-slices",
        ],
    ),
    ("nearmiss-cli", &["nearmiss", "nearmiss-draw"]),
    ("nearmiss-parry", &["nearmiss"]),
    ("nearmiss-bevy", &["nearmiss"]),
    ("nearmiss-c", &["nearmiss"]),
    ("nearmiss-python", &["nearmiss"]),
    ("nearmiss-testdata", &["nearmiss-geometry"]),
    ("nearmiss-benches", &["nearmiss", "nearmiss-testdata"]),
    ("check-proof", &["nearmiss", "nearmiss-cli", "nearmiss-testdata"]),
    ("xtask", &["nearmiss", "nearmiss-cli", "nearmiss-draw", "nearmiss-testdata"]),
];

/// Prints every fault; fails if there is one.
pub(crate) fn run() -> Outcome {
    let faults = find_faults()?;
    for fault in &faults {
        println!("{fault}");
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(format!("expected tidy sources, got {} faults", faults.len()).into())
    }
}

fn find_faults() -> Outcome<Vec<String>> {
    let mut faults = Vec::new();
    let sources = tracked(".rs");
    let references = fs::read_to_string(root().join("docs/theory/references.md"))?;
    let references: Vec<&str> = references.split_whitespace().collect();
    let references = references.join(" ");
    let mut types = PublicTypes::default();
    for path in &sources {
        let Ok(text) = fs::read_to_string(path) else { continue };
        faults.extend(source_faults(path, &text, &references));
        let shown = path.strip_prefix(root()).unwrap_or(path);
        if shown.starts_with("crates") && shown.components().any(|part| part.as_os_str() == "src") {
            types.add(&shown.display().to_string(), &text);
        }
    }
    faults.extend(types.doubled());
    for member in members()? {
        let Some((_, allowed)) = LAYERS.iter().find(|(name, _)| *name == member.name) else {
            faults.push(format!(
                "{}: expected an entry in the table of layers, got none; add it to `LAYERS`",
                member.name
            ));
            continue;
        };
        for used in member.dependencies.iter().filter(|used| used.starts_with("nearmiss")) {
            if !allowed.contains(&used.as_str()) {
                faults
                    .push(format!("{}: expected dependencies on lower layers only, got {used}", member.name));
            }
        }
        let circles = circles(&member.folder.join("src"))?;
        faults.extend(circles.into_iter().map(|circle| format!("{}: {circle}", member.name)));
        if member.published {
            faults.extend(readme_faults(&member.folder));
        }
    }
    Ok(faults)
}

/// Returns the files with this ending that git tracks or would track.
fn tracked(ending: &str) -> Vec<PathBuf> {
    let listing = Command::new("git")
        .current_dir(root())
        .args(["ls-files", "--cached", "--others", "--exclude-standard"])
        .output();
    let text = listing.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    text.lines().filter(|line| line.ends_with(ending)).map(|line| root().join(line)).collect()
}

fn source_faults(path: &Path, text: &str, references: &str) -> Vec<String> {
    let shown = path.strip_prefix(root()).unwrap_or(path).display();
    let mut faults = Vec::new();
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or(text);
    let lines = code.lines().count();
    if lines > MOST_LINES {
        faults.push(format!("{shown}: expected at most {MOST_LINES} lines, got {lines}; split the file"));
    }
    if path.file_name().is_some_and(|name| VAGUE.iter().any(|vague| name == *vague)) {
        faults.push(format!("{shown}: expected a name that says what the file contains; rename it"));
    }
    for (number, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("//") && line.chars().count() > COMMENT_WIDTH {
            faults.push(format!(
                "{shown}:{}: expected comments of at most {COMMENT_WIDTH} columns, got a longer one; wrap it",
                number + 1
            ));
        }
    }
    for (line, word) in banned_openings(text) {
        faults.push(format!(
            "{shown}:{line}: expected documentation that starts with a noun phrase or a verb, got `{word}`"
        ));
    }
    // Written in two parts, so that this line is not a fault itself.
    if code.contains(concat!(".partial", "_cmp(")) {
        faults.push(format!("{shown}: expected a total order of floats, got a partial one, which fails on NaN; use `total_cmp`"));
    }
    for title in cited_titles(code) {
        if !references.contains(&title) {
            faults.push(format!(
                "{shown}: expected cited titles to be in docs/theory/references.md, got \"{title}\"; add it"
            ));
        }
    }
    faults
}

/// Returns the titles in quotation marks in comments that a year follows within a few words.
fn cited_titles(code: &str) -> Vec<String> {
    let comments: Vec<&str> = code
        .lines()
        .filter_map(|line| line.trim_start().strip_prefix("//"))
        .map(|line| line.trim_start_matches(['/', '!']).trim())
        .collect();
    let text = comments.join(" ");
    let parts: Vec<&str> = text.split('"').collect();
    let quoted = parts.iter().skip(1).step_by(2).zip(parts.iter().skip(2).step_by(2));
    quoted
        .filter(|(title, after)| title.split(' ').count() >= 3 && names_a_year(after))
        .map(|(title, _)| title.trim_end_matches(',').to_owned())
        .collect()
}

/// Returns `true` if a year occurs within the next few words.
fn names_a_year(after: &str) -> bool {
    let words = after.split(|c: char| !c.is_ascii_alphanumeric()).take(16);
    words.filter_map(|word| word.parse::<u32>().ok()).any(|year| (1900..2100).contains(&year))
}

fn readme_faults(folder: &Path) -> Vec<String> {
    let name = folder.display();
    let readme = fs::read_to_string(folder.join("README.md")).unwrap_or_default();
    let library = fs::read_to_string(folder.join("src/lib.rs")).unwrap_or_default();
    let mut faults = Vec::new();
    if readme.lines().count() < 5 {
        faults
            .push(format!("{name}: expected a README of at least 5 lines; say there what the crate is for"));
    }
    if !library.contains("#![doc = include_str!(\"../README.md\")]") {
        faults.push(format!(
            "{name}: expected the README as crate documentation; include it in src/lib.rs with `include_str!`"
        ));
    }
    faults
}

/// Checks that packages hold sources and README only, no test data.
pub(crate) fn packages() -> Outcome {
    let mut faults = Vec::new();
    for member in members()?.iter().filter(|member| member.published) {
        let listing = ask_cargo(&["package", "--list", "--allow-dirty", "-p", &member.name])?;
        for file in listing.lines() {
            let expected = file.starts_with("src/")
                || ["Cargo.toml", "Cargo.toml.orig", "Cargo.lock", "README.md", ".cargo_vcs_info.json"]
                    .contains(&file);
            if !expected {
                faults.push(format!(
                    "{}: expected a package of sources and README only, got {file}",
                    member.name
                ));
            }
        }
    }
    for fault in &faults {
        println!("{fault}");
    }
    if faults.is_empty() { Ok(()) } else { Err("expected packages of sources only, got other files".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn citations_are_found_across_lines() {
        let code = "//! See Alexa & Adamson, \"On normals and\n//! projection\", SPBG 2004).\n// a \"mere quoted phrase here\" stays\n";
        assert_eq!(cited_titles(code), ["On normals and projection"]);
    }

    #[test]
    fn faults_are_named() {
        let long = "x\n".repeat(501);
        assert_eq!(source_faults(&root().join("a/utils.rs"), &long, "").len(), 2);
        let order = concat!("a.partial", "_cmp(&b)");
        assert_eq!(source_faults(&root().join("a/b.rs"), order, "").len(), 1);
        let wide = format!("    // {}", "x".repeat(104));
        assert_eq!(source_faults(&root().join("a/b.rs"), &wide, "").len(), 1);
        let fits = format!("    // {}\nfn main() {{}}", "x".repeat(103));
        assert!(source_faults(&root().join("a/b.rs"), &fits, "").is_empty());
    }
}
