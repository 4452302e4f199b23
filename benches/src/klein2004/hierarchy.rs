//! Table 1 and Fig. 8: what hierarchies consist of, and how long it takes to build them.

use std::hint::black_box;
use std::time::Duration;

use nearmiss::{BuildOptions, PointCloud, Scan};

use crate::Failure;
use crate::clock::processor_time;
use crate::sample::count;

/// What a hierarchy consists of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Makeup {
    /// Cloud points.
    pub points: usize,
    /// Sample points of all inner nodes together.
    pub samples: usize,
    /// Nodes, leaves included.
    pub nodes: usize,
    /// Average depth of a node, the root's being 0.
    pub depth: f64,
    /// Bytes of the file for each point.
    pub bytes_a_point: f64,
    /// Bytes that nodes take, for each.
    pub bytes_a_node: f64,
}

impl Makeup {
    /// Of a prepared scan.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn of(scan: &Scan) -> Result<Self, Failure> {
        let (slices, nodes) = (scan.slices(), scan.nodes());
        let mut depths = vec![0_u32; nodes.len()];
        for (id, node) in nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
            // Parents come before their children.
            for child in [id + 1, node.right as usize] {
                depths[child] = depths[id] + 1;
            }
        }
        let inner = (0..nodes.len()).filter(|&id| !nodes[id].is_leaf());
        let bytes = usize::try_from(scan.write_to(std::io::sink())?)?;
        Ok(Self {
            points: scan.len(),
            samples: inner.map(|id| slices.samples(id).len()).sum(),
            nodes: nodes.len(),
            depth: depths.iter().map(|&d| f64::from(d)).sum::<f64>() / count(nodes.len()),
            bytes_a_point: count(bytes) / count(scan.len()),
            bytes_a_node: count(scan.bytes_of_nodes()) / count(nodes.len()),
        })
    }
}

/// Builds go on until they have taken so long, so that a hundredth of a second is little.
const LONG_ENOUGH: Duration = Duration::from_millis(500);

/// Seconds of processor time that a build takes, on one thread.
///
/// # Errors
/// When it cannot be built.
pub fn build_seconds(cloud: &PointCloud) -> Result<f64, Failure> {
    let options = BuildOptions::default().with_threads(1);
    let (start, mut builds) = (processor_time(), 0);
    loop {
        black_box(Scan::build(cloud, &options)?);
        builds += 1;
        let spent = processor_time().saturating_sub(start);
        if spent >= LONG_ENOUGH {
            return Ok(spent.as_secs_f64() / f64::from(builds));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::Object;

    #[test]
    fn a_hierarchy_is_counted_as_it_is() {
        let scan = Scan::build(&Object::read("dragon-5k").unwrap().cloud, &BuildOptions::default()).unwrap();
        let makeup = Makeup::of(&scan).unwrap();
        let leaves = scan.len().div_ceil(16);
        assert_eq!((makeup.points, makeup.nodes), (5205, 2 * leaves - 1));
        // Half of the nodes of a balanced tree of 326 leaves are 8 to 9 deep, a quarter one less, and so on.
        assert!((6.5..8.5).contains(&makeup.depth), "{makeup:?}");
        assert!(makeup.samples <= 16 * (leaves - 1) && makeup.samples > 8 * (leaves - 1), "{makeup:?}");
        assert!(makeup.bytes_a_node > 88.0, "{makeup:?}");
    }
}
