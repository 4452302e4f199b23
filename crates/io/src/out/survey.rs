//! `Survey`: the contents of a header, collected by a first pass over the points. Also the errors
//! of writing.

use std::io;

use nearmiss_geometry::Aabb;
use thiserror::Error;

use crate::columns::Holds;
use crate::points::Points;
use crate::text::plain;

/// The scale and offset of LAS: coordinates are `offset + n * scale` for 32-bit integers `n`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleOffset {
    /// Step size along each axis, in the units of the file.
    pub scale: [f64; 3],
    /// Origin of the steps, in the units of the file.
    pub offset: [f64; 3],
}

/// The number, bounds, attributes and precision of all points of a file, as needed for its header.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    pub(super) points: u64,
    bounds: Aabb,
    pub(super) holds: Holds,
    /// `true` if every coordinate is exact in single precision.
    pub(super) is_single: bool,
    intensities: [f32; 2],
    /// `true` if every intensity is a whole number of 16 bits.
    is_whole: bool,
    lattice: Option<ScaleOffset>,
}

impl Default for Survey {
    fn default() -> Self {
        Self {
            points: 0,
            bounds: Aabb::EMPTY,
            holds: Holds::default(),
            is_single: true,
            intensities: [f32::INFINITY, f32::NEG_INFINITY],
            is_whole: true,
            lattice: None,
        }
    }
}

impl Survey {
    /// Adds a block of points, all of which must be finite.
    pub fn add(&mut self, points: &Points) {
        self.points += points.len() as u64;
        self.holds = Holds {
            normals: !points.normals.is_empty() || self.holds.normals,
            colours: !points.colours.is_empty() || self.holds.colours,
            intensities: !points.intensities.is_empty() || self.holds.intensities,
            classes: !points.classes.is_empty() || self.holds.classes,
        };
        for p in &points.positions {
            self.bounds.grow(*p);
            #[expect(clippy::cast_possible_truncation, reason = "compared with what was there")]
            let is_single = p.iter().all(|x| f64::from(*x as f32).to_bits() == x.to_bits());
            self.is_single &= is_single;
        }
        for &intensity in &points.intensities {
            self.intensities = [self.intensities[0].min(intensity), self.intensities[1].max(intensity)];
            self.is_whole &= intensity.fract() == 0.0 && (0.0..=65535.0).contains(&intensity);
        }
    }

    /// Sets the lattice of the coordinates, usually that of the input.
    #[must_use]
    pub fn with_lattice(self, lattice: Option<ScaleOffset>) -> Self {
        Self { lattice, ..self }
    }

    /// Returns the number of points.
    #[must_use]
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Returns the bounds of the points; empty without points.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Returns the lattice for LAS: that of [`Self::with_lattice`] if given. Otherwise the step is
    /// the least power of ten of which 100 million cover the greatest extent.
    #[must_use]
    pub fn lattice(&self) -> ScaleOffset {
        self.lattice.unwrap_or_else(|| {
            let extent = (0..3).map(|k| self.bounds.max[k] - self.bounds.min[k]).fold(0.0, f64::max);
            let step = if extent > 0.0 { 10_f64.powf((extent * 1e-8).log10().ceil()) } else { 1e-6 };
            let start = |k: usize| if self.points > 0 { self.bounds.min[k].floor() } else { 0.0 };
            ScaleOffset { scale: [step; 3], offset: [start(0), start(1), start(2)] }
        })
    }

    /// Returns the number of decimals that write coordinates exactly, if the lattice has decimal
    /// steps.
    pub(super) fn decimals(&self) -> Option<usize> {
        let ScaleOffset { scale, offset } = self.lattice?;
        (0..=9_u8)
            .find(|&n| {
                let whole =
                    |x: f64| (x * 10_f64.powi(n.into()) - (x * 10_f64.powi(n.into())).round()).abs() < 1e-9;
                scale.iter().chain(&offset).all(|x| whole(*x))
            })
            .map(usize::from)
    }

    /// Returns the intensity as stored in LAS: unchanged if all are whole numbers, otherwise scaled
    /// from the range of all intensities to 0..=65535.
    #[cfg(feature = "laz")]
    pub(super) fn intensity(&self, intensity: f32) -> u16 {
        let [least, most] = self.intensities;
        let share = if most > least { (intensity - least) / (most - least) } else { 0.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let stored = if self.is_whole { intensity as u16 } else { (share * 65535.0).round() as u16 };
        stored
    }
}

/// Error of writing points.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutError {
    /// The operating system reported an error.
    #[error("cannot write the points ({}); check the space left on the disk and try again", plain(.0))]
    Io(#[from] io::Error),
    /// Coordinates that exceed the 32-bit range of LAS.
    #[error(
        "expected coordinates within 2^31 steps of {step} from {offset:?}, got {:?} to {:?}; write another format",
        .bounds[0],
        .bounds[1]
    )]
    TooWide {
        /// Step size.
        step: f64,
        /// Origin of the steps.
        offset: [f64; 3],
        /// Minimum and maximum of the coordinates.
        bounds: [[f64; 3]; 2],
    },
    /// LAS or LAZ, in a build without the feature `laz`.
    #[error("this build cannot write LAS or LAZ; enable the feature `laz` of nearmiss-io")]
    Feature,
}
