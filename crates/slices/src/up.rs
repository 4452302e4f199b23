//! The axis that points up, and the two horizontal axes.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The axis that slices are stacked along.
///
/// A map has coordinates of its own: two horizontal ones, then the one that points up. They are a
/// rotation of the caller's, without mirroring.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Up {
    /// x grows upwards.
    X,
    /// y grows upwards.
    Y,
    /// z grows upwards.
    #[default]
    Z,
    /// x grows downwards.
    NegX,
    /// y grows downwards.
    NegY,
    /// z grows downwards.
    NegZ,
}

/// The text names no axis.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("expected x, y, z, -x, -y or -z, got `{given}`")]
pub struct UnknownAxis {
    /// The text.
    pub given: String,
}

impl Up {
    /// Returns the caller's axes that become the map's first, second and third, and whether the
    /// third is negated.
    const fn order(self) -> ([usize; 3], bool) {
        match self {
            Self::X => ([1, 2, 0], false),
            Self::Y => ([2, 0, 1], false),
            Self::Z => ([0, 1, 2], false),
            Self::NegX => ([2, 1, 0], true),
            Self::NegY => ([0, 2, 1], true),
            Self::NegZ => ([1, 0, 2], true),
        }
    }

    /// Converts a place or direction from the caller's coordinates to the map's: horizontal,
    /// horizontal, up.
    #[inline]
    #[must_use]
    pub fn to_map(self, p: [f64; 3]) -> [f64; 3] {
        let ([a, b, c], turned) = self.order();
        [p[a], p[b], if turned { -p[c] } else { p[c] }]
    }

    /// Converts a place or direction from the map's coordinates to the caller's: the inverse of
    /// [`Up::to_map`].
    #[must_use]
    pub fn from_map(self, p: [f64; 3]) -> [f64; 3] {
        let ([a, b, c], turned) = self.order();
        let mut q = [0.0; 3];
        (q[a], q[b], q[c]) = (p[0], p[1], if turned { -p[2] } else { p[2] });
        q
    }

    /// Returns the caller's coordinate along the axis at this height of the map.
    #[must_use]
    pub fn coordinate(self, height: f64) -> f64 {
        if self.order().1 { -height } else { height }
    }

    /// Converts two horizontal coordinates from the caller's order x, y, z to the map's order. Its
    /// own inverse.
    #[must_use]
    pub fn across(self, [p, q]: [f64; 2]) -> [f64; 2] {
        let ([a, b, _], _) = self.order();
        if a < b { [p, q] } else { [q, p] }
    }
}

impl FromStr for Up {
    type Err = UnknownAxis;

    fn from_str(name: &str) -> Result<Self, UnknownAxis> {
        Ok(match name.to_ascii_lowercase().as_str() {
            "x" | "+x" => Self::X,
            "y" | "+y" => Self::Y,
            "z" | "+z" => Self::Z,
            "-x" => Self::NegX,
            "-y" => Self::NegY,
            "-z" => Self::NegZ,
            _ => return Err(UnknownAxis { given: name.into() }),
        })
    }
}

impl fmt::Display for Up {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::NegX => "-x",
            Self::NegY => "-y",
            Self::NegZ => "-z",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [(&str, Up); 6] =
        [("x", Up::X), ("y", Up::Y), ("z", Up::Z), ("-x", Up::NegX), ("-y", Up::NegY), ("-z", Up::NegZ)];

    #[test]
    fn every_axis_turns_up_without_mirroring_and_back() {
        for (name, up) in ALL {
            assert_eq!(name.parse(), Ok(up));
            assert_eq!(up.to_string(), name);
            let p = [2.0, 3.0, 5.0];
            assert_eq!(up.from_map(up.to_map(p)), p, "{name}");
            let [a, b, c] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| up.to_map(e));
            let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
            assert_eq!(cross, c, "{name}: x × y = z");
            let axis = up.from_map([0.0, 0.0, 1.0]);
            assert!((up.coordinate(4.0) - axis.iter().sum::<f64>() * 4.0).abs() < 1e-15, "{name}");
            // The caller's coordinates without the one along the axis, in order.
            let level: Vec<f64> = (0..3).filter(|&k| axis[k] == 0.0).map(|k| p[k]).collect();
            let [u, v, _] = up.to_map(p);
            assert_eq!(up.across([level[0], level[1]]), [u, v], "{name}");
        }
        assert!("w".parse::<Up>().is_err());
    }
}
