//! `cargo xtask fuzz [TARGET] [SECONDS]`: builds the fuzz targets with coverage, makes seeds, runs them.
//!
//! What cargo-fuzz does, without a nightly toolchain: the instrumentation is LLVM's, and the flags that ask
//! for it are passed through.

use std::fs;
use std::process::Command;

use nearmiss::{BuildOptions, PointCloud, Scan};
use nearmiss_testdata::arbitrary::{self, CloudKind};

use crate::repository::{Outcome, cargo, root, run as run_command};

const TARGETS: [&str; 5] = ["container", "ply", "pcd", "obj", "xyz"];

/// Edges are counted in place, and comparisons tell the fuzzer what they wanted.
const FLAGS: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares -Cdebug-assertions -Ccodegen-units=1";

/// Long enough for every sort of section and row, short enough for thousands a second.
const LONGEST_INPUT: u32 = 16_384;

/// Runs the target that `words` name, or all, for as many seconds as they say, or sixty.
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
        fuzzer.args(["-rss_limit_mb=512", "-timeout=5", "-print_final_stats=1", "-verbosity=0"]);
        fuzzer.arg(format!("-max_total_time={seconds}")).arg(format!("-max_len={LONGEST_INPUT}"));
        run_command(&mut fuzzer, name)?;
    }
    Ok(())
}

fn usage() -> String {
    format!("usage: cargo xtask fuzz [{}] [SECONDS]", TARGETS.join("|"))
}

/// The platform that the compiler runs on: named, so that build scripts are not instrumented.
fn host() -> Outcome<String> {
    let output = Command::new("rustc").arg("-vV").current_dir(root()).output()?;
    let text = String::from_utf8(output.stdout)?;
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.ok_or("rustc names no host")?.to_owned())
}

/// Small sound inputs of every sort.
fn seeds(target: &str) -> Outcome<Vec<Vec<u8>>> {
    match target {
        "container" => containers(),
        "ply" => plies(),
        "pcd" => Ok(pcds()),
        "obj" => Ok(texts(&[
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0 1 0.5 0\nvn 0 0 1\nvt 0 0\nf 1//1 2//1 3//1\nf -1 -2 -3 1\n",
        ])),
        _ => Ok(texts(&[
            "x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,1\n",
            "# 0\n0 0 0\n1 0 0 255 0 1\n",
            "0;0;1\r\n\"1\";2e5;-.5\n",
        ])),
    }
}

fn texts(texts: &[&str]) -> Vec<Vec<u8>> {
    texts.iter().map(|text| text.as_bytes().to_vec()).collect()
}

/// Prepared scans, behind a byte that says how they are checked.
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

fn plies() -> Outcome<Vec<Vec<u8>>> {
    let head = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment a\nelement vertex 3\nproperty float x\nproperty double y\nproperty short z\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
             property list uchar int vertex_indices\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        )
    };
    let ascii = head("ascii") + "0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2\n4 0 1 2 -1\n";
    let mut binary = head("binary_little_endian").into_bytes();
    binary.extend([0_u8; 3 * 17]);
    binary.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    let other_end = String::from_utf8_lossy(&binary).replacen("little", "big", 1).into_bytes();
    let dragon =
        fs::read(nearmiss_testdata::dragon::dragon_path(nearmiss_testdata::dragon::Dragon::Points5k))?;
    Ok(vec![ascii.into_bytes(), binary, other_end, dragon[..dragon.len().min(4000)].to_vec()])
}

fn pcds() -> Vec<Vec<u8>> {
    let head = |encoding: &str| {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb _\nSIZE 4 4 4 4 1\nTYPE F F F U U\nCOUNT 1 1 1 1 3\nWIDTH 8\n\
             HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 8\nDATA {encoding}\n"
        )
    };
    let rows: String = (0..8).map(|i| format!("{i} {} nan {i} 0 0 0\n", i * i)).collect();
    let values: Vec<u8> = (0..8 * 19_u8).collect();
    let binary = [head("binary").into_bytes(), values.clone()].concat();
    let mut packed = head("binary_compressed").into_bytes();
    // Runs of literal bytes: packed data need not be shorter.
    let data: Vec<u8> =
        values.chunks(32).flat_map(|run| [&[run.len().to_le_bytes()[0] - 1], run].concat()).collect();
    for length in [data.len(), values.len()] {
        packed.extend(u32::try_from(length).unwrap_or(0).to_le_bytes());
    }
    packed.extend(data);
    vec![(head("ascii") + &rows).into_bytes(), binary, packed]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_has_a_source_and_sound_seeds() {
        for target in TARGETS {
            let source = root().join("fuzz/targets").join(target).with_extension("rs");
            assert!(source.is_file(), "{target}");
            let seeds = seeds(target).unwrap();
            assert!(
                !seeds.is_empty() && seeds.iter().all(|seed| seed.len() < LONGEST_INPUT as usize),
                "{target}"
            );
        }
        for seed in containers().unwrap() {
            assert!(Scan::from_bytes(seed[1..].to_vec(), nearmiss::Check::Full).is_ok());
        }
    }
}
