//! `cargo xtask tables`: the table and plots of Klein & Zachmann 2004 and 2005, measured.

use crate::repository::{Outcome, root, run_cargo};

/// Where the objects lie that are no part of the repository, from its root.
const OBJECTS: &str = "../shared/data";

/// Measures, with these words after the program's name; with the folder of objects, if it is there and none is named.
pub(crate) fn run(words: &[&str]) -> Outcome {
    let folder = root().join(OBJECTS);
    let found = folder.is_dir() && !words.contains(&"--data") && std::env::var_os("NEARMISS_DATA").is_none();
    let folder = folder.to_string_lossy();
    let data: &[&str] = if found { &["--data", &folder] } else { &[] };
    let here = std::env::current_dir()?;
    // Cargo runs programs in the repository's root, whoever calls.
    let mut absolute = Vec::new();
    let mut words = words.iter();
    while let Some(word) = words.next() {
        absolute.push((*word).to_owned());
        if let Some(path) = ["-o", "--data"].contains(word).then(|| words.next()).flatten() {
            absolute.push(here.join(path).to_string_lossy().into_owned());
        }
    }
    let only_2005 = absolute.iter().position(|word| word == "--2005");
    let papers: &[&str] = if only_2005.is_some() { &["klein2005"] } else { &["klein2004", "klein2005"] };
    if let Some(place) = only_2005 {
        absolute.remove(place);
    }
    let words: Vec<&str> = absolute.iter().map(String::as_str).collect();
    for &paper in papers {
        // Numbers of figures are those of one paper.
        if paper == "klein2005" && only_2005.is_none() && words.contains(&"--only") {
            continue;
        }
        let program = ["run", "--release", "--quiet", "-p", "nearmiss-benches", "--bin", paper, "--"];
        run_cargo(&[&program, words.as_slice(), data].concat())?;
    }
    Ok(())
}
