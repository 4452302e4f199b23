//! Checks that the surface is in the enclosures. Points of the surface are projected from random
//! places. Each of them, and each of these places whose status is ok, must be in the enclosures of
//! all nodes that have its nearest cloud point. All cloud points must be so too.

use std::sync::atomic::{AtomicU64, Ordering};

use nearmiss::Status;
use nearmiss::hierarchy::{GatherScratch, OrientedBox};
use nearmiss::surface::project;
use rayon::prelude::*;

use crate::neighbour::Neighbours;
use crate::sample::Source;
use crate::subject::Subject;

/// Points of the surface that share one source of random numbers.
const CHUNK: u64 = 4096;

/// The maximum number of starts for each point wanted: some scans are mostly ambiguous.
const TRIES: u64 = 8;

/// Greatest distance of starts from a cloud point, in local radii; one in [`FAR_SHARE`] is further.
const REACH: f64 = 1.0;
const FAR_REACH: f64 = 2.5;
const FAR_SHARE: u64 = 5;

/// The findings about points of a surface.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sampled {
    pub(crate) starts: u64,
    pub(crate) points: u64,
    /// Starts of status ok, on the surface or not.
    pub(crate) places: u64,
    /// Starts and points that are in cells, and so belong to the obstacle.
    pub(crate) in_cells: u64,
    /// The greatest `|t_k|/half_k` of a point in an enclosure; above 1 it is outside.
    pub(crate) fill: f64,
    /// The greatest distance of a point from its nearest cloud point, in the latter's local radii.
    pub(crate) far: f64,
    pub(crate) faults: Vec<String>,
}

/// A box, prepared for testing points.
struct Inverse {
    centre: [f64; 3],
    half: [f64; 3],
    /// Rows of the inverse of the matrix whose columns are the axes.
    rows: [[f64; 3]; 3],
}

impl Inverse {
    fn new(centre: [f32; 3], half: [f32; 3], axes: [[f32; 3]; 3]) -> Self {
        let [x, y, z] = axes.map(|v| v.map(f64::from));
        let volume = dot(x, cross(y, z));
        let rows = [cross(y, z), cross(z, x), cross(x, y)].map(|v| v.map(|c| c / volume));
        Self { centre: centre.map(f64::from), half: half.map(f64::from), rows }
    }

    /// Returns the factor by which the box must be scaled to contain `x`: above 1 if `x` is
    /// outside.
    fn fill(&self, x: [f64; 3]) -> f64 {
        let d = [0, 1, 2].map(|k| x[k] - self.centre[k]);
        let part = |k: usize| {
            let t = dot(self.rows[k], d).abs();
            if t == 0.0 { 0.0 } else { t / self.half[k] }
        };
        // Unlike a maximum, a sum propagates NaN.
        let all = [part(0), part(1), part(2)];
        if all.iter().sum::<f64>().is_nan() { f64::NAN } else { all.into_iter().fold(0.0, f64::max) }
    }
}

/// The tree of a scan, accessed from its leaves.
struct Tree<'a> {
    subject: &'a Subject,
    neighbours: Neighbours<'a>,
    boxes: Vec<Inverse>,
    /// Enclosures of the obstacle.
    of_obstacle: Vec<Inverse>,
    /// Parent of each node; the root is its own.
    parents: Vec<usize>,
    /// Leaf of each point.
    leaves: Vec<usize>,
}

impl<'a> Tree<'a> {
    fn new(subject: &'a Subject) -> Self {
        let scan = &subject.scan;
        let inverse = |b: OrientedBox| Inverse::new(b.centre, b.half, b.axes);
        let boxes = scan.enclosures().map(inverse).collect();
        let arrays = scan.arrays();
        let topology = scan.topology();
        let of_obstacle = topology.ids().map(|id| inverse(arrays.obstacle_enclosure(id.index()))).collect();
        let mut parents = vec![0; topology.len()];
        let mut leaves = vec![0; scan.len()];
        for id in topology.ids() {
            if topology.is_leaf(id) {
                leaves[topology.points(id)].fill(id.index());
            } else {
                topology.children(id).iter().for_each(|child| parents[child.index()] = id.index());
            }
        }
        Self { subject, neighbours: Neighbours::new(scan.positions()), boxes, of_obstacle, parents, leaves }
    }

    /// Checks `x` (stored frame), a place of status ok.
    fn check(&self, x: [f64; 3], sampled: &mut Sampled) {
        let nearest = self.neighbours.nearest(x);
        let point = nearest.index as usize;
        let radius = f64::from(self.subject.scan.radii()[point]);
        sampled.far = sampled.far.max(nearest.distance_sq.sqrt() / radius);
        self.check_enclosed(&self.boxes, x, point, "a place with status ok", sampled);
        if self.subject.is_in_cell_of(point, x) {
            sampled.in_cells += 1;
            self.check_enclosed(&self.of_obstacle, x, point, "a place of the obstacle", sampled);
        }
    }

    /// Checks a place of the ball of `point`, at `away` from its centre in units of its radius, and
    /// the point itself.
    fn check_ball(&self, point: usize, away: [f64; 3], sampled: &mut Sampled) {
        let p = self.subject.scan.positions()[point].map(f64::from);
        let radius = self.subject.ball(point);
        let x = [0, 1, 2].map(|k| p[k] + radius * away[k]);
        self.check_enclosed(&self.of_obstacle, x, point, "a point of a ball", sampled);
    }

    /// Checks that `x`, which belongs to `point`, is in the enclosures of all nodes above.
    fn check_enclosed(
        &self,
        boxes: &[Inverse],
        x: [f64; 3],
        point: usize,
        what: &str,
        sampled: &mut Sampled,
    ) {
        let mut id = self.leaves[point];
        loop {
            let fill = boxes[id].fill(x);
            sampled.fill = sampled.fill.max(fill);
            if fill.is_nan() || fill > 1.0 {
                sampled.faults.push(format!(
                    "expected {what} within the enclosure of node {id}, got {x:?} (stored frame, nearest to point {point}) \
                     at {fill} times its half extent"
                ));
            }
            if id == 0 {
                return;
            }
            id = self.parents[id];
        }
    }

    fn chunk(&self, wanted: u64, mut source: Source) -> Sampled {
        let scan = &self.subject.scan;
        let mut scratch = GatherScratch::default();
        let mut sampled = Sampled::default();
        while sampled.points < wanted && sampled.starts < TRIES * wanted {
            let i = usize::try_from(source.below(scan.len() as u64)).unwrap_or_default();
            let reach = if source.below(FAR_SHARE) == 0 { FAR_REACH } else { REACH };
            let radius = f64::from(scan.radii()[i]) * reach;
            let away = source.in_ball();
            let start = [0, 1, 2].map(|k| f64::from(scan.positions()[i][k]) + radius * away[k]);
            let end = project(start, |x| scan.evaluate_with(x, &mut scratch));
            sampled.starts += 1;
            let length = away.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.0 {
                self.check_ball(i, away.map(|x| x / length * (1.0 - 1e-9)), &mut sampled);
            }
            if end.converged {
                sampled.points += 1;
                self.check(end.point, &mut sampled);
            }
            // The conditions on which the enclosures depend also hold off the surface, and less
            // narrowly.
            if scan.evaluate_with(start, &mut scratch).status == Status::Ok {
                sampled.places += 1;
                self.check(start, &mut sampled);
            }
        }
        sampled
    }
}

/// Checks this many points of the surface; the result is the same for any number of threads. Counts
/// in `done`.
pub(crate) fn check(subject: &Subject, points: u64, seed: u64, done: &AtomicU64) -> Sampled {
    let tree = Tree::new(subject);
    let chunks: Vec<Sampled> = (0..points.div_ceil(CHUNK))
        .into_par_iter()
        .map(|i| {
            let wanted = CHUNK.min(points - i * CHUNK);
            // The seed of each chunk is a random number from the seed.
            let sampled = tree.chunk(wanted, Source::new(Source::new(seed ^ (i << 32)).next()));
            done.fetch_add(wanted, Ordering::Relaxed);
            sampled
        })
        .collect();
    let mut all = Sampled::default();
    for (point, p) in subject.scan.positions().iter().enumerate() {
        let p = p.map(f64::from);
        for boxes in [&tree.boxes, &tree.of_obstacle] {
            tree.check_enclosed(boxes, p, point, "a measured point", &mut all);
        }
    }
    for chunk in chunks {
        all.starts += chunk.starts;
        all.points += chunk.points;
        all.places += chunk.places;
        all.in_cells += chunk.in_cells;
        all.fill = all.fill.max(chunk.fill);
        all.far = all.far.max(chunk.far);
        all.faults.extend(chunk.faults);
    }
    if all.points == 0 && points > 0 {
        all.faults.push("expected surface points to check the enclosures with, got none".into());
    }
    all
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fill_is_measured_along_the_axes_whatever_they_are() {
        // A skewed box: its second axis leans.
        let skewed = Inverse::new(
            [1.0, 0.0, 0.0],
            [2.0, 1.0, 0.5],
            [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        );
        let at = |t: [f64; 3]| [1.0 + t[0] + t[1], t[1], t[2]];
        for (t, fill) in [([2.0, 1.0, 0.5], 1.0), ([1.0, -0.25, 0.0], 0.5), ([0.0, 0.0, -0.75], 1.5)] {
            assert!((skewed.fill(at(t)) - fill).abs() < 1e-15, "{t:?}");
        }
        let flat =
            Inverse::new([0.0; 3], [1.0, 1.0, 0.0], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert!(flat.fill([0.5, 0.0, 0.0]) <= 1.0 && flat.fill([0.0, 0.0, 1e-300]) > 1.0, "no thickness");
    }
}
