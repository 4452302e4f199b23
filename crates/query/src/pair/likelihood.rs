//! The likelihood of a contact where a budget ends the search.
//!
//! Three things about the pairs of nodes that are still open tell whether they hide a contact:
//!
//! - how much two boxes overlap, as a share s: 1 where they share a centre, 0 where they just touch;
//! - how much surface the greater box holds. A thing of width w anywhere in a volume with the surface density
//!   ρ meets ρ w sheets on average, so m = Σ s ρ w is about how many sheets are met. Boxes of a room are
//!   mostly empty, those of an object are not;
//! - how many times as long one box is as the other. Where their sizes differ much, s says little.
//!
//! The likelihood is a logistic function of s, ln m and the logarithm of that ratio. Its coefficients were
//! fitted to seven scans with an object in them and to four objects against themselves, all of equal weight,
//! near contact and in sweeps, with budgets of 1 to 256 node pairs (docs/results; `calibration` of the
//! benches repeats that). Of each scan in turn the fit to the others beats any constant.

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{NodePair, OrientedBox, Slices};

use crate::pair::scan_pair::ScanPair;

/// Open pairs that are looked at, those next to be split first.
const LOOKED_AT: usize = 16;

/// Area of a sheet for each of its points, in squares of their local radius: seven of them lie within it.
const AREA_A_POINT: f64 = 0.5;

/// The range of m, beyond which more of it says nothing.
const SHEETS: [f64; 2] = [1e-6, 1e3];

/// The evidence of a contact that one pair of nodes gives.
struct Hint {
    /// How much the boxes overlap.
    share: f64,
    /// How many sheets are met.
    sheets: f64,
    /// How many times as long one box is as the other, as a logarithm.
    ratio: f64,
}

/// The size of a node's box, and the area of the surface in it.
struct Content {
    /// The sum of the half edge lengths.
    size: f64,
    volume: f64,
    area: f64,
}

impl Content {
    /// Of a node, in a frame of which the lengths are `scale` times as long.
    fn of(scan: &Slices<'_>, id: NodeId, scale: f64) -> Self {
        let OrientedBox { half, reach, .. } = scan.tree.bounds(id);
        let half = half.map(|edge| f64::from(edge) * scale);
        let radius = f64::from(reach.min(scan.sampling_radius)) * scale;
        #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
        let count = scan.tree.topology().points(id).len() as f64;
        Self {
            size: half.iter().sum(),
            volume: 8.0 * half.iter().product::<f64>(),
            area: AREA_A_POINT * count * radius * radius,
        }
    }
}

impl Hint {
    fn of(pair: &ScanPair<'_>, reach: f32, nodes: NodePair) -> Self {
        let (bounds_a, bounds_b) = (pair.a.tree.bounds(nodes.a), pair.b.tree.bounds(nodes.b));
        let share = pair.relative.overlap(&bounds_a, &bounds_b, reach);
        let a = Content::of(pair.a, nodes.a, 1.0);
        let b = Content::of(pair.b, nodes.b, f64::from(pair.relative.scale()));
        let ratio = (a.size / b.size).ln().abs();
        let (small, large) = if a.volume < b.volume { (a, b) } else { (b, a) };
        // Boxes that overflow, or have no extent, say nothing.
        let number = |x: f64| if x.is_finite() { x } else { 0.0 };
        let share = number(f64::from(share)).clamp(0.0, 1.0);
        let sheets = number(share * large.area / large.volume * small.area.sqrt());
        Self { share, sheets, ratio: number(ratio) }
    }
}

/// The chance that the pairs still open, or all if none was looked at, hide a contact or what is within
/// `reach`.
pub(crate) fn likelihood(pair: &ScanPair<'_>, reach: f32, open: impl Iterator<Item = NodePair>) -> f64 {
    let mut open = open.take(LOOKED_AT).peekable();
    let roots = open.peek().is_none().then_some(NodePair::ROOTS);
    let (mut best, mut sheets) = (Hint { share: 0.0, sheets: 0.0, ratio: 0.0 }, 0.0);
    for nodes in open.chain(roots) {
        let hint = Hint::of(pair, reach, nodes);
        sheets += hint.sheets;
        if hint.share > best.share {
            best = hint;
        }
    }
    let [least, most] = SHEETS;
    let of_sheets = 0.514 * sheets.clamp(least, most).ln();
    let logit = -4.80 + of_sheets + 2.30 * best.ratio + best.share * (11.57 - 4.49 * best.ratio);
    1.0 / (1.0 + (-logit).exp())
}
