//! `distance` of two meshes.

use std::time::Duration;

use nearmiss::{MeshDistance, MeshScratch, Pose};

use super::report::MeshDistanceReport;
use super::two_meshes::{TwoMeshes, micros_since};
use super::words::distance_sentence;
use crate::console::{Console, Results, now};
use crate::error::CliError;
use crate::output;
use crate::path::{PathArgs, PathLog};
use crate::path_entry::{PathEntry, PathVerdict};
use crate::picture::names;
use crate::posing::{self, PairArgs, PoseFile, Posed};

/// A question about the distance of two meshes, for one or many poses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DistanceQuestion<'a> {
    pub(crate) pair: &'a PairArgs,
    pub(crate) path: &'a PathArgs,
    pub(crate) budget: Option<Duration>,
    pub(crate) work: Option<u64>,
    pub(crate) threads: Option<usize>,
    pub(crate) json: bool,
    pub(crate) quiet: bool,
}

impl DistanceQuestion<'_> {
    /// Answers the question on standard output.
    pub(crate) fn run(self) -> Result<(), CliError> {
        let console = Console::new(self.quiet);
        self.path.check(&self.pair.inputs(), None)?;
        let matrices = self.pair.matrices()?;
        let mut poses = self.pair.pose_file(self.path.poses.as_ref())?;
        let meshes = TwoMeshes::open(self.pair, self.threads, (self.budget, self.work), console)?;
        let mut results = Results::new();
        match &mut poses {
            Some(poses) => output::replace_if_any(self.path.csv.as_deref(), |csv| {
                let mut log = PathLog::new(self.path, csv, false)?;
                let watch = poses.watch(console, &mut results);
                self.answer_all(&meshes, poses, &mut log, &mut results)?;
                drop(watch);
                log.draw(self.path, &names(self.pair.inputs()), 0.0)?;
                let unit = meshes.unit(&[Pose::IDENTITY; 2]);
                if self.json { Ok(()) } else { results.line(log.summary(unit, 0.0)) }
            })?,
            None => {
                let poses = posing::of_options(&matrices, meshes.both())?;
                self.answer(&meshes, None, &poses, &mut MeshScratch::default(), &mut results)?;
            }
        }
        results.flush()
    }

    fn answer_all(
        self,
        meshes: &TwoMeshes,
        poses: &mut PoseFile,
        log: &mut PathLog<'_>,
        results: &mut Results,
    ) -> Result<(), CliError> {
        let mut scratch = MeshScratch::default();
        while let Some((line, text)) = poses.next_line()? {
            // Answers to the lines before a faulty one are written before the error.
            let read = poses.poses(line, &text, meshes.both());
            let Posed { poses: poses_of_line, time } =
                read.or_else(|fault| results.flush().and(Err(fault)))?;
            let (found, micros) = self.answer(meshes, Some(line), &poses_of_line, &mut scratch, results)?;
            poses.answered();
            log.add(entry(&found, line, time, micros))?;
        }
        Ok(())
    }

    /// Answers for one pair of poses. Returns the distance and the time in microseconds.
    fn answer(
        self,
        meshes: &TwoMeshes,
        line: Option<u64>,
        poses: &[Pose; 2],
        scratch: &mut MeshScratch,
        results: &mut Results,
    ) -> Result<(MeshDistance, f64), CliError> {
        let start = now();
        let found = meshes.pair(poses, start).distance(scratch);
        let micros = micros_since(start);
        meshes.compare_sizes(poses);
        let report = MeshDistanceReport::new(&found, micros);
        if self.json {
            results.json(&report)?;
            return Ok((found, micros));
        }
        let sentence = distance_sentence(&found, meshes.unit(poses));
        if let Some(line) = line {
            results.line(format_args!("line {line}: {sentence}"))?;
        } else {
            results.line(sentence)?;
            results.line(report.details())?;
        }
        Ok((found, micros))
    }
}

/// Returns the entry of a distance in the log of a path.
fn entry(found: &MeshDistance, line: u64, time: Option<f64>, micros: f64) -> PathEntry {
    let is_known = found.upper.is_finite();
    let (verdict, reason) = match (found.lower, found.upper) {
        _ if !is_known => (PathVerdict::Undecided, Some("pose")),
        (_, ..=0.0) => (PathVerdict::Intersecting, None),
        (..=0.0, _) => (PathVerdict::Undecided, Some("budget")),
        _ => (PathVerdict::Separated, None),
    };
    PathEntry {
        line,
        time,
        verdict,
        evidence: reason.is_none().then_some("certified"),
        reason,
        clearance: is_known.then_some([found.lower, found.upper]),
        penetration: None,
        is_nested: false,
        place: is_known.then_some(found.points[0]),
        micros,
    }
}
