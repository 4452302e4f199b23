//! The likelihood of a contact when a budget ends the search.
//!
//! It is estimated from three properties of the node pairs that are still open:
//!
//! - the overlap of the two boxes, as a share s: 1 for a common centre, 0 where they just touch;
//! - the amount of surface in the larger box. An object of width w at a random position in a volume
//!   with surface density ρ meets ρ w sheets on average, so about m = Σ s ρ w sheets are met. Boxes
//!   of a room are mostly empty, those of an object are not;
//! - the ratio of the sizes of the two boxes. If the sizes differ much, s says little.
//!
//! The likelihood is a logistic function of s, ln m and the logarithm of that ratio. Its
//! coefficients were fitted to seven scans with an object in them and to four objects against
//! themselves, all with equal weight. The poses were near contact and in sweeps, the budgets 1 to
//! 256 node pairs (docs/results; `calibration` of the benches repeats the fit). In leave-one-out
//! validation over the scans, the fit beats every constant.

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{MeshView, NodePair, OrientedBox, Relative, ScanArrays};

use crate::pair::scan_pair::ScanPair;

/// The number of open pairs that are examined, those that would be split next.
const LOOKED_AT: usize = 16;

/// Area of a sheet per point, in squares of the local radius: seven points lie within that radius.
const AREA_A_POINT: f64 = 0.5;

/// The range of m; values beyond it carry no further information.
const SHEETS: [f64; 2] = [1e-6, 1e3];

/// The evidence for a contact that one node pair gives.
struct Hint {
    /// The overlap s of the boxes.
    share: f64,
    /// The expected number of sheets met.
    sheets: f64,
    /// The absolute logarithm of the ratio of the boxes' sizes.
    ratio: f64,
}

/// The size of a node's box and the area of the surface in it.
struct Content {
    /// The sum of the half edge lengths.
    size: f64,
    volume: f64,
    area: f64,
}

impl Content {
    /// The content of a node, with lengths multiplied by `scale`.
    fn of(scan: &ScanArrays<'_>, id: NodeId, scale: f64) -> Self {
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

impl Content {
    /// The content of a node of a mesh, with lengths multiplied by `scale`. The area of the triangles
    /// is estimated by half the surface of the box: exact for a flat patch, and half as much as a
    /// cube has.
    fn of_mesh(mesh: &MeshView<'_>, id: NodeId, scale: f64) -> Self {
        let half = mesh.tree.bounds(id).half.map(|edge| f64::from(edge) * scale);
        Self {
            size: half.iter().sum(),
            volume: 8.0 * half.iter().product::<f64>(),
            area: 4.0 * (half[0] * half[1] + half[1] * half[2] + half[2] * half[0]),
        }
    }
}

impl Hint {
    fn of(pair: &ScanPair<'_>, reach: f32, nodes: NodePair) -> Self {
        let (bounds_a, bounds_b) = (pair.a.tree.bounds(nodes.a), pair.b.tree.bounds(nodes.b));
        let share = pair.relative.overlap(&bounds_a, &bounds_b, reach);
        let a = Content::of(pair.a, nodes.a, 1.0);
        let b = Content::of(pair.b, nodes.b, f64::from(pair.relative.scale()));
        Self::of_contents(share, a, b)
    }

    /// The evidence of boxes with this overlap and these contents.
    fn of_contents(share: f32, a: Content, b: Content) -> Self {
        let ratio = (a.size / b.size).ln().abs();
        let (small, large) = if a.volume < b.volume { (a, b) } else { (b, a) };
        // Boxes that overflow or have no extent carry no information.
        let number = |x: f64| if x.is_finite() { x } else { 0.0 };
        let share = number(f64::from(share)).clamp(0.0, 1.0);
        let sheets = number(share * large.area / large.volume * small.area.sqrt());
        Self { share, sheets, ratio: number(ratio) }
    }
}

/// Estimates the probability that the open pairs contain a contact, or points within `reach`. If no
/// pair is open, estimates it for the pair of the roots.
pub(crate) fn likelihood(pair: &ScanPair<'_>, reach: f32, open: impl Iterator<Item = NodePair>) -> f64 {
    likelihood_by(open, |nodes| Hint::of(pair, reach, nodes))
}

/// The same for a scan and a mesh, with the coefficients that were fitted to scans.
pub(crate) fn likelihood_of_mesh(
    (a, b): (&ScanArrays<'_>, &MeshView<'_>),
    relative: &Relative,
    reach: f32,
    open: impl Iterator<Item = NodePair>,
) -> f64 {
    likelihood_by(open, |nodes| {
        let share = relative.overlap(&a.tree.bounds(nodes.a), &b.tree.bounds(nodes.b), reach);
        let of_mesh = Content::of_mesh(b, nodes.b, f64::from(relative.scale()));
        Hint::of_contents(share, Content::of(a, nodes.a, 1.0), of_mesh)
    })
}

fn likelihood_by(open: impl Iterator<Item = NodePair>, hint: impl Fn(NodePair) -> Hint) -> f64 {
    let mut open = open.take(LOOKED_AT).peekable();
    let roots = open.peek().is_none().then_some(NodePair::ROOTS);
    let (mut best, mut sheets) = (Hint { share: 0.0, sheets: 0.0, ratio: 0.0 }, 0.0);
    for nodes in open.chain(roots) {
        let hint = hint(nodes);
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
