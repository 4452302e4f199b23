//! The sweep: all methods on the same poses in the same run, each pose queried once.
//!
//! Two copies of an object with longest side 2, their centres 0 to 3 apart in thirteen steps, with
//! random rotations and directions: Zachmann, "Minimal Hierarchical Collision Detection", VRST
//! 2002. Repeating a few poses would make times a quarter to a half too short, so a pass queries
//! each once, and every pass draws new ones. Before each distance a method is warmed up with poses
//! of a pass that is never timed.

use std::hint::black_box;

use nearmiss::Pose;

use crate::clock::{nanoseconds, timed};
use crate::poses::{DISTANCES, NearPose};
use crate::rivals::Method;
use crate::rivals::program::Engine;
use crate::sample::{Sample, count};

/// Warm-up poses before each distance.
const WARM_UP: usize = 20;

/// Times, hits and costs of one method at one distance.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Column {
    /// The time of each query, in nanoseconds.
    pub times: Sample,
    /// Number of poses that the method reports as intersecting.
    pub hits: usize,
    /// Evaluations, or triangle or point tests.
    pub evaluations: u64,
    /// Node pairs.
    pub node_pairs: u64,
}

impl Column {
    /// Queries all `poses` once.
    pub fn ask<'a>(&mut self, method: &mut dyn Method, poses: impl IntoIterator<Item = &'a Pose>) {
        for pose in poses {
            method.prepare();
            let (reply, time) = timed(|| black_box(method.ask(&Pose::IDENTITY, black_box(pose))));
            self.times.push(nanoseconds(time));
            self.hits += usize::from(reply.hit);
            self.evaluations += reply.evaluations;
            self.node_pairs += reply.node_pairs;
        }
    }

    /// Mean evaluations per query.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a mean of counts")]
    pub fn mean_evaluations(&self) -> f64 {
        self.evaluations as f64 / count(self.times.len().max(1))
    }

    /// Mean node pairs per query.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a mean of counts")]
    pub fn mean_node_pairs(&self) -> f64 {
        self.node_pairs as f64 / count(self.times.len().max(1))
    }

    fn of_verdicts(verdicts: &[(bool, f64)]) -> Self {
        let mut column = Self::default();
        for &(hit, time) in verdicts {
            column.times.push(time);
            column.hits += usize::from(hit);
        }
        column
    }

    fn add(&mut self, other: &Self) {
        self.times.extend(&other.times);
        self.hits += other.hits;
        self.evaluations += other.evaluations;
        self.node_pairs += other.node_pairs;
    }
}

/// Results of one method over all passes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Track {
    /// Name of the method.
    pub name: String,
    /// All passes together, by distance.
    pub columns: [Column; DISTANCES],
    /// The sweep mean of each pass, in nanoseconds.
    pub pass_means: Vec<f64>,
    /// Results near first touch.
    pub near: Column,
}

impl Track {
    /// The sweep mean of a pass is the average of its thirteen means; returns the median over all
    /// passes.
    #[must_use]
    pub fn sweep_mean(&self) -> f64 {
        let mut means = self.pass_means.clone();
        means.sort_unstable_by(f64::total_cmp);
        if means.is_empty() { 0.0 } else { crate::sample::quantile(&means, 0.5) }
    }

    /// The index of the distance with the greatest mean, and that mean.
    #[must_use]
    pub fn worst_distance(&self) -> (usize, f64) {
        let means = self.columns.iter().map(|column| column.times.summary().mean).enumerate();
        means.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
    }

    /// Average of the means of distances 0 to 1.5, which Klein & Zachmann 2005 plot against
    /// density.
    #[must_use]
    pub fn inner_mean(&self) -> f64 {
        let inner = &self.columns[..=6];
        inner.iter().map(|column| column.times.summary().mean).sum::<f64>() / count(inner.len())
    }
}

impl Track {
    /// The track of a program that answered the poses of all passes, one after another, and then
    /// those near first touch.
    #[must_use]
    pub fn of_engine(engine: &Engine, passes: usize, per_distance: usize) -> Self {
        let mut track = Self { name: engine.name.replace('-', " "), ..Self::default() };
        let (swept, near) = engine.verdicts.split_at(passes * DISTANCES * per_distance);
        for pass in swept.chunks(DISTANCES * per_distance) {
            let mut sum = 0.0;
            for (column, verdicts) in track.columns.iter_mut().zip(pass.chunks(per_distance)) {
                let of_pass = Column::of_verdicts(verdicts);
                sum += of_pass.times.summary().mean;
                column.add(&of_pass);
            }
            track.pass_means.push(sum / count(DISTANCES));
        }
        track.near = Column::of_verdicts(&near[WARM_UP.min(near.len() / 2)..]);
        track
    }
}

/// Empty tracks for these methods.
#[must_use]
pub fn tracks(methods: &[Box<dyn Method + '_>]) -> Vec<Track> {
    methods.iter().map(|method| Track { name: method.name(), ..Track::default() }).collect()
}

/// Runs one pass: each method in turn at each distance. `warm` holds poses for the untimed warm-up.
pub fn pass(
    methods: &mut [Box<dyn Method + '_>],
    tracks: &mut [Track],
    poses: &[Vec<Pose>; DISTANCES],
    warm: &[Vec<Pose>; DISTANCES],
) {
    let mut sums = vec![0.0; methods.len()];
    for (i, poses) in poses.iter().enumerate() {
        for ((method, track), sum) in methods.iter_mut().zip(&mut *tracks).zip(&mut sums) {
            let mut column = Column::default();
            Column::default().ask(method.as_mut(), warm[i].iter().take(WARM_UP));
            column.ask(method.as_mut(), poses);
            *sum += column.times.summary().mean;
            track.columns[i].add(&column);
        }
    }
    for (track, sum) in tracks.iter_mut().zip(sums) {
        track.pass_means.push(sum / count(DISTANCES));
    }
}

/// Runs all methods on poses near first touch. The first few poses are an untimed warm-up.
pub fn near(methods: &mut [Box<dyn Method + '_>], tracks: &mut [Track], poses: &[NearPose]) {
    let (warm, poses) = poses.split_at(WARM_UP.min(poses.len() / 2));
    for (method, track) in methods.iter_mut().zip(tracks) {
        Column::default().ask(method.as_mut(), warm.iter().map(|near| &near.pose));
        track.near.ask(method.as_mut(), poses.iter().map(|near| &near.pose));
    }
}
