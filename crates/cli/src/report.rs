//! Prepared scans, as JSON and as text.

use nearmiss::graph::ClosePairs;
use nearmiss::hierarchy::Topology;
use nearmiss::{Metric, PointKind, Scan, SurfaceGraph};
use serde::Serialize;

use crate::digits::{bytes, count, counts, percent, place, short};
use crate::filters::Filtered;
use crate::health::Health;

/// The description of a prepared scan.
#[derive(Debug, Serialize)]
pub(crate) struct ScanReport {
    points: usize,
    dropped: DroppedReport,
    bounds: [[f64; 3]; 2],
    /// The metric of the kernel that the scan was prepared for.
    kernel: Metric,
    sampling_radius: f64,
    /// The widest gap that is bridged, and the upper limit of local radii.
    reach: f64,
    /// The bandwidth at the median local radius.
    bandwidth: f64,
    /// The support radius at the median local radius.
    horizon: f64,
    support_min: u32,
    nodes: usize,
    leaves: usize,
    depth_mean: f64,
    bytes: u64,
    /// Bytes of the nodes, without those of the points, per node.
    bytes_per_node: f64,
    usable: f64,
    kinds: KindsReport,
    pub(crate) health: Health,
    /// The description of the graph, if there is one.
    graph: Option<GraphReport>,
}

/// The description of a graph.
#[derive(Debug, Serialize)]
struct GraphReport {
    edges: usize,
    virtual_edges: usize,
    components: usize,
    close_pairs: usize,
    border: f64,
    /// Share of the points whose normals are oriented with certainty.
    oriented: f64,
}

/// The least confidence with which the orientation of a normal counts as certain.
const CERTAIN: u8 = 128;

impl GraphReport {
    #[expect(clippy::cast_precision_loss, reason = "statistics")]
    fn new(graph: &SurfaceGraph) -> Self {
        let counts = graph.counts();
        let certain = graph.confidence().iter().filter(|&&confidence| confidence >= CERTAIN).count();
        let share = |count: usize| count as f64 / counts.points as f64;
        Self {
            edges: counts.edges,
            virtual_edges: counts.virtual_edges,
            components: counts.components,
            close_pairs: graph.close_pairs().map_or(0, ClosePairs::pair_count),
            border: share(counts.border),
            oriented: share(certain),
        }
    }
}

#[derive(Debug, Serialize)]
struct DroppedReport {
    not_finite: usize,
    duplicate: usize,
    /// Points removed by all filters together, if any were applied.
    #[serde(skip_serializing_if = "Option::is_none")]
    filtered: Option<usize>,
    /// Points removed by each filter; of `preprocess` only.
    #[serde(flatten)]
    by_filter: Filtered,
}

/// Shares of the points of each kind, which add up to 1.
#[derive(Debug, Serialize)]
struct KindsReport {
    sheet: f64,
    edge: f64,
    noisy: f64,
    line: f64,
    stray: f64,
    sparse: f64,
}

impl KindsReport {
    fn new(scan: &Scan) -> Self {
        let [sheet, edge, noisy, line, stray, sparse] = PointKind::ALL.map(|kind| scan.share(kind));
        Self { sheet, edge, noisy, line, stray, sparse }
    }
}

impl ScanReport {
    /// Creates the description of a scan whose file has `bytes` bytes.
    #[expect(clippy::cast_precision_loss, reason = "statistics")]
    pub(crate) fn new(scan: &Scan, bytes: u64) -> Self {
        let scale = scan.frame().scale;
        let median = median(scan.radii());
        let nodes = scan.topology().len();
        let (leaves, depth_mean) = leaves(scan.topology());
        Self {
            points: scan.len(),
            dropped: DroppedReport {
                not_finite: scan.dropped().not_finite,
                duplicate: scan.dropped().duplicate,
                filtered: Some(scan.dropped().filtered).filter(|&filtered| filtered > 0),
                by_filter: Filtered::default(),
            },
            bounds: [scan.bounds().min, scan.bounds().max],
            kernel: scan.metric(),
            sampling_radius: scan.sampling_radius(),
            reach: scan.reach(),
            bandwidth: f64::from(scan.plan().bandwidth(median)) * scale,
            horizon: f64::from(scan.plan().support_radius(median)) * scale,
            support_min: scan.plan().options().support_min,
            nodes,
            leaves,
            depth_mean,
            bytes,
            bytes_per_node: scan.bytes_of_nodes() as f64 / nodes as f64,
            usable: scan.usable(),
            kinds: KindsReport::new(scan),
            health: Health::new(scan),
            graph: scan.graph().map(GraphReport::new),
        }
    }

    /// Adds the numbers of points that filters removed.
    pub(crate) fn with_filtered(mut self, filtered: Filtered) -> Self {
        self.dropped.by_filter = filtered;
        self
    }

    /// Returns the description as lines of text.
    pub(crate) fn lines(&self) -> Vec<String> {
        let unit = self.sampling_radius / 100.0;
        let [min, max] = self.bounds.map(|p| place(p, unit));
        let DroppedReport { not_finite, duplicate, filtered, .. } = self.dropped;
        let dropped = counts([(duplicate as u64, "duplicate"), (not_finite as u64, "non-finite point")]);
        let dropped =
            Some(dropped).filter(|dropped| !dropped.is_empty()).map(|dropped| format!("{dropped} dropped"));
        let filtered = filtered.map(|n| format!("{n} removed by filters"));
        let without: Vec<String> = dropped.into_iter().chain(filtered).collect();
        let without = if without.is_empty() { String::new() } else { format!(" ({})", without.join("; ")) };
        vec![
            format!("points     {}{without}", self.points),
            format!("bounds     {min} to {max}"),
            format!(
                "surface    {} kernel, sampling radius {}, bandwidth {}, support radius {}, minimum support {}",
                self.kernel,
                short(self.sampling_radius),
                short(self.bandwidth),
                short(self.horizon),
                self.support_min
            ),
            hierarchy_line(self.nodes, self.leaves, self.depth_mean),
            self.graph.as_ref().map_or_else(
                || "graph      none".to_owned(),
                |graph| {
                    let parts = counts([
                        (graph.edges as u64, "edge"),
                        (graph.virtual_edges as u64, "virtual edge"),
                        (graph.components as u64, "component"),
                        (graph.close_pairs as u64, "close pair"),
                    ]);
                    format!("graph      {parts}, {} of the normals oriented", percent(graph.oriented))
                },
            ),
            file_line(self.bytes, self.points, "point"),
        ]
    }
}

/// Returns a line of text about a tree.
pub(crate) fn hierarchy_line(nodes: usize, leaves: usize, depth_mean: f64) -> String {
    let [nodes, leaves] = [count(nodes as u64, "node"), count(leaves as u64, "leaf")];
    format!("hierarchy  {nodes}, {leaves}, mean depth {depth_mean:.1}")
}

/// Returns a line of text about a file with so many items.
#[expect(clippy::cast_precision_loss, reason = "statistics")]
pub(crate) fn file_line(length: u64, items: usize, item: &str) -> String {
    format!("file       {}, {:.0} bytes per {item}", bytes(length), length as f64 / items as f64)
}

/// Returns the number of leaves and their mean depth. The root has depth 0.
#[expect(clippy::cast_precision_loss, reason = "statistics")]
pub(crate) fn leaves(topology: &Topology) -> (usize, f64) {
    let depths = depths(topology);
    let of_leaves = &depths[topology.inner()..];
    let sum: u64 = of_leaves.iter().map(|&depth| u64::from(depth)).sum();
    (of_leaves.len(), sum as f64 / of_leaves.len() as f64)
}

/// Returns the depth of each node, at most 32.
pub(crate) fn depths(topology: &Topology) -> Vec<u8> {
    let mut depths = vec![0; topology.len()];
    // Parents come before their children.
    for id in topology.ids().take(topology.inner()) {
        let below = depths[id.index()] + 1;
        for child in topology.children(id).iter() {
            depths[child.index()] = below;
        }
    }
    depths
}

/// Returns the median: the middle value, or the mean of the two in the middle. Copies nothing,
/// because there may be more values than fit into memory twice.
pub(crate) fn median(values: &[f32]) -> f32 {
    let upper = ranked(values, values.len() / 2);
    if values.len() % 2 == 1 { upper } else { 0.5 * (ranked(values, values.len() / 2 - 1) + upper) }
}

/// Returns the value of a rank, counted from 0, by radix selection in two passes of 16 bits.
fn ranked(values: &[f32], rank: usize) -> f32 {
    const SIGN: u32 = 1 << 31;
    // Keys have the order of the values, because the bits of negative values are inverted.
    let key = |value: &f32| {
        let bits = value.to_bits();
        if bits & SIGN == 0 { bits | SIGN } else { !bits }
    };
    let (high, rank) = ranked_half(values.iter().map(|value| key(value) >> 16), rank);
    let of_half = values.iter().map(key).filter(|key| key >> 16 == high);
    let (low, _) = ranked_half(of_half.map(|key| key & 0xffff), rank);
    let key = high << 16 | low;
    f32::from_bits(if key & SIGN == 0 { !key } else { key & !SIGN })
}

/// Returns the number of a rank among numbers below 2¹⁶, and the rank left among the numbers equal
/// to it.
fn ranked_half(halves: impl Iterator<Item = u32>, mut rank: usize) -> (u32, usize) {
    let mut counts = vec![0_usize; 1 << 16];
    halves.for_each(|half| counts[half as usize] += 1);
    for (half, count) in (0..).zip(counts) {
        if rank < count {
            return (half, rank);
        }
        rank -= count;
    }
    (0, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_of_two_halves_is_their_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]).to_bits(), 2.0_f32.to_bits());
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]).to_bits(), 2.5_f32.to_bits());
        let values = [-3.0, 7.5e-8, 1e30, -0.0, 2.0, 2.0, -1e-30, 5.0];
        let mut sorted = values;
        sorted.sort_by(f32::total_cmp);
        for (rank, value) in sorted.iter().enumerate() {
            assert_eq!(ranked(&values, rank).to_bits(), value.to_bits(), "rank {rank}");
        }
    }
}
