//! What scripts and people are told: the fields of the JSON lines, and sentences.

use nearmiss::{Answer, Evidence, PointKind, Reason, Scan, ScanView, Verdict};
use serde::Serialize;

/// What a prepared scan holds.
#[derive(Debug, Serialize)]
pub(crate) struct ScanReport {
    points: usize,
    dropped: DroppedReport,
    bounds: [[f64; 3]; 2],
    sampling_radius: f64,
    /// The median, as `horizon`.
    bandwidth: f64,
    horizon: f64,
    support_min: u32,
    nodes: usize,
    leaves: usize,
    depth_mean: f64,
    bytes: u64,
    bytes_per_node: f64,
    usable: f64,
    /// None is built yet.
    graph: Option<()>,
}

#[derive(Debug, Serialize)]
struct DroppedReport {
    not_finite: usize,
    duplicate: usize,
}

impl ScanReport {
    /// Of a scan that takes `bytes` in its file.
    #[expect(clippy::cast_precision_loss, reason = "statistics")]
    pub(crate) fn new(scan: &Scan, bytes: u64) -> Self {
        let scale = scan.frame().scale;
        let median = median(scan.radii());
        let nodes = scan.nodes().len();
        let (leaves, depth_mean) = leaves(scan);
        Self {
            points: scan.len(),
            dropped: DroppedReport {
                not_finite: scan.dropped().not_finite,
                duplicate: scan.dropped().duplicate,
            },
            bounds: [scan.bounds().min, scan.bounds().max],
            sampling_radius: scan.sampling_radius(),
            bandwidth: f64::from(scan.plan().bandwidth(median)) * scale,
            horizon: f64::from(scan.plan().horizon(median)) * scale,
            support_min: scan.plan().options().support_min,
            nodes,
            leaves,
            depth_mean,
            bytes,
            bytes_per_node: bytes as f64 / nodes as f64,
            usable: scan.usable(),
            graph: None,
        }
    }

    /// The same for people, some lines.
    pub(crate) fn lines(&self) -> Vec<String> {
        let unit = self.sampling_radius / 100.0;
        let [min, max] = self.bounds.map(|p| place(p, unit));
        let DroppedReport { not_finite, duplicate } = self.dropped;
        vec![
            format!(
                "points     {} ({duplicate} duplicates and {not_finite} not finite dropped)",
                self.points
            ),
            format!("bounds     {min} to {max}"),
            format!(
                "surface    sampling radius {}, bandwidth {}, horizon {}, least support {}",
                short(self.sampling_radius),
                short(self.bandwidth),
                short(self.horizon),
                self.support_min
            ),
            format!(
                "hierarchy  {} nodes, {} leaves, mean depth {:.1}",
                self.nodes, self.leaves, self.depth_mean
            ),
            format!("file       {}, {:.0} bytes a node", bytes(self.bytes), self.bytes_per_node),
        ]
    }
}

/// How well the scan is sampled, and what to do if badly.
pub(crate) fn health(scan: &Scan) -> Vec<String> {
    let share = |kind| scan.share(kind);
    let [lines, ambiguous, isolated] =
        [PointKind::Line, PointKind::Ambiguous, PointKind::Isolated].map(share);
    let percent = |x: f64| format!("{:.0} %", 100.0 * x);
    let spacing = f64::from(median(scan.radii())) * scan.frame().scale;
    let mut said = vec![format!(
        "health     spacing {}; {} of the points usable, {} sampled as lines, {} ambiguous, {} isolated",
        short(spacing),
        percent(scan.usable()),
        percent(lines),
        percent(ambiguous),
        percent(isolated)
    )];
    let mut advise = |what: String| said.push(format!("advice     {what}"));
    let thickened = short_up(0.5 * scan.sampling_radius());
    let more = more_neighbours(scan);
    if lines > 0.1 {
        let wider = more.map_or(String::new(), |k| format!("--radius-neighbours {k}, or "));
        advise(format!(
            "{} of the points lie on lines, as a spinning LiDAR's do: try {wider}`collide --thickened {thickened}`",
            percent(lines)
        ));
    }
    if isolated > 0.05 {
        let wider = more.map_or(String::new(), |k| format!("try --radius-neighbours {k}, or "));
        advise(format!(
            "{} of the points have too few neighbours: {wider}remove outliers first",
            percent(isolated)
        ));
    }
    if ambiguous > 0.2 {
        let h = f64::from(scan.plan().bandwidth(median(scan.radii()))) * scan.frame().scale;
        advise(format!(
            "{} of the points do not look like one sheet (noise, thin walls, foliage): try --bandwidth {}, or \
             `collide --thickened {thickened}`",
            percent(ambiguous),
            short_up(2.0 * h)
        ));
    }
    said
}

/// A larger number of neighbours worth trying.
fn more_neighbours(scan: &Scan) -> Option<u32> {
    let now = scan.radius_neighbours();
    (now < 32).then(|| (2 * now).min(32))
}

/// Number of leaves and their mean depth; the root has depth 0.
#[expect(clippy::cast_precision_loss, reason = "statistics")]
fn leaves(scan: &Scan) -> (usize, f64) {
    let depths = depths(scan);
    let of_leaves = scan.nodes().iter().zip(&depths).filter(|(n, _)| n.is_leaf()).map(|(_, &d)| d);
    let (count, sum) = of_leaves.fold((0_usize, 0_u64), |(c, s), d| (c + 1, s + u64::from(d)));
    (count, sum as f64 / count.max(1) as f64)
}

/// The depth of each node. Parents come before their children.
pub(crate) fn depths(scan: &Scan) -> Vec<u32> {
    let mut depths = vec![0; scan.nodes().len()];
    for (i, node) in scan.nodes().iter().enumerate() {
        if !node.is_leaf() {
            let below = depths[i] + 1;
            for child in [i + 1, node.right as usize] {
                depths[child] = below;
            }
        }
    }
    depths
}

/// The middle value, or the mean of the two in the middle.
fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    let (below, &mut upper, _) = sorted.select_nth_unstable_by(middle, f32::total_cmp);
    if values.len() % 2 == 1 {
        return upper;
    }
    let lower = below.iter().copied().fold(f32::MIN, f32::max);
    0.5 * (lower + upper)
}

/// What `collide` answers.
#[derive(Debug, Serialize)]
pub(crate) struct AnswerReport {
    verdict: &'static str,
    evidence: Option<&'static str>,
    reason: Option<&'static str>,
    witness: Option<[f64; 3]>,
    normal_a: Option<[f64; 3]>,
    normal_b: Option<[f64; 3]>,
    residual: Option<f64>,
    source_a: Option<u32>,
    source_b: Option<u32>,
    gap: Option<f64>,
    distance_estimate: Option<f64>,
    likelihood: Option<f64>,
    evaluations: u64,
    node_pairs: u64,
    leaf_pairs: u64,
    micros: f64,
}

impl AnswerReport {
    pub(crate) fn new(answer: &Answer, micros: f64) -> Self {
        let mut report = Self {
            verdict: "undecided",
            evidence: None,
            reason: None,
            witness: None,
            normal_a: None,
            normal_b: None,
            residual: None,
            source_a: None,
            source_b: None,
            gap: None,
            distance_estimate: None,
            likelihood: None,
            evaluations: answer.statistics.evaluations,
            node_pairs: answer.statistics.node_pairs,
            leaf_pairs: answer.statistics.leaf_pairs,
            micros,
        };
        match answer.verdict {
            Verdict::Intersecting { contact, evidence } => {
                report.verdict = "intersecting";
                report.evidence = Some(word(evidence));
                report.witness = Some(contact.point);
                report.normal_a = contact.normals.map(|n| n[0]);
                report.normal_b = contact.normals.map(|n| n[1]);
                report.residual = Some(contact.residual);
                report.source_a = Some(contact.sources[0].0);
                report.source_b = Some(contact.sources[1].0);
            }
            Verdict::Separated { gap, evidence } => {
                report.verdict = "separated";
                report.evidence = Some(word(evidence));
                report.gap = Some(gap);
            }
            Verdict::Undecided(reason) => {
                report.reason = match reason {
                    Reason::Budget { likelihood } => {
                        report.likelihood = Some(likelihood);
                        Some("budget")
                    }
                    Reason::Undersampled => Some("undersampled"),
                    Reason::Ambiguous => Some("ambiguous"),
                    Reason::Pose => Some("pose"),
                    _ => None,
                };
            }
        }
        report
    }

    /// What it cost, and between which points, for people.
    pub(crate) fn details(&self) -> String {
        let between = match (self.source_a, self.source_b) {
            (Some(a), Some(b)) => format!("between point {a} of a and point {b} of b, counted from 0; "),
            _ => String::new(),
        };
        format!(
            "{between}{} node pairs, {} leaf pairs, {} evaluations, {:.1} µs",
            self.node_pairs, self.leaf_pairs, self.evaluations, self.micros
        )
    }
}

fn word(evidence: Evidence) -> &'static str {
    match evidence {
        Evidence::Certified => "certified",
        Evidence::Estimated => "estimated",
    }
}

/// The answer as a sentence, with as many digits as the sampling carries.
pub(crate) fn sentence(answer: &Answer, a: &ScanView<'_>, b: &ScanView<'_>, thickened: bool) -> String {
    let [ra, rb] = [a, b].map(|v| v.scan().sampling_radius() * world_scale(v));
    let unit = ra.min(rb) / 100.0;
    match answer.verdict {
        Verdict::Intersecting { contact, evidence } => {
            let (at, within) = (place(contact.point, unit), rounded(contact.residual.max(unit), unit));
            format!("They touch at {at}, within {within} ({}).", word(evidence))
        }
        Verdict::Separated { gap, evidence } if gap > 0.0 => {
            // Rounded down: a bound stays one.
            let gap = if gap >= unit { rounded(gap - 0.5 * step(unit), unit) } else { short(gap * 0.995) };
            format!("No contact; at least {gap} apart ({}).", word(evidence))
        }
        Verdict::Separated { evidence, .. } => format!("No contact found ({}).", word(evidence)),
        Verdict::Undecided(reason) => {
            format!("Cannot tell: {}.", doubt(reason, a, b, thickened))
        }
    }
}

/// Why there is no verdict, and what would help.
fn doubt(reason: Reason, a: &ScanView<'_>, b: &ScanView<'_>, thickened: bool) -> String {
    let views = [("a", a), ("b", b)];
    let worse = |share: fn(&ScanView<'_>) -> f64| {
        let [of_a, of_b] = views.map(|(_, v)| share(v));
        if of_b > of_a { ("b", b, of_b) } else { ("a", a, of_a) }
    };
    let radius =
        views.map(|(_, v)| v.scan().sampling_radius() * world_scale(v)).into_iter().fold(0.0, f64::max);
    let instead =
        if thickened { String::new() } else { format!(", or --thickened {}", short_up(0.5 * radius)) };
    match reason {
        Reason::Budget { likelihood } => {
            format!(
                "the budget ran out first, contact has a likelihood of about {likelihood:.2}; try a greater --budget or --work"
            )
        }
        Reason::Undersampled => {
            let lines = |v: &ScanView<'_>| v.scan().share(PointKind::Line);
            let sparse =
                |v: &ScanView<'_>| v.scan().share(PointKind::Line) + v.scan().share(PointKind::Isolated);
            let (name, view, share) = worse(sparse);
            let how = if lines(view) >= 0.5 * share { "sampled as lines" } else { "sampled too sparsely" };
            let now = view.scan().radius_neighbours();
            let wider = if now < 32 {
                format!("preprocess with --radius-neighbours {}", (2 * now).min(32))
            } else {
                "a denser scan".to_owned()
            };
            let percent = 100.0 * share;
            if share < 0.2 {
                return format!(
                    "they come near each other only where points say too little, and {percent:.0} % of {name} is \
                     {how}; try {wider}{instead}"
                );
            }
            format!("{percent:.0} % of {name} is {how}; try {wider}{instead}")
        }
        Reason::Ambiguous => {
            let (name, _, share) = worse(|v| v.scan().share(PointKind::Ambiguous));
            format!(
                "where they meet the points do not look like one sheet, as do {:.0} % of {name}; try preprocess \
                 with a --bandwidth that suits the noise{instead}",
                100.0 * share
            )
        }
        Reason::Pose => "a pose is not finite or makes one object vanish beside the other".to_owned(),
        _ => "for a reason that this program does not know; update it".to_owned(),
    }
}

/// Length in the world of a unit of the scan's input.
pub(crate) fn world_scale(view: &ScanView<'_>) -> f64 {
    view.placed().scale() / view.scan().frame().scale
}

/// A point, to the nearest `unit` or finer.
pub(crate) fn place(p: [f64; 3], unit: f64) -> String {
    let [x, y, z] = p.map(|c| rounded(c, unit));
    format!("({x}, {y}, {z})")
}

/// Fewer digits after the point than this are written out.
const MOST_DECIMALS: i32 = 9;

/// A length to the nearest `unit` or finer.
fn rounded(x: f64, unit: f64) -> String {
    match decimals(unit) {
        Some(decimals) => format!("{x:.decimals$}"),
        None => format!("{x:.6e}"),
    }
}

/// Decimals that show `unit`; none if it is beyond what is pleasant to read.
fn decimals(unit: f64) -> Option<usize> {
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
    let decimals = (-unit.log10()).ceil() as i32;
    if decimals > MOST_DECIMALS { None } else { usize::try_from(decimals.max(0)).ok() }
}

/// The power of ten that [`rounded`] rounds to.
fn step(unit: f64) -> f64 {
    decimals(unit).map_or(0.0, |d| 0.1_f64.powi(i32::try_from(d).unwrap_or(0)))
}

/// Three significant digits.
pub(crate) fn short(x: f64) -> String {
    significant(x, 3)
}

/// Two significant digits, rounded up: a length that is to be enough.
fn short_up(x: f64) -> String {
    significant(x * 1.05, 2)
}

fn significant(x: f64, digits: i32) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    #[expect(clippy::cast_possible_truncation, reason = "between -324 and 308")]
    let magnitude = x.abs().log10().floor() as i32;
    if !(-5..=6).contains(&magnitude) {
        let digits = usize::try_from(digits - 1).unwrap_or(2);
        return format!("{x:.digits$e}");
    }
    let decimals = usize::try_from(digits - 1 - magnitude).unwrap_or(0);
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[expect(clippy::cast_precision_loss, reason = "for people")]
fn bytes(n: u64) -> String {
    match n {
        0..10_000 => format!("{n} bytes"),
        10_000..1_000_000 => format!("{:.1} kB", n as f64 / 1e3),
        _ => format!("{:.1} MB", n as f64 / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_carry_the_digits_that_mean_something() {
        assert_eq!(rounded(0.123_456, 0.001), "0.123");
        assert_eq!(rounded(0.123_456, 0.000_4), "0.1235", "finer than the unit, never coarser");
        assert_eq!(rounded(1234.567, 12.0), "1235");
        assert_eq!(rounded(1.5e-12, 1e-14), "1.500000e-12");
        assert_eq!(
            [short(0.001_234_5), short(1234.5), short(0.5), short(0.0)],
            ["0.00123", "1234", "0.5", "0"]
        );
        assert_eq!([short(1.234e-9), short(5e9)], ["1.23e-9", "5.00e9"]);
        assert_eq!(short_up(0.050_1), "0.053", "enough, not nearest");
    }

    #[test]
    fn a_median_of_two_halves_is_their_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]).to_bits(), 2.0_f32.to_bits());
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]).to_bits(), 2.5_f32.to_bits());
    }
}
