//! `cargo xtask fuzz [TARGET] [SECONDS]`: builds the fuzz targets with coverage, makes seeds, runs
//! them.
//!
//! This does what cargo-fuzz does, without a nightly toolchain: LLVM instruments the code, and the
//! flags for it are passed through.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use nearmiss::slices::{Pixel, SliceBuilder, SliceOptions, SlicePlan, SliceTarget};
use nearmiss::{Aabb, BuildOptions, Mesh, MeshBuildOptions, PointCloud, Scan, TriangleMesh};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::files;

use crate::repository::{Outcome, cargo, root, run as run_command};

const TARGETS: [&str; 14] = [
    "container",
    "mesh",
    "slices",
    "lines",
    "ply",
    "pcd",
    "obj",
    "xyz",
    "las",
    "e57",
    "npy",
    "stl",
    "off",
    "gltf",
];

/// Flags that count edges inline, and pass the operands of comparisons to the fuzzer.
const FLAGS: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares -Cdebug-assertions -Ccodegen-units=1";

/// Long enough for every kind of section and row, short enough for thousands of inputs a second.
const LONGEST_INPUT: u32 = 16_384;

/// Runs the named target, or all, for the given number of seconds, or sixty.
pub(crate) fn run(words: &[&str]) -> Outcome {
    let (names, rest): (&[&str], _) = match words {
        [name, rest @ ..] if TARGETS.contains(name) => (&words[..1], rest),
        _ => (&TARGETS, words),
    };
    let seconds = match rest {
        [] => 60,
        [seconds] => seconds.parse::<u32>().map_err(|_not_a_number| usage())?,
        _ => return Err(usage().into()),
    };
    let folder = root().join("fuzz");
    let platform = host()?;
    let mut build = cargo();
    build.args(["build", "--release", "--target", &platform, "--manifest-path"]);
    build.arg(folder.join("Cargo.toml")).env("RUSTFLAGS", FLAGS).env("RUSTC_BOOTSTRAP", "1");
    // Beside the manifest, wherever the workspace's own build goes.
    build.env("CARGO_TARGET_DIR", folder.join("target"));
    run_command(&mut build, "cargo build of the fuzz targets")?;
    for name in names {
        let (corpus, artifacts) = (folder.join("corpus").join(name), folder.join("artifacts").join(name));
        fs::create_dir_all(&artifacts)?;
        fs::create_dir_all(&corpus)?;
        for (number, seed) in seeds(name)?.into_iter().enumerate() {
            fs::write(corpus.join(format!("seed-{number}")), seed)?;
        }
        println!("— {name}, {seconds} s");
        let mut fuzzer = Command::new(folder.join("target").join(&platform).join("release").join(name));
        fuzzer.arg(&corpus).arg(format!("-artifact_prefix={}/", artifacts.display()));
        fuzzer.args(["-rss_limit_mb=512", "-timeout=1", "-print_final_stats=1", "-verbosity=0"]);
        fuzzer.arg(format!("-max_total_time={seconds}")).arg(format!("-max_len={LONGEST_INPUT}"));
        run_command(&mut fuzzer, name)?;
    }
    Ok(())
}

fn usage() -> String {
    format!("usage: cargo xtask fuzz [{}] [SECONDS]", TARGETS.join("|"))
}

/// Returns the platform that the compiler runs on. It is named so that build scripts are not
/// instrumented.
fn host() -> Outcome<String> {
    let output = Command::new("rustc").arg("-vV").current_dir(root()).output()?;
    let text = String::from_utf8(output.stdout)?;
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.ok_or("expected a line `host:` from `rustc -vV`, got none")?.to_owned())
}

/// Returns small valid inputs of every kind.
fn seeds(target: &str) -> Outcome<Vec<Vec<u8>>> {
    let endings: &[&str] = match target {
        "container" => return containers(),
        "mesh" => return meshes(),
        "slices" => return slices(),
        "lines" => return Ok(LINES.iter().map(|line| line.as_bytes().to_vec()).collect()),
        "xyz" => &["xyz", "csv"],
        "las" => &["las", "laz"],
        "gltf" => &["gltf", "glb"],
        _ => &[target],
    };
    let has_ending = |name: &str| endings.iter().any(|ending| name.ends_with(ending));
    Ok(files::all().into_iter().filter(|(name, _)| has_ending(name)).map(|(_, bytes)| bytes).collect())
}

/// Poses, shapes, boxes and a route, each after a byte that selects the kind.
const LINES: [&str; 4] = [
    "\u{0}{\"a\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],\"b\":[1,0,0,0.5,0,1,0,0,0,0,1,0.2,0,0,0,1]}\n",
    "\u{1}{\"sphere\":{\"centre\":[0,0,1],\"radius\":0.5}}\n",
    "\u{2}{\"min\":[0,0,0],\"max\":[1,1,1]}\n",
    "\u{3}{\"start\":[0.2,0.2,0],\"points\":[[1,1],[1.5,0.5]]}\n",
];

/// Returns the files of a small map, each after a byte that selects the kind.
fn slices() -> Outcome<Vec<Vec<u8>>> {
    let points: Vec<[f64; 3]> = arbitrary::cloud(CloudKind::Sphere, 300, 3);
    let bounds = Aabb::of(points.iter().copied());
    let options = SliceOptions::default().with_pixel(Pixel::Count(20));
    let plan = SlicePlan::new(&options, &bounds)?;
    let mut builder = SliceBuilder::new(&plan)?;
    builder.add(&points);
    let folder = tempfile::tempdir()?;
    SliceTarget::new(folder.path())?.save(&builder.finish())?;
    let mut files: Vec<_> = fs::read_dir(folder.path())?.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.is_file());
    files.sort();
    let seed = |(i, path): (u8, &PathBuf)| Ok([&[i][..], &fs::read(path)?].concat());
    (0..).zip(&files).map(seed).collect()
}

/// Returns preprocessed scans, each after a byte that selects the check.
fn containers() -> Outcome<Vec<Vec<u8>>> {
    let mut seeds = Vec::new();
    for (kind, points, leaf_size) in [
        (CloudKind::Sphere, 60, 16),
        (CloudKind::Random, 24, 4),
        (CloudKind::Rings, 70, 64),
        (CloudKind::Huge, 9, 16),
    ] {
        let cloud = PointCloud::cleaned(&arbitrary::cloud(kind, points, 3))?;
        let scan = Scan::build(&cloud, &BuildOptions::default().with_leaf_size(leaf_size))?;
        for how in 0..4 {
            let mut seed = vec![how];
            scan.write_to(&mut seed)?;
            seeds.push(seed);
        }
    }
    Ok(seeds)
}

/// Returns prepared meshes, each after a byte that selects the check.
fn meshes() -> Outcome<Vec<Vec<u8>>> {
    let mut seeds = Vec::new();
    for (triangles, scale) in [(1, 1.0), (5, 1e-6), (40, 1.0)] {
        let corners = arbitrary::cloud(CloudKind::Random, 3 * triangles, 3);
        let corners = corners.into_iter().map(|p| p.map(|x| x * scale)).collect();
        let triangles = (0..triangles).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = Mesh::build(&TriangleMesh::new(corners, triangles)?, &MeshBuildOptions::default())?;
        for how in 0..4 {
            let mut seed = vec![how];
            mesh.write_to(&mut seed)?;
            seeds.push(seed);
        }
    }
    Ok(seeds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_has_a_source_and_sound_seeds() {
        for target in TARGETS {
            let source = root().join("fuzz/targets").join(target).with_extension("rs");
            let text = fs::read_to_string(&source).unwrap();
            for part in text.lines().filter_map(|line| line.strip_prefix("#[path = \"")) {
                let part = root().join("fuzz/targets").join(part.trim_end_matches("\"]"));
                assert!(part.exists(), "{target} uses {}", part.display());
            }
            let seeds = seeds(target).unwrap();
            assert!(
                !seeds.is_empty() && seeds.iter().all(|seed| seed.len() < LONGEST_INPUT as usize),
                "{target}"
            );
        }
        for seed in containers().unwrap() {
            assert!(Scan::from_bytes(seed[1..].to_vec(), nearmiss::Check::Full).is_ok());
        }
        for seed in meshes().unwrap() {
            assert!(Mesh::from_bytes(seed[1..].to_vec(), nearmiss::Check::Full).is_ok());
        }
    }
}
