//! First contact of a sliding scan with another one, found by the smallest distance of their
//! points, without `collide`.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::geometry::NodeId;
use nearmiss::{Pose, Scan};

/// The capacity of the stack of a descent: one sibling per level, and no tree of 2³² points is
/// deeper.
const ROOM: usize = 64;

/// The number of bisections of the last step, enough for a thousandth of its length.
const HALVINGS: u32 = 10;

/// A scan that moves towards another one.
#[derive(Debug)]
pub(crate) struct Approach<'a> {
    /// The points of a, in its stored frame.
    tree: Option<ImmutableKdTree<f32, 3>>,
    b: &'a Scan,
    /// A bounding ball of the points of each node of b, in its stored frame.
    balls: Vec<([f64; 3], f64)>,
    /// The transform from the world to a's stored frame.
    to_a: Pose,
    /// The smallest point distance at which the scans touch, in world units.
    touch: f64,
    /// The smallest step.
    step: f64,
    /// The distance of the centres beyond which the scans cannot touch.
    far: f64,
}

/// Returns the transform from the stored frame of a scan to the frame of its input.
fn stored(scan: &Scan) -> Pose {
    Pose::IDENTITY.with_scale(scan.frame().scale).with_translation(scan.frame().origin)
}

impl<'a> Approach<'a> {
    /// Creates an approach. `base` is the pose of a. The scans touch at a smallest point distance
    /// of `touch`. `step` is a negligible length.
    pub(super) fn new([a, b]: [&'a Scan; 2], base: &Pose, touch: f64, step: f64, far: f64) -> Self {
        Self {
            // This fails only for points that are not finite, and a scan has none.
            tree: ImmutableKdTree::new_from_slice(a.positions()).ok(),
            b,
            balls: b.topology().ids().map(|id| ball(&b.positions()[b.topology().points(id)])).collect(),
            to_a: base.after(&stored(a)).inverse(),
            touch,
            step,
            far,
        }
    }

    /// Returns the distance at which b first touches a on its way in, or `None` if it reaches
    /// distance 0 without contact. `pose` returns the pose of b at a distance, along a straight
    /// line.
    ///
    /// The smallest point distance g changes by no more than the shift, so steps of g − touch never
    /// skip a contact. The last step is bisected.
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

    /// Returns the smallest distance of a point of b in `pose` to a point of a, in world units.
    /// Nodes of b that cannot contain it are pruned.
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
            // The nearest child comes last, so that it is visited first.
            stack[bottom..top].sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        }
        best / self.to_a.scale()
    }
}

/// Returns a bounding ball of `points`: its centre and radius.
fn ball(points: &[[f32; 3]]) -> ([f64; 3], f64) {
    let points = || points.iter().map(|p| p.map(f64::from));
    let centre = nearmiss::Aabb::of(points()).centre();
    let distance = |p: [f64; 3]| (0..3).map(|k| (p[k] - centre[k]).powi(2)).sum::<f64>().sqrt();
    (centre, points().map(distance).fold(0.0, f64::max))
}
