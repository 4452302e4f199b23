//! `cargo xtask geodesic`: a picture of the graph of a scan.

use std::path::{Path, PathBuf};

use nearmiss::{BuildOptions, Check, GraphOptions, Scan};
use nearmiss_testdata::dragon::{Dragon, dragon_path};

use crate::repository::{Outcome, root};

pub(crate) fn run(words: &[&str]) -> Outcome {
    let (mut scan, mut from, mut output) = (None, 0, None);
    let mut words = words.iter();
    while let Some(&word) = words.next() {
        let mut value = || words.next().ok_or(format!("expected a value after {word}, got none"));
        match word {
            "--from" => from = value()?.parse().or(Err("expected the index of a point after --from"))?,
            "-o" => output = Some(PathBuf::from(value()?)),
            _ if word.starts_with('-') => return Err(format!("expected --from or -o, got {word}").into()),
            _ => scan = Some(PathBuf::from(word)),
        }
    }
    let output = output.unwrap_or_else(|| root().join("target/geodesic.png"));
    let path = scan.unwrap_or_else(|| dragon_path(Dragon::Points23k));
    let scan = prepared(&path)?;
    let points = scan.len();
    let picture = nearmiss_cli::geodesic_picture(&scan, from);
    let none = || {
        format!(
            "{}: expected a scan with a graph and a point below {points}, got point {from} or no graph",
            path.display()
        )
    };
    nearmiss_cli::save_picture(&picture.ok_or_else(none)?, &output)?;
    println!("{}", output.display());
    Ok(())
}

/// Opens a preprocessed scan, or preprocesses one with a graph.
fn prepared(path: &Path) -> Outcome<Scan> {
    if path.extension().is_some_and(|extension| extension == "nm") {
        return Ok(Scan::open(path, Check::Structure)?);
    }
    let cloud = nearmiss::io::read(path, None)?.cloud;
    Ok(Scan::build(&cloud, &BuildOptions::default())?.with_graph(&cloud, &GraphOptions::default(), None)?)
}
