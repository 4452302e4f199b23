//! Enclosures: volumes that provably contain the surface.
//!
//! A surface point belongs to the leaf of its nearest cloud point p. Here each p gets a cell, a cylinder about
//! its normal that contains every surface point nearest to p; the enclosure of a node is the least box, along
//! the axes of its other box, about the cells of its points. docs/theory/certificates.md has the argument step
//! by step. It rests on three facts about a surface point x and the set J of the points whose horizon reaches x:
//!
//! 1. a(x) is in the hull of J and ‖x − a(x)‖ ≤ 0.56 h(x), so x is in the hull of J grown by 0.56 of J's greatest h;
//! 2. p is not further from x than any point of J is, and that is less than its horizon: J is among the points
//!    within twice their horizon of p;
//! 3. x is on p's side of the plane half-way between p and any other point.
//!
//! The paper's claim that x is in the hull itself (Klein & Zachmann 2004, §4.2) does not hold (docs/theory).

use nearmiss_surface::{BORDER, SurfacePlan};

use crate::boxes::{OrientedBox, dot, sub};
use crate::surfels::{THICKNESS, cross, tangents};
use crate::topology::Node;

/// Where the surface points nearest to a cloud point can be: a cylinder about the point's normal.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Cell {
    /// Radius.
    across: f32,
    /// Least (not positive) and greatest (not negative) height along the normal.
    low: f32,
    high: f32,
}

/// Sectors of the tangent plane in which a cell is bounded one by one.
const SECTORS: usize = 16;

/// Unit vectors between the sectors, 22.5 degrees apart.
const RAYS: [[f32; SECTORS]; 2] = {
    const A: f32 = 0.923_879_5;
    const B: f32 = 0.707_106_77;
    const C: f32 = 0.382_683_43;
    [
        [1.0, A, B, C, 0.0, -C, -B, -A, -1.0, -A, -B, -C, 0.0, C, B, A],
        [0.0, C, B, A, 1.0, A, B, C, 0.0, -C, -B, -A, -1.0, -A, -B, -C],
    ]
};

/// Neighbours further than this many local radii bound no sector that nearer ones leave open, but at holes;
/// what is missed there makes a cell wider, never wrong.
const NEIGHBOURS: f32 = 2.5;

/// A sector as open as this, in local radii, is at a border: the hull may bound it better.
const OPEN: f32 = 1.25;

/// Each of height, width and reach bounds the others.
const ROUNDS: usize = 3;

/// What single precision may cost here, relatively: some hundred roundings in differences of nearby numbers.
const GROWN: f32 = 1.0 + 1e-4;

/// The points within twice their horizon of some point of a leaf, one array a coordinate, with what is worked out
/// for one point of the leaf.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surroundings {
    points: Vec<([f32; 3], f32)>,
    /// Distance from the point less the horizon: x must be that far from the point to be reached.
    away: Vec<f32>,
    height: Vec<f32>,
}

/// The least and greatest height of the points that may reach a cell, and their greatest horizon.
#[derive(Clone, Copy)]
struct Reaching {
    low: f32,
    high: f32,
    horizon: f32,
}

impl Surroundings {
    pub(crate) fn clear(&mut self) {
        self.points.clear();
    }

    /// Adds a point and its horizon.
    #[inline]
    pub(crate) fn push(&mut self, p: [f32; 3], horizon: f32) {
        self.points.push((p, horizon * GROWN));
    }

    /// The cell of the point `p` with this normal and local sampling radius, not less than the disc about it.
    pub(crate) fn cell(
        &mut self,
        plan: &SurfacePlan,
        p: [f32; 3],
        normal: [f32; 3],
        radius: f32,
        disc: f32,
    ) -> Cell {
        self.measure(p, normal);
        let border = border(plan);
        // Fact 2.
        let mut reach = 0.5 * self.near_horizon();
        let mut reaching = self.reaching(reach);
        let mut across = reach;
        let mut heights = [-reach, reach];
        for _ in 0..ROUNDS {
            let margin = border * reaching.horizon;
            heights[0] = heights[0].max(reaching.low - margin);
            heights[1] = heights[1].min(reaching.high + margin);
            across = across.min(self.across(p, normal, radius, heights, reach, margin));
            heights = self.heights(p, heights, across);
            reach = reach.min(length(across, heights));
            reaching = self.reaching(reach);
        }
        Cell {
            across: across.max(disc * (1.0 + THICKNESS)) * GROWN,
            low: heights[0].min(-disc * THICKNESS) * GROWN,
            high: heights[1].max(disc * THICKNESS) * GROWN,
        }
    }

    /// Distances and heights of all points, and the bounds of those within twice their horizon.
    fn measure(&mut self, p: [f32; 3], normal: [f32; 3]) {
        self.away.clear();
        self.height.clear();
        for &(q, horizon) in &self.points {
            let d = sub(q, p);
            let (height, distance) = (dot(d, normal), dot(d, d).sqrt());
            self.away.push(distance - horizon);
            self.height.push(height);
        }
    }

    /// The greatest horizon of the points whose horizon reaches this one.
    fn near_horizon(&self) -> f32 {
        let horizons = self.points.iter().zip(&self.away).filter(|(_, away)| **away < 0.0);
        horizons.map(|((_, horizon), _)| *horizon).fold(0.0, f32::max)
    }

    /// The bounds of the points that reach some place within `reach` of the point.
    fn reaching(&self, reach: f32) -> Reaching {
        let mut all = Reaching { low: 0.0, high: 0.0, horizon: 0.0 };
        for ((&away, &height), (_, horizon)) in self.away.iter().zip(&self.height).zip(&self.points) {
            if away < reach {
                all.include(height, *horizon);
            }
        }
        all
    }

    /// How far from the point's axis a surface point can be whose height is between `heights`.
    fn across(
        &self,
        p: [f32; 3],
        normal: [f32; 3],
        radius: f32,
        heights: [f32; 2],
        reach: f32,
        margin: f32,
    ) -> f32 {
        let (u, v) = tangents(normal);
        // Per sector the greatest reciprocal of a bound.
        let mut closed = [0.0_f32; SECTORS];
        let near = NEIGHBOURS * radius;
        for ((&(q, horizon), &away), &height) in self.points.iter().zip(&self.away).zip(&self.height) {
            let distance = away + horizon;
            if distance > near || distance <= 0.0 {
                continue;
            }
            // Fact 3: t·q ≤ ‖q‖²/2 − z·height for the part t of x − p across the normal and any height z.
            let d = sub(q, p);
            let c = 0.5 * dot(d, d) + (-heights[0] * height).max(-heights[1] * height);
            let (x, y) = (dot(d, u) / c, dot(d, v) / c);
            let mut side = [0.0_f32; SECTORS];
            for k in 0..SECTORS {
                side[k] = x * RAYS[0][k] + y * RAYS[1][k];
            }
            // Between two rays the bound is weaker than at neither only if it holds at both.
            for k in 0..SECTORS {
                let least = side[k].min(side[(k + 1) % SECTORS]);
                closed[k] = closed[k].max(least);
            }
        }
        let mut across = 0.0_f32;
        for k in 0..SECTORS {
            let mut bound = 1.0 / closed[k];
            if bound > OPEN * radius {
                bound = bound.min(self.support(p, (u, v), k, reach) + margin);
            }
            across = across.max(bound);
        }
        across
    }

    /// Fact 3 along the normal: the least and greatest height of a surface point within `across` of the axis.
    fn heights(&self, p: [f32; 3], [mut low, mut high]: [f32; 2], across: f32) -> [f32; 2] {
        for (&(q, _), &height) in self.points.iter().zip(&self.height) {
            let d = sub(q, p);
            let d_sq = dot(d, d);
            let c = 0.5 * d_sq + across * (d_sq - height * height).max(0.0).sqrt();
            if height > 0.0 {
                high = high.min(c / height);
            } else if height < 0.0 {
                low = low.max(c / height);
            }
        }
        [low, high]
    }

    /// Fact 1 for the sector `k`: how far the hull of the points that reach goes along its rays, at most.
    fn support(&self, p: [f32; 3], (u, v): ([f32; 3], [f32; 3]), k: usize, reach: f32) -> f32 {
        let ray = |k: usize| {
            let (x, y) = (RAYS[0][k % SECTORS], RAYS[1][k % SECTORS]);
            [0, 1, 2].map(|i| x * u[i] + y * v[i])
        };
        let (first, last) = (ray(k), ray(k + 1));
        // A direction of the sector is a combination of its rays with coefficients that sum to at most 1.02.
        let mut most = 0.0_f32;
        for (&(q, _), &away) in self.points.iter().zip(&self.away) {
            if away < reach {
                let d = sub(q, p);
                most = most.max(dot(d, first)).max(dot(d, last));
            }
        }
        1.02 * most
    }
}

impl Reaching {
    #[inline]
    fn include(&mut self, height: f32, horizon: f32) {
        self.low = self.low.min(height);
        self.high = self.high.max(height);
        self.horizon = self.horizon.max(horizon);
    }
}

/// 0.56 h over the horizon, and a little more for the rounding of a(x).
fn border(plan: &SurfacePlan) -> f32 {
    #[expect(clippy::cast_possible_truncation, reason = "a constant")]
    let border = BORDER as f32;
    border * GROWN * plan.bandwidth(1.0) / plan.horizon(1.0)
}

fn length(across: f32, [low, high]: [f32; 2]) -> f32 {
    let height = high.max(-low);
    (across * across + height * height).sqrt()
}

/// The least box along the axes of `about` that contains the cells of the node's points.
pub(crate) fn box_of_cells(
    node: &Node,
    about: &OrientedBox,
    positions: &[[f32; 3]],
    normals: &[[f32; 3]],
    cells: &[Cell],
) -> OrientedBox {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for i in node.points() {
        let cell = &cells[i];
        for k in 0..3 {
            let axis = about.axes[k];
            let c = dot(axis, positions[i]);
            let cosine = dot(axis, normals[i]);
            let spread = cross(axis, normals[i]);
            let spread = cell.across * dot(spread, spread).sqrt();
            let (a, b) = (cosine * cell.low, cosine * cell.high);
            low[k] = low[k].min(c - spread + a.min(b));
            high[k] = high[k].max(c + spread + a.max(b));
        }
    }
    OrientedBox::spanned(about.axes, low, high, about.reach)
}
