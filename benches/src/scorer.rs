//! Scores against exact answers: the radius r, the counts, and the defects.

use std::fmt;
use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::{Evidence, PointCloud, Pose, Verdict};

use crate::Failure;
use crate::sample::quantile;
use crate::truth::Question;

/// Rank of the neighbour whose distance is the spacing of a point.
const RANK: usize = 6;

/// The quantile of the spacings that defines r.
const QUANTILE: f64 = 0.9;

/// An axis that is not aligned with any preferred direction of a scan.
const AXIS: [f64; 3] = [0.36, 0.48, 0.8];

/// Half-width of the band in r, within which a method that sees only points cannot be expected to
/// be right. It is slightly less than one because depths in truth sets come in steps, one of which
/// is r. These cases are judged regardless of rounding of r.
const BAND: f64 = 0.999;

/// Separations with a gap below this many r must not be certified, inside the band or not.
const DEEP: f64 = -0.3;

/// Gap in r from which at least [`CERTIFIED_SHARE`] of the separations must be certified.
const CLEAR: f64 = 6.0;

/// See [`CLEAR`].
const CERTIFIED_SHARE: f64 = 0.95;

/// The radius r: the 0.9-quantile over all points of the distance to the 6th distinct neighbour,
/// computed from the points alone.
///
/// # Errors
/// When the tree rejects the points.
pub fn radius(cloud: &PointCloud) -> Result<f64, Failure> {
    let mut spacings = spacings(cloud)?;
    spacings.sort_unstable_by(f64::total_cmp);
    Ok(quantile(&spacings, QUANTILE))
}

/// The distance from each point to its 6th distinct neighbour, in the caller's units.
///
/// # Errors
/// When the tree rejects the points.
pub fn spacings(cloud: &PointCloud) -> Result<Vec<f64>, Failure> {
    // Rotated, because the tree cannot split many points with one equal coordinate; distances do
    // not change.
    let turn = Pose::from_axis_angle(AXIS, 1.0);
    let points: Vec<[f64; 3]> = cloud.positions().iter().map(|p| turn.apply(p.map(f64::from))).collect();
    let tree = ImmutableKdTree::<f64, 3>::new_from_slice(&points).map_err(|e| format!("{e:?}"))?;
    // The point itself comes first, because the points of a cloud are distinct.
    let wanted = NonZero::new(RANK + 1).ok_or("no rank")?;
    let spacing = |p: &[f64; 3]| {
        let near = tree.query(p).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        near.last().map_or(0.0, |n| n.distance.sqrt() * cloud.frame().scale)
    };
    Ok(points.iter().map(spacing).collect())
}

/// A verdict that is wrong or missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Index of the question.
    pub index: usize,
    /// Gap in multiples of r.
    pub gap: f64,
    /// The answer, if it adds something.
    pub answer: String,
}

/// Separations from some gap on, and the number of certified ones.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Share {
    /// Separations.
    pub all: usize,
    /// Certified separations.
    pub certified: usize,
}

/// Counts of the answers by outcome.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Score {
    /// Questions with |gap| > r.
    pub outside: usize,
    /// False hits: intersections reported although the gap exceeds r.
    pub false_hits: Vec<Case>,
    /// Misses: separations reported although the depth exceeds r.
    pub misses: Vec<Case>,
    /// Missing verdicts outside the band.
    pub undecided: Vec<Case>,
    /// Certified separations with a depth of more than 0.3 r.
    pub certified_wrongly: Vec<Case>,
    /// Questions with |gap| ≤ r.
    pub band: usize,
    /// Wrong verdicts in the band.
    pub band_wrong: usize,
    /// Missing verdicts in the band.
    pub band_undecided: usize,
    /// All verdicts: intersecting certified, estimated; separated certified, estimated; undecided.
    pub verdicts: [usize; 5],
    /// Separations with gap ≥ 6 r.
    pub clear: Share,
    /// Separations with gap ≥ 3 r.
    pub near: Share,
}

impl Score {
    /// Counts the verdict on the question of this index; `r` is in the units of its gap.
    pub fn count(&mut self, index: usize, question: &Question, r: f64, verdict: &Verdict) {
        let gap = question.gap / r;
        let kind = match verdict {
            Verdict::Intersecting { evidence: Evidence::Certified, .. } => 0,
            Verdict::Intersecting { .. } => 1,
            Verdict::Separated { evidence: Evidence::Certified, .. } => 2,
            Verdict::Separated { .. } => 3,
            Verdict::Undecided(_) => 4,
        };
        self.verdicts[kind] += 1;
        if verdict.is_separated() {
            for (share, from) in [(&mut self.clear, CLEAR), (&mut self.near, 3.0)] {
                share.all += usize::from(gap >= from);
                share.certified += usize::from(gap >= from && kind == 2);
            }
        }
        let case = || Case { index, gap, answer: format!("{verdict:?}") };
        if kind == 2 && gap < DEEP {
            self.certified_wrongly.push(case());
        }
        let wrong = kind < 4 && verdict.is_intersecting() != question.truth;
        if gap.abs() <= BAND {
            self.band += 1;
            self.band_wrong += usize::from(wrong);
            self.band_undecided += usize::from(kind == 4);
            return;
        }
        self.outside += 1;
        if kind == 4 {
            self.undecided.push(case());
        } else if wrong && question.truth {
            self.misses.push(case());
        } else if wrong {
            self.false_hits.push(case());
        }
    }

    /// Returns `true` if no verdict outside the band is wrong or missing, and no deep separation is
    /// certified.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.false_hits.is_empty()
            && self.misses.is_empty()
            && self.undecided.is_empty()
            && self.certified_wrongly.is_empty()
    }

    /// Returns `true` if enough of the clear separations are certified.
    #[must_use]
    pub fn is_certified_enough(&self) -> bool {
        let Share { all, certified } = self.clear;
        crate::sample::count(certified) >= CERTIFIED_SHARE * crate::sample::count(all)
    }
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |f: &mut fmt::Formatter<'_>, what: &str, cases: &[Case]| {
            writeln!(f, "  {what}: {}", cases.len())?;
            (cases.iter()).try_for_each(|case| {
                writeln!(f, "    #{} at {:+.2} r: {}", case.index, case.gap, case.answer)
            })
        };
        writeln!(f, "outside the band: {}", self.outside)?;
        list(f, "false hits", &self.false_hits)?;
        list(f, "misses", &self.misses)?;
        list(f, "undecided", &self.undecided)?;
        let (band, wrong, undecided) = (self.band, self.band_wrong, self.band_undecided);
        writeln!(f, "inside the band: {band}, wrong {wrong}, undecided {undecided}")?;
        let [hit, hit_estimated, apart, apart_estimated, undecided] = self.verdicts;
        writeln!(
            f,
            "intersecting: {hit} certified, {hit_estimated} estimated; separated: {apart} certified, \
             {apart_estimated} estimated; undecided: {undecided}"
        )?;
        let (clear, near) = (self.clear, self.near);
        writeln!(
            f,
            "separations certified: {} of {} from 6 r on, {} of {} from 3 r on",
            clear.certified, clear.all, near.certified, near.all
        )?;
        list(f, "certified apart but deeper than 0.3 r", &self.certified_wrongly)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nearmiss::Reason;
    use nearmiss_testdata::arbitrary::{CloudKind, cloud};
    use nearmiss_testdata::shapes::scorer_radius;

    #[test]
    fn radius_is_that_of_the_naive_twin() {
        for kind in [CloudKind::Random, CloudKind::Clustered, CloudKind::Duplicates, CloudKind::EqualX] {
            let points = cloud(kind, 500, 3);
            let cloud = PointCloud::from_positions(&points).unwrap();
            let stored: Vec<[f64; 3]> = (0..cloud.len()).map(|i| cloud.point(i)).collect();
            let r = radius(&cloud).unwrap();
            assert!((r / scorer_radius(&stored) - 1.0).abs() < 1e-9, "{kind:?}");
        }
    }

    #[test]
    fn cases_are_counted_where_they_belong() {
        let pose = Pose::IDENTITY;
        let question = |gap: f64| Question { a: pose, b: pose, truth: gap < 0.0, gap };
        let apart = |evidence| Verdict::Separated { gap: 0.0, evidence };
        let mut score = Score::default();
        score.count(0, &question(7.0), 1.0, &apart(Evidence::Certified));
        score.count(1, &question(0.9), 1.0, &Verdict::Undecided(Reason::Ambiguous));
        assert!(score.is_clean() && score.is_certified_enough());
        score.count(2, &question(-1.1), 1.0, &apart(Evidence::Estimated));
        score.count(3, &question(1.1), 1.0, &Verdict::Undecided(Reason::Undersampled));
        score.count(4, &question(-0.4), 1.0, &apart(Evidence::Certified));
        score.count(5, &question(-0.2), 1.0, &apart(Evidence::Certified));
        score.count(6, &question(9.0), 1.0, &apart(Evidence::Estimated));
        let indices = |cases: &[Case]| cases.iter().map(|c| c.index).collect::<Vec<_>>();
        assert_eq!(indices(&score.misses), [2]);
        assert_eq!(indices(&score.undecided), [3]);
        assert_eq!(indices(&score.certified_wrongly), [4]);
        assert_eq!((score.outside, score.band, score.band_wrong, score.band_undecided), (4, 3, 2, 1));
        assert_eq!(score.clear, Share { all: 2, certified: 1 });
        assert!(!score.is_clean() && !score.is_certified_enough());
    }
}
