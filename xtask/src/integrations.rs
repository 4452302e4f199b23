//! The integrations: their tests, the wheel for Python, and a folder to link with for C.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::repository::{Outcome, root, run as run_command, run_cargo};

/// Poses on which the C library is compared with the command line.
const POSES: &str = "500";

/// The greatest difference of lengths of a scan of size 0.2 by the rounding of poses.
const ROUNDING: f64 = 1e-9;

/// Options of every C and C++ compiler.
const STRICT: [&str; 5] = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-g"];

/// The tests in Rust that take a second together; those of whole worlds are in `tests` alone.
const QUICK: [&str; 4] = ["app", "bodies", "casts", "character"];

/// Builds and tests all integrations, with the artefacts of `cargo test --workspace`. Says what it
/// skips.
pub(crate) fn run() -> Outcome {
    // The features, and so the artefacts, are those of the check `tests`.
    run_cargo(&["build", "--workspace", "--lib", "--tests", "--quiet"])?;
    let quick = QUICK.iter().flat_map(|name| ["--test", name]);
    run_cargo(&["test", "--workspace", "--quiet"].into_iter().chain(quick).collect::<Vec<_>>())?;
    let built = built("debug")?;
    let work = root().join("target").join("integrations");
    fs::create_dir_all(&work)?;
    match compilers() {
        compilers if compilers.is_empty() => println!("skipped C and C++: found neither `cc` nor `c++`"),
        compilers => c_tests(&compilers, &built, &work)?,
    }
    if exists("python3") { python_tests(&built, &work) } else { skip("Python: found no `python3`") }
}

#[expect(clippy::unnecessary_wraps, reason = "the end of a check")]
fn skip(what: &str) -> Outcome {
    println!("skipped {what}");
    Ok(())
}

/// Returns the folder with the libraries and programs of a profile.
fn built(profile: &str) -> Outcome<PathBuf> {
    let program = std::env::current_exe()?;
    let target = program.ancestors().nth(2).ok_or("expected this program in a target folder")?;
    Ok(target.join(profile))
}

/// Returns the name of a shared library.
fn shared(name: &str) -> String {
    format!("{}{name}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX)
}

/// Returns `true` if a program can be run.
fn exists(program: &str) -> bool {
    let mut command = Command::new(program);
    command.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Returns the compilers that exist, each with its standard.
fn compilers() -> Vec<(&'static str, &'static str)> {
    let known = [("cc", "-std=c11"), ("c++", "-std=c++17")];
    known.into_iter().filter(|(program, _)| cfg!(unix) && exists(program)).collect()
}

fn c_tests(compilers: &[(&str, &str)], built: &Path, work: &Path) -> Outcome {
    let folder = root().join("integrations/c");
    let valgrind = exists("valgrind");
    if !valgrind {
        println!("skipped valgrind: not found");
    }
    let tests = [
        ("cc", "tests/questions.c"),
        ("cc", "tests/faults.c"),
        ("cc", "tests/agree.c"),
        ("cc", "examples/example.c"),
        ("c++", "tests/threads.cpp"),
    ];
    for (compiler, source) in tests {
        let Some((_, standard)) = compilers.iter().find(|(program, _)| *program == compiler) else {
            println!("skipped {source}: found no `{compiler}`");
            continue;
        };
        let source = folder.join(source);
        let stem = source.file_stem().ok_or("expected a file")?;
        let mut command = Command::new(compiler);
        command.args(STRICT).arg(standard).arg("-I").arg(folder.join("include"));
        command.arg("-I").arg(folder.join("tests")).arg(&source).arg("-o").arg(work.join(stem));
        command.arg("-L").arg(built).arg("-lnearmiss_c").args(["-lm", "-lpthread"]);
        run_command(command.arg(format!("-Wl,-rpath,{}", built.display())), compiler)?;
    }
    let ran = |name: &str| {
        let program = work.join(name);
        if !program.exists() {
            return Ok(());
        }
        let mut command = Command::new(if valgrind { Path::new("valgrind") } else { &program });
        if valgrind {
            command.args(["--quiet", "--error-exitcode=9", "--leak-check=full"]);
            command.args(["--errors-for-leak-kinds=definite", "--show-leak-kinds=definite"]).arg(&program);
        }
        run_command(command.current_dir(work), name)
    };
    if exists_in(compilers, "c++") {
        ran("threads")?;
    }
    if exists_in(compilers, "cc") {
        ran("questions")?;
        ran("faults")?;
        let mut example = Command::new(work.join("example"));
        example.arg(scan()).current_dir(work).stdout(Stdio::null());
        run_command(&mut example, "example")?;
        agree(built, work)?;
    }
    Ok(())
}

fn exists_in(compilers: &[(&str, &str)], name: &str) -> bool {
    compilers.iter().any(|(program, _)| *program == name)
}

/// The scan of all tests.
fn scan() -> PathBuf {
    nearmiss_testdata::dragon::dragon_path(nearmiss_testdata::dragon::Dragon::Points5k)
}

/// Returns the standard output of a program with this standard input.
fn output(command: &mut Command, name: &str, input: &[u8]) -> Outcome<String> {
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let mut stdin = child.stdin.take().ok_or("expected a pipe")?;
    let input = input.to_vec();
    let writer = std::thread::spawn(move || stdin.write_all(&input));
    let output = child.wait_with_output()?;
    let written = writer.join().map_err(|_panic| "expected a writer, got a panic")?;
    if !output.status.success() {
        return Err(format!("`{name}` failed: {}", output.status).into());
    }
    written?;
    Ok(String::from_utf8(output.stdout)?)
}

/// Checks that the C library answers as the command line does. The command line makes a matrix of a
/// pose first, which rounds it: verdicts and evidence are the same, numbers up to [`ROUNDING`].
fn agree(built: &Path, work: &Path) -> Outcome {
    let command_line = built.join(format!("nearmiss{}", std::env::consts::EXE_SUFFIX));
    let told =
        |words: &[&str]| output(Command::new(&command_line).current_dir(work).args(words), "nearmiss", &[]);
    let input = scan();
    told(&["preprocess", &input.to_string_lossy(), "-o", "dragon.nm", "--quiet"])?;
    told(&[
        "poses",
        "dragon.nm",
        "dragon.nm",
        "--near",
        "--per-distance",
        POSES,
        "-o",
        "near.jsonl",
        "--quiet",
    ])?;
    // The same poses for both, as numbers that both read: a translation and a quaternion.
    let mut poses = String::new();
    for line in fs::read_to_string(work.join("near.jsonl"))?.lines() {
        let line: serde_json::Value = serde_json::from_str(line)?;
        let [a, b] = ["a", "b"].map(|side| matrix(&line[side]));
        let relative = nearmiss::Pose::from_matrix(&a?)?.inverse().after(&nearmiss::Pose::from_matrix(&b?)?);
        let turn = nalgebra::Rotation3::from_matrix_unchecked(*relative.rotation());
        let [i, j, k, w]: [f64; 4] = nalgebra::UnitQuaternion::from_rotation_matrix(&turn).coords.into();
        let [x, y, z] = relative.translation();
        poses += &format!("{x} {y} {z} {i} {j} {k} {w}\n");
    }
    fs::write(work.join("poses.txt"), &poses)?;
    let ask = |what: &str| told(&[what, "dragon.nm", "dragon.nm", "--poses", "poses.txt", "--json"]);
    let (collided, apart) = (ask("collide")?, ask("distance")?);
    let ours = output(
        Command::new(work.join("agree")).arg("dragon.nm").current_dir(work),
        "agree",
        poses.as_bytes(),
    )?;
    let mut compared = 0;
    for ((line, collided), apart) in ours.lines().zip(collided.lines()).zip(apart.lines()) {
        let (collided, apart): (serde_json::Value, serde_json::Value) =
            (serde_json::from_str(collided)?, serde_json::from_str(apart)?);
        let witness = &collided["witness"];
        let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
        let code = |name: &serde_json::Value, names: [&str; 2]| {
            names
                .iter()
                .position(|known| name == known)
                .map_or(-1.0, |place| if place == 0 { 0.0 } else { 1.0 })
        };
        let expected = [
            code(&collided["verdict"], ["separated", "intersecting"]),
            code(&collided["evidence"], ["estimated", "certified"]),
            number(&collided["gap"]),
            number(&witness[0]),
            number(&witness[1]),
            number(&witness[2]),
            number(&apart["lower"]),
            number(&apart["upper"]),
        ];
        let got: Vec<f64> = line.split(' ').map(str::parse).collect::<Result<_, _>>()?;
        let same = |(a, b): (&f64, &f64)| (a - b).abs() <= ROUNDING || (a.is_nan() && b.is_nan());
        if got.len() != expected.len() || !expected.iter().zip(&got).all(same) {
            return Err(format!(
                "pose {compared}: expected {expected:?} as the command line says, got {got:?}"
            )
            .into());
        }
        compared += 1;
    }
    if compared != poses.lines().count() || compared == 0 {
        return Err(format!("expected {} answers, got {compared}", poses.lines().count()).into());
    }
    println!("C: {compared} poses answered as the command line does");
    Ok(())
}

fn matrix(value: &serde_json::Value) -> Outcome<[f64; 16]> {
    let numbers: Vec<f64> = value
        .as_array()
        .map(|row| row.iter().filter_map(serde_json::Value::as_f64).collect())
        .unwrap_or_default();
    <[f64; 16]>::try_from(numbers).map_err(|_count| "expected 16 numbers of a pose".into())
}

/// Makes the environment `target/integrations/python` with these packages; `None` if that fails.
fn environment(work: &Path, packages: &[&str]) -> Option<PathBuf> {
    let folder = work.join("python");
    let bin = folder.join(if cfg!(windows) { "Scripts" } else { "bin" });
    let made =
        run_command(Command::new("python3").args(["-m", "venv"]).arg(&folder), "python3").and_then(|()| {
            let mut pip = Command::new(bin.join("python"));
            pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(packages);
            run_command(&mut pip, "pip")
        });
    made.map_err(|error| println!("{error}")).ok().map(|()| bin)
}

fn python_tests(built: &Path, work: &Path) -> Outcome {
    let folder = root().join("integrations/python");
    let requirements = folder.join("tests/requirements.txt");
    let Some(bin) = environment(work, &["--requirement", &requirements.to_string_lossy()]) else {
        return skip("Python: its packages cannot be installed here");
    };
    // The package as a wheel installs it.
    let stage = work.join("stage");
    let package = stage.join("nearmiss");
    fs::create_dir_all(&package)?;
    for entry in fs::read_dir(folder.join("python/nearmiss"))? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            fs::copy(entry.path(), package.join(entry.file_name()))?;
        }
    }
    let extension = if cfg!(windows) { "_native.pyd" } else { "_native.abi3.so" };
    fs::copy(built.join(shared("nearmiss_python")), package.join(extension))?;
    let mut mypy = Command::new(bin.join("python"));
    mypy.args(["-m", "mypy", "--strict", "--no-error-summary", "--cache-dir"]).arg(work.join("mypy"));
    mypy.args(["-p", "nearmiss"]).env("MYPYPATH", &stage).current_dir(&stage);
    run_command(&mut mypy, "mypy")?;
    let mut tests = Command::new(bin.join("python"));
    tests.args(["-B", "-m", "unittest", "--quiet"]).current_dir(folder.join("tests"));
    tests.env("PYTHONPATH", &stage);
    tests.env("NEARMISS_COMMAND", built.join(format!("nearmiss{}", std::env::consts::EXE_SUFFIX)));
    run_command(&mut tests, "python -m unittest")?;
    let mut tour = Command::new(bin.join("python"));
    tour.arg(folder.join("tour.py")).arg(scan()).env("PYTHONPATH", &stage).current_dir(work);
    run_command(tour.stdout(Stdio::null()), "tour.py")
}

/// Builds the wheel into `target/wheels`, or the folder of `-o`.
pub(crate) fn wheel(words: &[&str]) -> Outcome {
    let folder = match words {
        [] => root().join("target/wheels"),
        ["-o", folder] => PathBuf::from(folder),
        _ => return Err("expected `wheel [-o FOLDER]`, got other words".into()),
    };
    let work = root().join("target/integrations");
    fs::create_dir_all(&work)?;
    let bin = environment(&work, &["maturin>=1.9,<2"])
        .ok_or("expected maturin from `pip`, got none; check the network")?;
    let mut maturin = Command::new(bin.join("maturin"));
    maturin.args(["build", "--release", "--quiet", "--manifest-path"]);
    maturin.arg(root().join("integrations/python/Cargo.toml")).arg("--out").arg(&folder);
    run_command(&mut maturin, "maturin")?;
    println!("the wheel is in {}", folder.display());
    Ok(())
}

/// Builds the C library and lays it out in a folder: header, libraries, files of
/// pkg-config and `CMake`.
pub(crate) fn c_library(words: &[&str]) -> Outcome {
    let [prefix] = words else { return Err("expected `c-library FOLDER`, got other words".into()) };
    run_cargo(&["build", "--release", "--quiet", "-p", "nearmiss-c"])?;
    let release = built("release")?;
    let (source, prefix) = (root().join("integrations/c"), Path::new(prefix));
    let [include, lib] = ["include", "lib"].map(|name| prefix.join(name));
    let [pkgconfig, cmake] = ["pkgconfig", "cmake/nearmiss"].map(|name| lib.join(name));
    for folder in [&include, &lib, &pkgconfig, &cmake] {
        fs::create_dir_all(folder)?;
    }
    fs::copy(source.join("include/nearmiss.h"), include.join("nearmiss.h"))?;
    fs::copy(source.join("cmake/nearmiss-config.cmake"), cmake.join("nearmiss-config.cmake"))?;
    let versioned = [
        ("nearmiss.pc.in", pkgconfig.join("nearmiss.pc")),
        ("cmake/nearmiss-config-version.cmake.in", cmake.join("nearmiss-config-version.cmake")),
    ];
    for (template, path) in versioned {
        let text = fs::read_to_string(source.join(template))?;
        fs::write(path, text.replace("@VERSION@", env!("CARGO_PKG_VERSION")))?;
    }
    let archive = if cfg!(windows) { "nearmiss_c.lib" } else { "libnearmiss_c.a" };
    for file in [shared("nearmiss_c"), archive.to_owned()] {
        fs::copy(release.join(&file), lib.join(&file))?;
    }
    println!("the library is in {}", prefix.display());
    Ok(())
}
