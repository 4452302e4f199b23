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
        let (slices, nodes) = (scan.slices(), scan.topology());
        let mut depths = vec![0_u32; nodes.len()];
        for id in nodes.ids().take(nodes.inner()) {
            // Parents come before their children.
            for child in nodes.children(id).iter() {
                depths[child.index()] = depths[id.index()] + 1;
            }
        }
        let inner = 0..nodes.inner();
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
        let inner = scan.topology().inner();
        assert_eq!((makeup.points, makeup.nodes), (5205, leaves + inner));
        // 326 leaves lie under 128 nodes at depth 4, these under 32, 8 and 2.
        assert_eq!(inner, 128 + 32 + 8 + 2 + 1);
        assert!((4.0..5.0).contains(&makeup.depth), "{makeup:?}");
        assert!(makeup.samples == 16 * inner, "{makeup:?}");
        assert!(makeup.bytes_a_node > 88.0, "{makeup:?}");
    }
}
