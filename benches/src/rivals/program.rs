//! Rivals of other languages: a program that times its own queries, such as
//! `benches/rivals/rivals.cpp`.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use nearmiss::Pose;

use crate::Failure;
use crate::object::Object;

/// The answers of one engine of the program.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Engine {
    /// Name of the engine.
    pub name: String,
    /// Time of preparing the object, in milliseconds.
    pub prepared: f64,
    /// For each pose, `true` if the copies meet, and the time of the query in nanoseconds.
    pub verdicts: Vec<(bool, f64)>,
    /// For each pose at which the copies are apart, the distance and its time in nanoseconds. Empty
    /// if the engine measures none.
    pub distances: Vec<(f64, f64)>,
}

/// Runs the program `path` on an object and the poses of its copy. `distances` asks for distances
/// too.
///
/// # Errors
/// When the program fails, or its output is malformed.
pub fn run(path: &Path, object: &Object, poses: &[Pose], distances: bool) -> Result<Vec<Engine>, Failure> {
    let folder = tempfile::tempdir()?;
    let (shape, places) = (folder.path().join("object"), folder.path().join("poses"));
    fs::write(&shape, shape_of(object))?;
    fs::write(&places, poses.iter().fold(String::new(), |text, pose| text + &row(pose)))?;
    let mut command = Command::new(path);
    command.args([&shape, &places]).args(distances.then_some("--distances"));
    let output = command.output().map_err(|error| format!("{}: {error}", path.display()))?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{} ended with {}: {message}", path.display(), output.status).into());
    }
    let engines = parse(&String::from_utf8(output.stdout)?)?;
    match engines.iter().find(|engine| engine.verdicts.len() != poses.len()) {
        None => Ok(engines),
        Some(engine) => {
            let (name, got) = (&engine.name, engine.verdicts.len());
            Err(format!("expected {} answers of {name}, got {got}", poses.len()).into())
        }
    }
}

/// Returns the object as text: its sampling radius, vertices and triangles.
fn shape_of(object: &Object) -> String {
    let mut text = format!("r {}\n", object.r);
    let positions = match &object.mesh {
        Some(mesh) => mesh.vertices().to_vec(),
        None => (0..object.cloud.len()).map(|i| object.cloud.point(i)).collect(),
    };
    for [x, y, z] in positions {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [i, j, k] in object.mesh.iter().flat_map(|mesh| mesh.triangles()) {
        let _ = writeln!(text, "f {i} {j} {k}");
    }
    text
}

/// Returns the first three rows of the matrix of a pose on one line.
fn row(pose: &Pose) -> String {
    let (rotation, translation) = (pose.rotation(), pose.translation());
    let rows = (0..3).flat_map(|i| (0..3).map(move |j| rotation[(i, j)]).chain([translation[i]]));
    rows.fold(String::new(), |text, number| text + &format!("{number} ")) + "\n"
}

fn parse(text: &str) -> Result<Vec<Engine>, Failure> {
    let mut engines: Vec<Engine> = Vec::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match (words.as_slice(), engines.last_mut()) {
            (["engine", name, prepared], _) => engines.push(Engine {
                name: (*name).to_owned(),
                prepared: prepared.parse()?,
                ..Engine::default()
            }),
            ([hit, time, distance, distance_time], Some(engine)) => {
                engine.verdicts.push((*hit == "1", time.parse()?));
                let distance_time: f64 = distance_time.parse()?;
                if distance_time >= 0.0 {
                    engine.distances.push((distance.parse()?, distance_time));
                }
            }
            _ => return Err(format!("expected an engine or four numbers, got {line:?}").into()),
        }
    }
    Ok(engines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_of_a_program_are_read() {
        let engines = parse("engine a 2.5\n1 40 -1 -1\n0 50 0.25 900\nengine b 1\n").unwrap();
        assert_eq!(engines.len(), 2);
        assert_eq!(engines[0].verdicts, [(true, 40.0), (false, 50.0)]);
        assert_eq!(engines[0].distances, [(0.25, 900.0)]);
        assert!(parse("1 40 -1 -1").is_err(), "an answer before any engine");
        assert!(parse("engine a 1\n1 40").is_err(), "two numbers are missing");
    }
}
