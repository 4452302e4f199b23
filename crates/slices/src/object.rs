//! Collision of two maps: objects of the scene as slices of their own (Anjos et al. 2012, §5),
//! rotated about the axis that points up.

use nearmiss_geometry::Pose;
use thiserror::Error;

use crate::map::{SliceMap, Unloaded};
use crate::query::{Floor, Floors, Occupancy};

/// Greatest deviation of the object's axis from the building's, for rotations rounded to decimals.
const UPRIGHT: f64 = 1e-6;

/// The reason why two maps cannot be compared.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ObjectError {
    /// The pose tilts the object.
    #[error("expected a pose that turns about the axis that points up only, got a tilt of {degrees} degrees")]
    Tilted {
        /// Angle between the posed axis and the building's.
        degrees: f64,
    },
    /// A required slice is not loaded.
    #[error(transparent)]
    Unloaded(#[from] Unloaded),
}

/// The map from an object's coordinates to the building's: a rotation about the axis that points
/// up, a scale and a translation.
struct Upright {
    /// Cosine and sine of the rotation.
    turn: [f64; 2],
    scale: f64,
    shift: [f64; 3],
}

impl Upright {
    /// Returns the transformation for a pose of the object. Fails if the pose tilts the object.
    fn new(building: &SliceMap, object: &SliceMap, pose: &Pose) -> Result<Self, ObjectError> {
        let (of, to) = (object.grid().up, building.grid().up);
        let turned = |v: [f64; 3]| to.to_map(pose.rotate(of.from_map(v)));
        let up = turned([0.0, 0.0, 1.0]);
        // The form of the condition also rejects NaN.
        if !(up[0].abs() <= UPRIGHT && up[1].abs() <= UPRIGHT && up[2] > 0.0) {
            let degrees = up[2].clamp(-1.0, 1.0).acos().to_degrees();
            return Err(ObjectError::Tilted { degrees });
        }
        let [cosine, sine, _] = turned([1.0, 0.0, 0.0]);
        Ok(Self { turn: [cosine, sine], scale: pose.scale(), shift: to.to_map(pose.translation()) })
    }

    fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.turn;
        [self.scale * (c * x - s * y) + self.shift[0], self.scale * (s * x + c * y) + self.shift[1]]
    }

    fn height(&self, z: f64) -> f64 {
        self.scale * z + self.shift[2]
    }
}

impl SliceMap {
    /// Tests this map against an object's own map, with the pose object → building.
    ///
    /// Each occupied pixel of the object is a box that turns with the object, as wide as the
    /// object's pixel and as high as its slice. It collides with every occupied pixel of the
    /// building that it overlaps or touches. `pixels` counts the object's pixels that collide. The
    /// floor is looked up below the centres of the object's columns, starting at the bottom of its
    /// lowest occupied slice.
    ///
    /// # Errors
    /// If the pose tilts the object, or a required slice is not loaded.
    pub fn meets(&self, object: &Self, pose: &Pose, floor: Floor) -> Result<Occupancy, ObjectError> {
        let upright = Upright::new(self, object, pose)?;
        let grid = object.grid();
        let lowest = |s: &u32| Ok::<_, Unloaded>(object.slice(*s)?.counts()[0] > 0);
        let mut base = None;
        for s in 0..grid.counts[2] {
            if lowest(&s)? {
                base = Some(upright.height(grid.origin[2] + f64::from(s) * grid.slice_height));
                break;
            }
        }
        let mut found = Occupancy::default();
        let Some(base) = base else { return Ok(found) };
        let mut floors = Floors::default();
        for row in 0..grid.counts[1] {
            for column in 0..grid.counts[0] {
                let mut is_filled = false;
                let centre = upright.apply(grid.middle(column, row));
                for s in 0..grid.counts[2] {
                    if object.slice(s)?.pixel(column, row).is_some() {
                        is_filled = true;
                        let bottom = grid.origin[2] + f64::from(s) * grid.slice_height;
                        let heights = [bottom, bottom + grid.slice_height].map(|z| upright.height(z));
                        let half = 0.5 * grid.pixel * upright.scale;
                        let met = self.turned_box(centre, half, upright.turn, heights)?;
                        found.pixels += u64::from(met.is_some());
                        found.obstacle |= met == Some(true);
                    }
                }
                if is_filled {
                    let [x, y] = [0, 1].map(|axis| self.grid().range(axis, [centre[axis]; 2]));
                    if let (Some(x), Some(y)) = (x, y) {
                        self.floors_below(&x, y, base, &mut floors)?;
                    }
                }
            }
        }
        found.collides = found.pixels > 0;
        found.floor = floors.height(floor).map(|height| self.grid().up.coordinate(height));
        Ok(found)
    }

    /// Tests a rotated upright box with a square base. Returns `None` if it meets nothing,
    /// `Some(true)` if it meets an obstacle, `Some(false)` otherwise.
    fn turned_box(
        &self,
        centre: [f64; 2],
        half: f64,
        [c, s]: [f64; 2],
        [low, high]: [f64; 2],
    ) -> Result<Option<bool>, Unloaded> {
        let grid = self.grid();
        let breadth = c.abs() + s.abs();
        let reach = half * breadth;
        let min = [centre[0] - reach, centre[1] - reach, low];
        let max = [centre[0] + reach, centre[1] + reach, high];
        let Some(block) = grid.block(min, max) else { return Ok(None) };
        // The sum of both squares' half extents along the sides of the rotated square.
        let apart = half + 0.5 * grid.pixel * breadth;
        let mut met = None;
        for row in block.rows.clone() {
            for column in block.columns.clone() {
                let [x, y] = grid.middle(column, row);
                let [dx, dy] = [x - centre[0], y - centre[1]];
                if (c * dx + s * dy).abs() > apart || (c * dy - s * dx).abs() > apart {
                    continue;
                }
                for slice in block.slices.clone() {
                    match self.slice(slice)?.pixel(column, row) {
                        Some(found) if found.is_obstacle => return Ok(Some(true)),
                        Some(_) => met = Some(false),
                        None => {}
                    }
                }
            }
        }
        Ok(met)
    }
}
