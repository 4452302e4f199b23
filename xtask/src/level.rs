//! `cargo xtask level`: a picture of levels of a hierarchy.

use std::path::{Path, PathBuf};

use nearmiss::{BuildOptions, Check, Scan};
use nearmiss_testdata::dragon::{Dragon, dragon_path};

use crate::repository::{Outcome, root};

/// Levels shown by default.
const DEPTHS: [u32; 3] = [1, 4, 7];

pub(crate) fn run(words: &[&str]) -> Outcome {
    let (mut scan, mut depths, mut output) = (None, Vec::new(), None);
    let mut words = words.iter();
    while let Some(&word) = words.next() {
        let mut value = || words.next().ok_or(format!("expected a value after {word}, got none"));
        match word {
            "--depth" => depths.push(value()?.parse().or(Err("expected a whole number after --depth"))?),
            "-o" => output = Some(PathBuf::from(value()?)),
            _ if word.starts_with('-') => return Err(format!("expected --depth or -o, got {word}").into()),
            _ => scan = Some(PathBuf::from(word)),
        }
    }
    if depths.is_empty() {
        depths = DEPTHS.to_vec();
    }
    let output = output.unwrap_or_else(|| root().join("target/level.png"));
    let scan = prepared(&scan.unwrap_or_else(|| dragon_path(Dragon::Points23k)))?;
    nearmiss_cli::save_picture(&nearmiss_cli::level_picture(&scan, &depths), &output)?;
    println!("{}", output.display());
    Ok(())
}

/// Opens a preprocessed scan, or preprocesses one.
fn prepared(path: &Path) -> Outcome<Scan> {
    if path.extension().is_some_and(|extension| extension == "nm") {
        return Ok(Scan::open(path, Check::Structure)?);
    }
    Ok(Scan::build(&nearmiss::io::read(path, None)?.cloud, &BuildOptions::default())?)
}
