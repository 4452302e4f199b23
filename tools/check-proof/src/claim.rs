//! Checks of the claims of a line of a proof.

use crate::boxes::{Placed, distance, distance_of_all};
use crate::cover::{Rectangle, uncovered};
use crate::placement::Placement;
use crate::proof::{Enclosure, Line, Matrix, Poses, Semantics, Verdict};
use crate::subject::Subject;
use crate::witness;

/// The greatest correction of a pose, in sampling radii, as in the command line.
const MENDED: f64 = 0.1;

/// Rounding error of a residual, in bandwidths.
const RESIDUAL: f64 = 1e-5;

/// Relative rounding error of a distance in the world.
const ROUNDING: f64 = 1e-6;

/// Nodes of at most this many points are also checked point by point.
const POINT_BY_POINT: u32 = 64;

/// The claim of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Separated,
    Intersecting,
    /// An estimate, or no claim.
    Unproven,
}

/// The findings of a line.
#[derive(Debug, Clone)]
pub(crate) struct Finding {
    pub(crate) kind: Kind,
    pub(crate) faults: Vec<String>,
    /// Node pairs proven to be disjoint.
    pub(crate) pairs: usize,
    /// Number of these pairs that are proven by their points.
    pub(crate) by_points: usize,
    /// The greatest ratio of the claimed gap to the proven distance of a pair.
    pub(crate) claimed: f64,
    /// `true` if the witness is between two surfaces nearer than the margin, not on both.
    pub(crate) between: bool,
    /// The greater |f| at the witness, in bandwidths.
    pub(crate) off: f64,
    /// `true` if a condition of a surface holds at the witness only up to rounding.
    pub(crate) on_the_brink: bool,
    /// The correction of the poses, in sampling radii.
    pub(crate) mended: f64,
}

/// The scans of a proof, and the poses of the queries, if known.
pub(crate) struct Checker<'a> {
    pub(crate) subjects: [&'a Subject; 2],
    pub(crate) poses: Option<&'a Poses>,
}

impl Checker<'_> {
    /// Checks all claims of `line`.
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
            by_points: 0,
            claimed: 0.0,
            between: false,
            off: 0.0,
            on_the_brink: false,
            mended: 0.0,
        };
        let checked = match kind {
            Kind::Separated => self
                .placements(line, &mut finding)
                .and_then(|placements| self.separated(line, &placements, &mut finding)),
            Kind::Intersecting => self
                .placements(line, &mut finding)
                .and_then(|placements| self.intersecting(line, &placements, &mut finding)),
            Kind::Unproven => Ok(()),
        };
        finding.faults.extend(checked.err());
        finding
    }

    /// Checks that both placements are poses, and those of the query.
    fn placements(&self, line: &Line, finding: &mut Finding) -> Result<[Placement; 2], String> {
        let asked = self.poses.map(|poses| {
            poses.get(&line.query).ok_or("expected the line of a pose as query, got another number")
        });
        let asked: Option<&[Matrix; 2]> = asked.transpose()?;
        let mut place = |i: usize, name: &str, matrix: &Matrix| {
            let placement = Placement::new(matrix).map_err(|e| format!("{name}: {e}"))?;
            if let Some(poses) = asked {
                let Subject { scan, bounds, .. } = self.subjects[i];
                // From the caller's units to stored units, then to the world.
                let radius = scan.sampling_radius() / scan.frame().scale * placement.scale;
                let moved = placement.moved(&poses[i], scan.frame(), *bounds) / radius;
                finding.mended = finding.mended.max(moved);
                if moved.is_nan() || moved > MENDED {
                    return Err(format!(
                        "{name}: expected the pose of the query, got one {moved:.2e} sampling radii away"
                    ));
                }
            }
            Ok(placement)
        };
        Ok([place(0, "placed_a", &line.placed_a)?, place(1, "placed_b", &line.placed_b)?])
    }

    /// Checks that the pairs cover all pairs of points, that their nodes are those of the scans,
    /// and that their enclosures are far enough apart.
    fn separated(
        &self,
        line: &Line,
        placements: &[Placement; 2],
        finding: &mut Finding,
    ) -> Result<(), String> {
        let gap = line
            .gap
            .filter(|gap| *gap >= 0.0)
            .ok_or("expected a gap of at least 0 with a certified separation, got none")?;
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
            return Err(format!("expected pairs of listed nodes, got {pair:?}"));
        }

        let points = |node: &Enclosure| u64::from(node.first)..u64::from(node.first) + u64::from(node.count);
        let rectangle =
            |&[i, j]: &[usize; 2]| Rectangle { a: points(&line.nodes_a[i]), b: points(&line.nodes_b[j]) };
        let rectangles: Vec<Rectangle> = line.pairs.iter().map(rectangle).collect();
        let size = self.subjects.map(|subject| subject.scan.len() as u64);
        if let Some([i, j]) = uncovered(&rectangles, size) {
            let count = line.pairs.len();
            return Err(format!(
                "expected a node pair with point {i} of a and point {j} of b, got none among {count}"
            ));
        }

        let place = |nodes: &[Enclosure], matrix: &Matrix| -> Vec<Placed> {
            nodes.iter().map(|node| Placed::new(node, matrix)).collect()
        };
        let (a, b) = (place(&line.nodes_a, &line.placed_a), place(&line.nodes_b, &line.placed_b));
        let wanted = gap.max(line.margin);
        for &[i, j] in &line.pairs {
            let proven = distance(&a[i], &b[j], wanted).or_else(|| {
                finding.by_points += 1;
                self.by_points(line, placements, [i, j], [&a[i], &b[j]], wanted)
            });
            let Some(proven) = proven else {
                let [a, b] = [&line.nodes_a[i], &line.nodes_b[j]].map(points);
                return Err(format!(
                    "expected nodes at least {wanted} apart, got nearer ones (points {a:?} of a and {b:?} of b)"
                ));
            };
            finding.pairs += 1;
            finding.claimed = finding.claimed.max(wanted / proven);
        }
        Ok(())
    }

    /// Returns the approximate distance of the obstacles of a node pair, if their points prove that
    /// it is at least `wanted`. The proof uses the parts of the obstacle about the points of either
    /// node, or of both.
    fn by_points(
        &self,
        line: &Line,
        placements: &[Placement; 2],
        [i, j]: [usize; 2],
        [a, b]: [&Placed; 2],
        wanted: f64,
    ) -> Option<f64> {
        if line.semantics != Semantics::Obstacle {
            return None;
        }
        let parts = |side: usize, node: &Enclosure, matrix: &Matrix| -> Option<Vec<Placed>> {
            let subject = self.subjects[side];
            let scale = placements[side].scale * (1.0 + 1e-12);
            let range = node.first as usize..(node.first + node.count) as usize;
            let part = |k: usize| {
                let size = (subject.reach(k), subject.slab(k));
                Placed::part(subject.scan.positions()[k], size, (matrix, scale))
            };
            (node.count <= POINT_BY_POINT).then(|| range.map(part).collect())
        };
        let (of_a, of_b) =
            (parts(0, &line.nodes_a[i], &line.placed_a), parts(1, &line.nodes_b[j], &line.placed_b));
        let one = of_a.as_ref().and_then(|of_a| distance_of_all(of_a, &[*b], wanted));
        let other = || of_b.as_ref().and_then(|of_b| distance_of_all(&[*a], of_b, wanted));
        let both = || distance_of_all(of_a.as_ref()?, of_b.as_ref()?, wanted);
        one.or_else(other).or_else(both)
    }

    /// Checks that the witness is on both surfaces. With a margin, points of either surface near
    /// the witness may be within the margin of each other instead.
    fn intersecting(
        &self,
        line: &Line,
        placements: &[Placement; 2],
        finding: &mut Finding,
    ) -> Result<(), String> {
        let witness = line.witness.ok_or("expected a witness with a certified contact, got none")?;
        let claimed = line
            .residual
            .filter(|r| *r >= 0.0)
            .ok_or("expected a residual of at least 0 with a witness, got none")?;
        if line.semantics == Semantics::Obstacle {
            return self.obstacles_meet(line, placements, witness, finding);
        }
        let on = |i: usize, name: &str| {
            witness::check(self.subjects[i], &placements[i], witness).map_err(|e| format!("{name}: {e}"))
        };
        let near = |i: usize, name: &str| {
            witness::check_near(self.subjects[i], &placements[i], witness, claimed)
                .map_err(|e| format!("{name}: {e}"))
        };
        let (a, b) = match (on(0, "a"), on(1, "b")) {
            (Ok(a), Ok(b)) => (a, b),
            (a, b) if line.margin == 0.0 => (a?, b?),
            _ => {
                finding.between = true;
                let ((a, from_a), (b, from_b)) = (near(0, "a")?, near(1, "b")?);
                if from_a + from_b > line.margin * (1.0 + ROUNDING) {
                    return Err(format!(
                        "expected surface points within the margin, {}, of each other, got points {from_a:.4e} and {from_b:.4e} \
                         from the witness",
                        line.margin
                    ));
                }
                (a, b)
            }
        };
        finding.off = a.off.max(b.off);
        finding.on_the_brink = a.on_the_brink || b.on_the_brink;
        let residual = a.residual.max(b.residual);
        if !finding.between && (residual - claimed).abs() > RESIDUAL * a.bandwidth.max(b.bandwidth) {
            return Err(format!("expected the residual {residual:.2e}, got {claimed:.2e}"));
        }
        Ok(())
    }

    /// Checks that the witness is in both obstacles, or that its distances from both sum to at most
    /// the margin. It is in an obstacle if it is on the surface in a cell, in a ball, or at a
    /// measured point.
    fn obstacles_meet(
        &self,
        line: &Line,
        placements: &[Placement; 2],
        x: [f64; 3],
        finding: &mut Finding,
    ) -> Result<(), String> {
        let claimed = line
            .residual
            .filter(|r| *r >= 0.0)
            .ok_or("expected a residual of at least 0 with a witness, got none")?;
        let mut on_surfaces = Vec::new();
        let away = [0, 1].map(|i| {
            let (subject, placement) = (self.subjects[i], &placements[i]);
            if let Ok(seen) = witness::check(subject, placement, x)
                && subject.is_in_cell(placement.stored(x))
            {
                finding.off = finding.off.max(seen.off);
                finding.on_the_brink |= seen.on_the_brink;
                on_surfaces.push(seen);
                return 0.0;
            }
            let of_matter = witness::distance_of_balls(subject, placement, x);
            if line.margin == 0.0 || of_matter == 0.0 {
                return of_matter;
            }
            finding.between = true;
            let near = witness::check_near(subject, placement, x, claimed.min(0.5 * line.margin));
            near.map_or(of_matter, |(_, of_surface)| of_surface.min(of_matter))
        });
        let radius = |i: usize| {
            let scan = &self.subjects[i].scan;
            scan.sampling_radius() / scan.frame().scale * placements[i].scale
        };
        if away[0] + away[1] > line.margin * (1.0 + ROUNDING) + ROUNDING * radius(0).max(radius(1)) {
            return Err(format!(
                "expected a witness whose distances from the obstacles sum to at most the margin, {}, got {:.4e} and {:.4e}",
                line.margin, away[0], away[1]
            ));
        }
        if let [a, b] = on_surfaces[..] {
            // For balls the residual is half the distance of the points.
            let residual = a.residual.max(b.residual);
            if (residual - claimed).abs() > RESIDUAL * a.bandwidth.max(b.bandwidth) {
                return Err(format!("expected the residual {residual:.2e}, got {claimed:.2e}"));
            }
        }
        Ok(())
    }
}
