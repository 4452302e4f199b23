//! The sampling quality of a scan in numbers.

use nearmiss::PointKind;
use nearmiss::Scan;
use serde::Serialize;

/// Points whose spacing exceeds the median spacing by this factor are sparse.
const UNEVEN: f64 = 4.0;

/// Sparse points are reported if they have at least this share of all points, or of the area.
const MANY: f64 = 0.02;
const LARGE: f64 = 0.1;

/// Fewer surveyed points than this are too few to report holes or sparse points.
const FEW: usize = 4;

/// Seed of the choice of surveyed points.
const SEED: u64 = 0;

/// The sampling quality of a scan. Shares are of all points, lengths in the units of the input.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Health {
    /// Share of the points that count as balls, because they sample no surface.
    pub(crate) balls: f64,
    /// Radius of the largest of these balls; 0 without balls.
    pub(crate) largest_ball: f64,
    /// Estimated share of the points at borders of surfaces.
    pub(crate) border: f64,
    /// Estimated share of the isolated points, near much denser ones or scattered in space.
    pub(crate) outliers: f64,
    /// Points much sparser than the others, if there are enough to matter.
    pub(crate) uneven: Option<Uneven>,
    /// Holes wider than the reach, if any were found.
    pub(crate) holes: Option<Holes>,
    /// Estimated 0.9-quantile of the spacing of the points whose spacing exceeds the reach; 0
    /// without such points.
    pub(crate) beyond_reach: f64,
}

/// Points much sparser than the others. The spacing is the distance to the sixth nearest neighbour.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Uneven {
    pub(crate) share: f64,
    /// Estimated share of the scanned area that these points cover.
    pub(crate) area: f64,
    /// The ratio of their median spacing to that of all points.
    pub(crate) times: f64,
    pub(crate) spacing: f64,
    /// The median spacing of all points.
    pub(crate) median: f64,
}

/// Holes in surfaces, wider than the reach.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Holes {
    /// Share of the points at the rim of a hole.
    pub(crate) share: f64,
    /// Least, median and greatest width.
    pub(crate) widths: [f64; 3],
}

impl Health {
    pub(crate) fn new(scan: &Scan) -> Self {
        let survey = scan.survey(SEED);
        let (scale, arrays) = (scan.frame().scale, scan.arrays());
        let largest = (0..scan.len()).map(|i| arrays.obstacle_ball(i)).fold(0.0, f32::max);
        let beyond: Vec<(f64, f64)> =
            survey.spacings.iter().copied().filter(|&(spacing, _)| spacing > scan.reach()).collect();
        let widths = &survey.holes;
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let holes = (widths.len() >= FEW).then(|| Holes {
            share: widths.len() as f64 * survey.border_weight,
            widths: [widths[0], widths[widths.len() / 2], widths[widths.len() - 1]],
        });
        Self {
            balls: 1.0 - scan.sheet_share(),
            largest_ball: f64::from(largest) * scale,
            border: survey.border,
            outliers: survey.outliers,
            uneven: Uneven::of(&survey.spacings),
            holes,
            beyond_reach: quantile(&beyond, 0.9),
        }
    }
}

impl Uneven {
    /// Creates the statistics from pairs of spacing and weight, in ascending order of spacing.
    fn of(spacings: &[(f64, f64)]) -> Option<Self> {
        let median = quantile(spacings, 0.5);
        let sparse = &spacings[spacings.partition_point(|&(spacing, _)| spacing <= UNEVEN * median)..];
        let spacing = quantile(sparse, 0.5);
        // The area of a point is the square of its spacing, which would be far too large for
        // isolated points.
        let most = UNEVEN * spacing;
        let area = |&(spacing, weight): &(f64, f64)| weight * spacing.min(most).powi(2);
        let whole = spacings.iter().map(area).sum::<f64>().max(f64::MIN_POSITIVE);
        let (share, area) =
            (sparse.iter().map(|s| s.1).sum::<f64>(), sparse.iter().map(area).sum::<f64>() / whole);
        let matters = median > 0.0 && sparse.len() >= FEW && (share >= MANY || area >= LARGE);
        matters.then(|| Self { share, area, times: spacing / median, spacing, median })
    }
}

/// Returns the weighted quantile of pairs of value and weight in ascending order; 0 without values.
fn quantile(values: &[(f64, f64)], share: f64) -> f64 {
    let whole: f64 = values.iter().map(|&(_, weight)| weight).sum();
    let mut sum = 0.0;
    let reached = values.iter().find(|&&(_, weight)| {
        sum += weight;
        sum >= share * whole
    });
    reached.or(values.last()).map_or(0.0, |&(value, _)| value)
}

/// Returns the name of a kind, which is also its field in the JSON output.
pub(crate) const fn kind_name(kind: PointKind) -> &'static str {
    match kind {
        PointKind::Sheet => "sheet",
        PointKind::Edge => "edge",
        PointKind::Line => "line",
        PointKind::Stray => "stray",
        PointKind::Sparse => "sparse",
        _ => "noisy",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_go_by_weight() {
        let values = [(1.0, 0.9), (5.0, 0.05), (9.0, 0.05)];
        assert_eq!([0.5, 0.93, 1.0].map(|share| quantile(&values, share)), [1.0, 5.0, 9.0]);
        assert_eq!(quantile(&[], 0.5).to_bits(), 0.0_f64.to_bits());
    }

    #[test]
    fn few_sparse_points_matter_where_they_cover_much() {
        let even: Vec<(f64, f64)> = (0..100).map(|i| (1.0 + f64::from(i) / 100.0, 0.01)).collect();
        assert!(Uneven::of(&even).is_none());
        let plates = [&[(1.0, 0.9975)][..], &[(20.0, 0.0005); 5]].concat();
        assert!(Uneven::of(&plates[..4]).is_none(), "three points show nothing");
        let uneven = Uneven::of(&plates).unwrap();
        assert!((uneven.area - 0.5).abs() < 0.01 && (uneven.times - 20.0).abs() < 1e-9, "{uneven:?}");
    }
}
