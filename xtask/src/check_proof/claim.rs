//! Whether what a line of a proof claims holds.

use super::boxes::{Placed, distance};
use super::cover::{Rectangle, uncovered};
use super::placement::Placement;
use super::proof::{Enclosure, Line, Matrix, Poses, Semantics, Verdict};
use super::subject::Subject;
use super::witness;

/// A pose may be mended by so many sampling radii, as the command line does.
const MENDED: f64 = 0.1;

/// What rounding may do to a residual, in bandwidths.
const RESIDUAL: f64 = 1e-5;

/// What it may do to a distance in the world, relatively.
const ROUNDING: f64 = 1e-6;

/// What a line claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Separated,
    Intersecting,
    /// An estimate, or nothing.
    Unproven,
}

/// What was found of a line.
#[derive(Debug, Clone)]
pub(crate) struct Finding {
    pub(crate) kind: Kind,
    pub(crate) faults: Vec<String>,
    /// Pairs of enclosures seen to be apart.
    pub(crate) pairs: usize,
    /// The greatest part of what could be proven of a pair that the gap claims.
    pub(crate) claimed: f64,
    /// Whether the witness lies between two surfaces nearer than the margin, not on both.
    pub(crate) between: bool,
    /// The greater |f| at the witness, in bandwidths.
    pub(crate) off: f64,
    /// Whether a condition of a surface holds at the witness only up to rounding.
    pub(crate) on_the_brink: bool,
    /// How far the poses were mended, in sampling radii.
    pub(crate) mended: f64,
}

/// The scans that a proof is about, and the poses they were asked in, if known.
pub(crate) struct Checker<'a> {
    pub(crate) subjects: [&'a Subject; 2],
    pub(crate) poses: Option<&'a Poses>,
}

impl Checker<'_> {
    /// Checks all that `line` claims.
    pub(crate) fn check(&self, line: &Line) -> Finding {
        let kind = match line.verdict {
            Verdict::Separated if line.is_certified() => Kind::Separated,
            Verdict::Intersecting if line.is_certified() => Kind::Intersecting,
            _ => Kind::Unproven,
        };
        let mut finding = Finding {
            kind,
            faults: Vec::new(),
            pairs: 0,
            claimed: 0.0,
            between: false,
            off: 0.0,
            on_the_brink: false,
            mended: 0.0,
        };
        let checked = match kind {
            Kind::Separated => {
                self.placements(line, &mut finding).and_then(|_| self.separated(line, &mut finding))
            }
            Kind::Intersecting => self
                .placements(line, &mut finding)
                .and_then(|placements| self.intersecting(line, &placements, &mut finding)),
            Kind::Unproven => Ok(()),
        };
        finding.faults.extend(checked.err());
        finding
    }

    /// Both placements are poses, and those asked for.
    fn placements(&self, line: &Line, finding: &mut Finding) -> Result<[Placement; 2], String> {
        let asked = self.poses.map(|poses| poses.get(&line.query).ok_or("no such line among the poses"));
        let asked: Option<&[Matrix; 2]> = asked.transpose()?;
        let mut place = |i: usize, name: &str, matrix: &Matrix| {
            let placement = Placement::new(matrix).map_err(|e| format!("{name}: {e}"))?;
            if let Some(poses) = asked {
                let Subject { scan, bounds, .. } = self.subjects[i];
                // Of one stored unit is the placement's scale, of one unit of the caller's less by the frame's.
                let radius = scan.sampling_radius() / scan.frame().scale * placement.scale;
                let moved = placement.moved(&poses[i], scan.frame(), *bounds) / radius;
                finding.mended = finding.mended.max(moved);
                if moved.is_nan() || moved > MENDED {
                    return Err(format!("{name} is {moved:.2e} sampling radii away from the pose asked for"));
                }
            }
            Ok(placement)
        };
        Ok([place(0, "placed_a", &line.placed_a)?, place(1, "placed_b", &line.placed_b)?])
    }

    /// The pairs cover all pairs of points, their nodes are the scans', and their enclosures are far enough apart.
    fn separated(&self, line: &Line, finding: &mut Finding) -> Result<(), String> {
        let gap = line.gap.filter(|gap| *gap >= 0.0).ok_or("certified apart without a gap")?;
        for (name, nodes, subject) in
            [("a", &line.nodes_a, self.subjects[0]), ("b", &line.nodes_b, self.subjects[1])]
        {
            nodes
                .iter()
                .try_for_each(|node| subject.check_node(node, line.semantics))
                .map_err(|e| format!("{name}: {e}"))?;
        }
        let known = |[i, j]: [usize; 2]| i < line.nodes_a.len() && j < line.nodes_b.len();
        if let Some(pair) = line.pairs.iter().find(|pair| !known(**pair)) {
            return Err(format!("the pair {pair:?} is of nodes that are not listed"));
        }

        let points = |node: &Enclosure| u64::from(node.first)..u64::from(node.first) + u64::from(node.count);
        let rectangle =
            |&[i, j]: &[usize; 2]| Rectangle { a: points(&line.nodes_a[i]), b: points(&line.nodes_b[j]) };
        let rectangles: Vec<Rectangle> = line.pairs.iter().map(rectangle).collect();
        let size = self.subjects.map(|subject| subject.scan.len() as u64);
        if let Some([i, j]) = uncovered(&rectangles, size) {
            let count = line.pairs.len();
            return Err(format!("none of {count} pairs has point {i} of a with point {j} of b"));
        }

        let place = |nodes: &[Enclosure], matrix: &Matrix| -> Vec<Placed> {
            nodes.iter().map(|node| Placed::new(node, matrix)).collect()
        };
        let (a, b) = (place(&line.nodes_a, &line.placed_a), place(&line.nodes_b, &line.placed_b));
        let wanted = gap.max(line.margin);
        for &[i, j] in &line.pairs {
            let Some(proven) = distance(&a[i], &b[j], wanted) else {
                let [a, b] = [&line.nodes_a[i], &line.nodes_b[j]].map(points);
                return Err(format!("the enclosures of {a:?} of a and {b:?} of b are not {wanted} apart"));
            };
            finding.pairs += 1;
            finding.claimed = finding.claimed.max(wanted / proven);
        }
        Ok(())
    }

    /// The witness lies on both surfaces, or of obstacles in balls or at points; or, if these count as meeting from a margin on, points of either are so near
    /// to it that they are nearer to each other than the margin.
    fn intersecting(
        &self,
        line: &Line,
        placements: &[Placement; 2],
        finding: &mut Finding,
    ) -> Result<(), String> {
        let witness = line.witness.ok_or("certified to intersect without a witness")?;
        let claimed = line.residual.filter(|r| *r >= 0.0).ok_or("a witness without a residual")?;
        let on = |i: usize, name: &str| {
            witness::check(self.subjects[i], &placements[i], witness).map_err(|e| format!("{name}: {e}"))
        };
        let near = |i: usize, name: &str| {
            witness::check_near(self.subjects[i], &placements[i], witness, claimed)
                .map_err(|e| format!("{name}: {e}"))
        };
        let in_ball = |i: usize, margin: f64| {
            line.semantics == Semantics::Obstacle
                && witness::is_in_ball(self.subjects[i], &placements[i], witness, margin)
        };
        let (a, b) = match (on(0, "a"), on(1, "b")) {
            (Ok(a), Ok(b)) => (a, b),
            (a, b)
                if match (a.is_ok(), b.is_ok()) {
                    (true, _) => in_ball(1, line.margin),
                    (false, true) => in_ball(0, line.margin),
                    (false, false) => (0..2).all(|i| in_ball(i, 0.5 * line.margin)),
                } =>
            {
                finding.off = [a, b].into_iter().flatten().map(|seen| seen.off).fold(0.0, f64::max);
                return Ok(());
            }
            (a, b) if line.margin == 0.0 => (a?, b?),
            _ => {
                finding.between = true;
                let ((a, from_a), (b, from_b)) = (near(0, "a")?, near(1, "b")?);
                if from_a + from_b > line.margin * (1.0 + ROUNDING) {
                    let far = format!("{from_a:.4e} and {from_b:.4e} from the witness");
                    return Err(format!(
                        "points of the surfaces were found {far}, together more than the margin"
                    ));
                }
                (a, b)
            }
        };
        finding.off = a.off.max(b.off);
        finding.on_the_brink = a.on_the_brink || b.on_the_brink;
        let residual = a.residual.max(b.residual);
        if !finding.between && (residual - claimed).abs() > RESIDUAL * a.bandwidth.max(b.bandwidth) {
            return Err(format!("the residual is {residual:.2e}, not {claimed:.2e}"));
        }
        Ok(())
    }
}
