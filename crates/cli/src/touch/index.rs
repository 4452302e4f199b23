//! A shape index for files of many shapes.

use nearmiss::{Placed, ShapeIndex};

/// The least number of shapes for which an index pays off.
const MANY: u32 = 256;

/// A shape index that is built once many shapes were asked about.
#[derive(Default)]
pub(super) struct LaterIndex {
    asked: u32,
    index: Option<ShapeIndex>,
}

impl LaterIndex {
    /// Counts a shape. Returns the scan with its index, if there is one by now.
    pub(super) fn placed<'p>(&'p mut self, placed: &Placed<'p>) -> Placed<'p> {
        self.asked += 1;
        if self.asked == MANY {
            self.index = Some(ShapeIndex::new(placed.scan()));
        }
        self.index.as_ref().map_or(*placed, |index| placed.with_shapes(index))
    }
}
