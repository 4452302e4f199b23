//! Where a sliding scan first touches another: by the least distance of their points, found without
//! `collide`.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::geometry::NodeId;
use nearmiss::{Pose, Scan};

/// How many balls a descent may have open: one sibling a level, and no tree of 2³² points is deeper.
const ROOM: usize = 64;

/// Bisections of the last step: enough for a thousandth of it.
const HALVINGS: u32 = 10;

/// One scan on its way to another.
#[derive(Debug)]
pub(crate) struct Approach<'a> {
    /// a's points, in its stored frame.
    tree: Option<ImmutableKdTree<f32, 3>>,
    b: &'a Scan,
    /// A ball about the points of each node of b, in its stored frame.
    balls: Vec<([f64; 3], f64)>,
    /// World → a's stored frame.
    to_a: Pose,
    /// Least point distance at which they touch, in the world.
    touch: f64,
    /// Least step.
    step: f64,
    /// Distance of the centres from which on the scans cannot touch.
    far: f64,
}

/// The stored frame of a scan in the frame of its input.
fn stored(scan: &Scan) -> Pose {
    Pose::IDENTITY.with_scale(scan.frame().scale).with_translation(scan.frame().origin)
}

impl<'a> Approach<'a> {
    /// `base` is a's pose; touching means a least point distance of `touch`, and `step` is a length that does
    /// not matter.
    pub(super) fn new([a, b]: [&'a Scan; 2], base: &Pose, touch: f64, step: f64, far: f64) -> Self {
        Self {
            // Only points that are not finite are refused, and a scan has none.
            tree: ImmutableKdTree::new_from_slice(a.positions()).ok(),
            b,
            balls: b.topology().ids().map(|id| ball(&b.positions()[b.topology().points(id)])).collect(),
            to_a: base.after(&stored(a)).inverse(),
            touch,
            step,
            far,
        }
    }

    /// The distance at which b, on its way in, first touches a; none if it slides through to distance 0.
    /// `pose` is b's pose at a distance, along a straight line.
    ///
    /// The least point distance g changes by no more than the shift, so steps of g − touch never skip a
    /// touch. The last step is bisected.
    pub(super) fn first_touch(&self, pose: impl Fn(f64) -> Pose) -> Option<f64> {
        let apart = |d: f64| self.least_distance(&pose(d)) - self.touch;
        let mut far = self.far;
        let mut gap = apart(far);
        while gap > 0.0 {
            let near = far - gap.max(self.step);
            if near < 0.0 {
                return None;
            }
            gap = apart(near);
            if gap > 0.0 {
                far = near;
                continue;
            }
            let (mut out, mut touching) = (far, near);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (out + touching);
                if apart(middle) > 0.0 { out = middle } else { touching = middle }
            }
            return Some(out);
        }
        None
    }

    /// The least distance of a point of b in `pose` to a point of a, in the world; what is beyond doubt
    /// greater than the least so far is left out.
    fn least_distance(&self, pose: &Pose) -> f64 {
        let Some(tree) = &self.tree else { return f64::INFINITY };
        let motion = self.to_a.after(pose).after(&stored(self.b));
        #[expect(clippy::cast_possible_truncation, reason = "rounding is far below a spacing")]
        let nearest = |p: [f64; 3]| {
            let query = motion.apply(p).map(|c| c as f32);
            f64::from(tree.query(&query).nearest_one::<SquaredEuclidean<f32>>().execute().distance).sqrt()
        };
        let bound = |id: NodeId| {
            let (centre, radius) = self.balls[id.index()];
            nearest(centre) - radius * motion.scale()
        };
        let topology = self.b.topology();
        let mut best = f64::INFINITY;
        let mut stack = [(0.0, NodeId::ROOT); ROOM];
        stack[0] = (bound(NodeId::ROOT), NodeId::ROOT);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (low, id) = stack[top];
            if low >= best {
                continue;
            }
            if topology.is_leaf(id) {
                let points = &self.b.positions()[topology.points(id)];
                best = points.iter().map(|p| nearest(p.map(f64::from))).fold(best, f64::min);
                continue;
            }
            let bottom = top;
            for child in topology.children(id).iter() {
                stack[top] = (bound(child), child);
                top += 1;
            }
            // The nearest one last, to be looked at first.
            stack[bottom..top].sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        }
        best / self.to_a.scale()
    }
}

/// A ball about `points`.
fn ball(points: &[[f32; 3]]) -> ([f64; 3], f64) {
    let points = || points.iter().map(|p| p.map(f64::from));
    let centre = nearmiss::Aabb::of(points()).centre();
    let distance = |p: [f64; 3]| (0..3).map(|k| (p[k] - centre[k]).powi(2)).sum::<f64>().sqrt();
    (centre, points().map(distance).fold(0.0, f64::max))
}
