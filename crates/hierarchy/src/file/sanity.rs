//! The invariants of a hierarchy. Those that queries need for memory safety and bounded cost are
//! checked on every load. Those that correct answers need are checked when the whole file is
//! compared with its checksums ([`Check`](nearmiss_store::Check)). [`PointHierarchy::sanity_check`]
//! checks all of them.

mod leaves;
#[cfg(test)]
mod lies;
mod limits;
mod lists;
mod metadata;
mod nodes;
mod points;
mod samples;

use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_store::Flaw;

pub(crate) use metadata::{checked_topology, frame_is_valid};
pub(crate) use nodes::{check as check_boxes, is_in_range};

use crate::scan::build::PointHierarchy;

impl PointHierarchy {
    /// Checks what queries need to stay within their arrays and to terminate: lengths and metadata.
    /// O(1).
    pub(crate) fn check_structure(&self) -> Result<(), Flaw> {
        self.check_lengths()?;
        self.check_metadata()
    }

    /// Checks what correct answers need in addition, given a valid structure. Each box is within
    /// its parent's, every number of every point is one that a build can write and is within the
    /// bounds of its leaf, and derived data match the points. One pass over the whole.
    pub(crate) fn check_contents(&self) -> Result<(), Flaw> {
        nodes::check(&self.tree())?;
        points::check(self)?;
        leaves::check(self)?;
        samples::check(self)?;
        lists::check(self)?;
        self.check_summary()
    }

    /// Checks every invariant: those that a load checks, that the box of each node contains the
    /// discs of all points under it, that neighbour lists are complete, and that no point of the
    /// input is stored twice. O(n log n); for tests.
    ///
    /// # Errors
    /// Names the first invariant that does not hold.
    pub fn sanity_check(&self) -> Result<(), Flaw> {
        let wrong = |what, index| Err(Flaw::Value { what, index });
        self.check_structure()?;
        self.check_contents()?;
        let tree = self.tree();
        for id in self.topology.ids() {
            let bounds = tree.bounds(id);
            for i in self.topology.points(id) {
                if bounds.reach < self.arrays.radii[i] {
                    return wrong("the greatest radius of node", id.index());
                }
                if !self.box_holds(id, i) {
                    return wrong("the box of node", id.index());
                }
            }
        }
        lists::check_complete(self)?;
        let mut sources: Vec<u32> = self.arrays.source.to_vec();
        sources.sort_unstable();
        match sources.windows(2).find(|two| two[0] == two[1]) {
            Some(two) => wrong("the repeated source index", two[0] as usize),
            None => Ok(()),
        }
    }

    /// Returns `true` if the box of node `id` contains the disc and the ball of point `i`.
    fn box_holds(&self, id: NodeId, i: usize) -> bool {
        let bounds = self.tree().bounds(id);
        let double = |v: [f32; 3]| Vector3::from(v.map(f64::from));
        let d = double(self.positions()[i]) - double(bounds.centre);
        let ball = f64::from(self.arrays().ball(i).max(self.arrays().obstacle_ball(i)));
        (0..3).all(|k| {
            let axis = double(bounds.axes[k]);
            let spread = f64::from(self.discs().get(i)) * double(self.arrays.normals[i]).cross(&axis).norm();
            d.dot(&axis).abs() + spread.max(ball) <= f64::from(bounds.half[k])
        })
    }
}
