//! `cargo xtask tables`: the tables and plots of Klein & Zachmann 2004 and 2005 and of dos Anjos et al. 2012,
//! measured.

use crate::repository::{Outcome, root, run_cargo};

/// Folder of the objects that are not in the repository, from its root.
const OBJECTS: &str = "../shared/data";

/// Program and arguments for each paper.
const PAPERS: [[&str; 2]; 3] = [["papers", "klein2004"], ["papers", "klein2005"], ["memory", "anjos2012"]];

/// Papers that can be measured alone.
const YEARS: [(&str, [&str; 2]); 2] = [("--2005", PAPERS[1]), ("--2012", PAPERS[2])];

/// Measures with these additional arguments, and with the folder of objects if it exists and none
/// is named.
pub(crate) fn run(words: &[&str]) -> Outcome {
    let folder = root().join(OBJECTS);
    let found = folder.is_dir() && !words.contains(&"--data") && std::env::var_os("NEARMISS_DATA").is_none();
    let folder = folder.to_string_lossy();
    let data: &[&str] = if found { &["--data", &folder] } else { &[] };
    let here = std::env::current_dir()?;
    // Cargo runs programs in the root of the repository, wherever it is called.
    let mut absolute = Vec::new();
    let mut words = words.iter();
    while let Some(word) = words.next() {
        absolute.push((*word).to_owned());
        if let Some(path) = ["-o", "--data"].contains(word).then(|| words.next()).flatten() {
            absolute.push(here.join(path).to_string_lossy().into_owned());
        }
    }
    let asked = YEARS.iter().filter(|(year, _)| absolute.iter().any(|word| word == year));
    let asked: Vec<[&str; 2]> = asked.map(|(_, paper)| *paper).collect();
    absolute.retain(|word| YEARS.iter().all(|(year, _)| word != year));
    let words: Vec<&str> = absolute.iter().map(String::as_str).collect();
    let papers = if asked.is_empty() { PAPERS.to_vec() } else { asked };
    for (i, [program, paper]) in papers.into_iter().enumerate() {
        // Numbers of figures refer to one paper only.
        if i > 0 && words.contains(&"--only") {
            continue;
        }
        let command =
            ["run", "--release", "--quiet", "-p", "nearmiss-benches", "--bin", program, "--", paper];
        run_cargo(&[&command, words.as_slice(), data].concat())?;
    }
    Ok(())
}
