//! What a query asks of a whole scan before it looks at any node.

use bytemuck::bytes_of;
use xxhash_rust::xxh3::Xxh3;

use crate::boxes::OrientedBox;
use crate::build::PointHierarchy;

/// A ball in the stored frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ball {
    /// The middle.
    pub centre: [f64; 3],
    /// Radius.
    pub radius: f64,
}

impl Ball {
    fn about(bounds: &OrientedBox) -> Self {
        Self { centre: bounds.centre.map(f64::from), radius: f64::from(bounds.radius()) }
    }
}

/// What tells a scan from others, and where it is. Made whenever a scan is made or loaded, in O(n); not
/// stored.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outline {
    /// A hash of all points, their frame and their discs, and of what the tree is made by.
    pub identity: u64,
    /// About the surface.
    pub surface: Ball,
    /// About the obstacle.
    pub obstacle: Ball,
    /// About the points with their discs.
    pub discs: Ball,
}

impl Outline {
    pub(crate) fn of(scan: &PointHierarchy) -> Self {
        let slices = scan.slices();
        let mut hash = Xxh3::new();
        let frame = scan.frame();
        hash.update(bytes_of(&[frame.origin[0], frame.origin[1], frame.origin[2], frame.scale]));
        let numbers = [scan.leaf_size(), scan.samples_a_node, scan.dense];
        hash.update(bytes_of(&numbers));
        hash.update(bytes_of(&[slices.sampling_radius, slices.reach]));
        hash.update(bytemuck::cast_slice(slices.positions));
        hash.update(bytemuck::cast_slice(slices.discs));
        Self {
            identity: hash.digest(),
            surface: Ball::about(&slices.enclosure(0)),
            obstacle: Ball::about(&slices.obstacle_enclosure(0)),
            discs: Ball::about(&slices.boxes[0]),
        }
    }
}
