//! `Points`: points with their attributes, in arrays.

use crate::columns::{Holds, Row};

/// Points in file order, with their attributes. Each array has one entry per point, or is empty if
/// the file does not have the attribute.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Points {
    /// Positions in the units of the file. Coordinates may be NaN or infinite.
    pub positions: Vec<[f64; 3]>,
    /// Normals as stored in the file, of any length.
    pub normals: Vec<[f32; 3]>,
    /// Red, green and blue.
    pub colours: Vec<[u8; 3]>,
    /// Intensities, in the unit of the file.
    pub intensities: Vec<f32>,
    /// LAS class codes, such as 2 for ground and 6 for buildings.
    pub classes: Vec<u8>,
}

impl Points {
    /// Creates points without attributes.
    #[must_use]
    pub fn of_positions(positions: Vec<[f64; 3]>) -> Self {
        Self { positions, ..Self::default() }
    }

    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns `true` if there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Removes all points, but keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.positions.clear();
        self.normals.clear();
        self.colours.clear();
        self.intensities.clear();
        self.classes.clear();
    }

    /// Reserves memory for `more` points with these attributes.
    pub(crate) fn reserve(&mut self, holds: Holds, more: usize) {
        self.positions.reserve(more);
        self.normals.reserve(if holds.normals { more } else { 0 });
        self.colours.reserve(if holds.colours { more } else { 0 });
        self.intensities.reserve(if holds.intensities { more } else { 0 });
        self.classes.reserve(if holds.classes { more } else { 0 });
    }

    /// Adds a point with these attributes.
    #[inline]
    pub(crate) fn push(&mut self, holds: Holds, row: &Row) {
        let [x, y, z, nx, ny, nz, r, g, b, intensity, class] = *row;
        self.positions.push([x, y, z]);
        if holds.normals {
            #[expect(clippy::cast_possible_truncation, reason = "single precision is enough for a normal")]
            self.normals.push([nx, ny, nz].map(|n| n as f32));
        }
        if holds.colours {
            self.colours.push([r, g, b].map(channel));
        }
        if holds.intensities {
            #[expect(clippy::cast_possible_truncation, reason = "no format keeps more of an intensity")]
            self.intensities.push(intensity as f32);
        }
        if holds.classes {
            self.classes.push(channel(class));
        }
    }

    /// Adds all points of `other`, which must have the same attributes.
    pub fn append(&mut self, other: &Self) {
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.colours.extend_from_slice(&other.colours);
        self.intensities.extend_from_slice(&other.intensities);
        self.classes.extend_from_slice(&other.classes);
    }

    /// Keeps the points for which `keep`, given their index, returns `true`.
    pub fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        let kept: Vec<bool> = (0..self.len()).map(keep).collect();
        retain(&mut self.positions, &kept);
        retain(&mut self.normals, &kept);
        retain(&mut self.colours, &kept);
        retain(&mut self.intensities, &kept);
        retain(&mut self.classes, &kept);
    }
}

fn retain<T>(values: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    values.retain(|_| kept.next().is_some_and(|kept| *kept));
}

/// Rounds a number to 0..=255, for a colour channel or a class.
pub(crate) fn channel(value: f64) -> u8 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates, and makes zero of NaN"
    )]
    let channel = value.round() as u8;
    channel
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_saturate() {
        assert_eq!([-5.0, 0.4, 254.6, 300.0, f64::NAN].map(channel), [0, 0, 255, 255, 0]);
    }

    #[test]
    fn what_is_kept_keeps_what_belongs_to_it() {
        let holds = Holds { intensities: true, classes: true, ..Holds::default() };
        let mut points = Points::default();
        for i in 0..5 {
            let i = f64::from(i);
            points.push(holds, &[i, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 10.0 * i, 2.0 + i]);
        }
        let classes = points.classes.clone();
        points.retain(|i| classes[i] % 2 == 0);
        assert_eq!(points.positions, [[0.0; 3], [2.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
        assert_eq!((&points.intensities[..], &points.classes[..]), (&[0.0, 20.0, 40.0][..], &[2, 4, 6][..]));
        assert!(points.normals.is_empty() && points.colours.is_empty());
    }
}
