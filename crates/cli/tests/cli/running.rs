//! Helpers that run the command in a temporary folder, and write small clouds.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nearmiss_testdata::shapes::{Form, Sampling};
use serde_json::Value;

/// A temporary folder, one for each test.
pub(crate) struct Place(tempfile::TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), content).unwrap();
        self.path(name)
    }

    /// Returns the names of all files, sorted.
    pub(crate) fn files(&self) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(self.0.path())
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// Writes points of `form` as text.
    pub(crate) fn cloud(&self, name: &str, form: Form, spacing: f64) -> PathBuf {
        self.write(name, text(&form.sample(Sampling::clean(spacing)).points))
    }

    /// Returns the width of a picture in pixels, and its bytes (red, green, blue).
    pub(crate) fn picture(&self, name: &str) -> (usize, Vec<u8>) {
        let file = std::fs::File::open(self.path(name)).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (usize::try_from(info.width).unwrap(), pixels)
    }

    /// Runs the command in this folder.
    pub(crate) fn run(&self, args: &[&str]) -> Done {
        let output = Command::new(env!("CARGO_BIN_EXE_nearmiss"))
            .args(args)
            .current_dir(self.0.path())
            .output()
            .unwrap();
        Done::new(output, args)
    }

    /// Runs the command, which must succeed.
    pub(crate) fn ok(&self, args: &[&str]) -> Done {
        let done = self.run(args);
        assert_eq!(done.status, 0, "{args:?}: {}", done.errors);
        done
    }

    /// Runs the command, which must fail with one error that holds all `words`, and write nothing.
    pub(crate) fn refused(&self, status: i32, args: &[&str], words: &[&str]) {
        let before = self.files();
        let done = self.run(args);
        assert_eq!(done.status, status, "{args:?}: {}{}", done.results, done.errors);
        assert!(done.errors.starts_with("error: "), "{args:?}: {}", done.errors);
        for word in words {
            assert!(done.errors.contains(word), "{args:?}: `{word}` in {}", done.errors);
        }
        assert!(!done.errors.contains("panicked"), "{args:?}: {}", done.errors);
        assert_eq!(self.files(), before, "{args:?} leaves nothing behind");
    }
}

/// The result of a run.
pub(crate) struct Done {
    pub(crate) status: i32,
    pub(crate) results: String,
    pub(crate) errors: String,
}

impl Done {
    pub(crate) fn new(output: Output, args: &[&str]) -> Self {
        let status = output.status.code();
        Self {
            status: status.unwrap_or_else(|| panic!("{args:?} was killed")),
            results: String::from_utf8(output.stdout).unwrap(),
            errors: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Parses one JSON object per line.
    pub(crate) fn json(&self) -> Vec<Value> {
        self.results.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}

pub(crate) fn text(points: &[[f64; 3]]) -> String {
    points.iter().fold(String::new(), |mut text, [x, y, z]| {
        writeln!(text, "{x} {y} {z}").unwrap();
        text
    })
}

/// Returns the keys of an object, sorted.
pub(crate) fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

pub(crate) fn sorted<'a>(words: &'a str) -> Vec<&'a str> {
    let mut words: Vec<&'a str> = words.split_whitespace().collect();
    words.sort_unstable();
    words
}

pub(crate) fn shift(x: f64, y: f64, z: f64) -> String {
    format!("1 0 0 {x} 0 1 0 {y} 0 0 1 {z} 0 0 0 1")
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

pub(crate) fn name(path: &Path) -> &str {
    path.to_str().unwrap()
}
