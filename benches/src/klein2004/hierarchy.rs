//! Table 1 and Fig. 8: the make-up of hierarchies and the time to build them.

use std::hint::black_box;
use std::time::Duration;

use nearmiss::{BuildOptions, PointCloud, Scan};

use crate::Failure;
use crate::clock::processor_time;
use crate::sample::count;

/// The make-up of a hierarchy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Makeup {
    /// Cloud points.
    pub points: usize,
    /// Sample points of all inner nodes together.
    pub samples: usize,
    /// Nodes, including leaves.
    pub nodes: usize,
    /// Average depth of a node; the root has depth 0.
    pub depth: f64,
    /// Bytes of the file per point.
    pub bytes_a_point: f64,
    /// Bytes of the nodes per node.
    pub bytes_a_node: f64,
}

impl Makeup {
    /// The make-up of a prepared scan.
    ///
    /// # Errors
    /// When the scan cannot be written.
    pub fn of(scan: &Scan) -> Result<Self, Failure> {
        let (arrays, nodes) = (scan.arrays(), scan.topology());
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
            samples: inner.map(|id| arrays.samples(id).len()).sum(),
            nodes: nodes.len(),
            depth: depths.iter().map(|&d| f64::from(d)).sum::<f64>() / count(nodes.len()),
            bytes_a_point: count(bytes) / count(scan.len()),
            bytes_a_node: count(scan.bytes_of_nodes()) / count(nodes.len()),
        })
    }
}

/// Builds repeat for at least this long, so that the resolution of a hundredth of a second is
/// small.
const LONG_ENOUGH: Duration = Duration::from_millis(500);

/// Seconds of processor time per build, on one thread.
///
/// # Errors
/// When the scan cannot be built.
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
        // 326 leaves are below 128 nodes at depth 4, these below 32, 8 and 2.
        assert_eq!(inner, 128 + 32 + 8 + 2 + 1);
        assert!((4.0..5.0).contains(&makeup.depth), "{makeup:?}");
        assert!(makeup.samples == 16 * inner, "{makeup:?}");
        assert!(makeup.bytes_a_node > 88.0, "{makeup:?}");
    }
}
