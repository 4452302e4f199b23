//! What a header says of points, found by a first pass over them; and why they cannot be written.

use std::io;

use nearmiss_geometry::Aabb;
use thiserror::Error;

use crate::columns::Holds;
use crate::points::Points;

/// Steps in which coordinates are counted, and where they are counted from: those of LAS.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// The length of a step along each axis.
    pub scale: [f64; 3],
    /// Where counting starts.
    pub offset: [f64; 3],
}

/// What a header must say of the points that follow it.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    pub(super) points: u64,
    bounds: Aabb,
    pub(super) holds: Holds,
    /// Whether single precision holds every coordinate.
    pub(super) is_single: bool,
    intensities: [f32; 2],
    /// Whether every intensity is a whole number of 16 bits.
    is_whole: bool,
    lattice: Option<Lattice>,
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
    /// Looks at some more points, all of which must be finite.
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

    /// The same, with coordinates to be counted in the steps of the input.
    #[must_use]
    pub fn with_lattice(self, lattice: Option<Lattice>) -> Self {
        Self { lattice, ..self }
    }

    /// How many points there are.
    #[must_use]
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Their bounds; empty if there are none.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The steps that LAS counts coordinates in: those of the input if it has some, else a power of ten of
    /// which a hundred million make the greatest extent.
    #[must_use]
    pub fn lattice(&self) -> Lattice {
        self.lattice.unwrap_or_else(|| {
            let extent = (0..3).map(|k| self.bounds.max[k] - self.bounds.min[k]).fold(0.0, f64::max);
            let step = if extent > 0.0 { 10_f64.powf((extent * 1e-8).log10().ceil()) } else { 1e-6 };
            let start = |k: usize| if self.points > 0 { self.bounds.min[k].floor() } else { 0.0 };
            Lattice { scale: [step; 3], offset: [start(0), start(1), start(2)] }
        })
    }

    /// How many decimals write coordinates exactly, where the input counted them in decimal steps.
    pub(super) fn decimals(&self) -> Option<usize> {
        let Lattice { scale, offset } = self.lattice?;
        (0..=9_u8)
            .find(|&n| {
                let whole =
                    |x: f64| (x * 10_f64.powi(n.into()) - (x * 10_f64.powi(n.into())).round()).abs() < 1e-9;
                scale.iter().chain(&offset).all(|x| whole(*x))
            })
            .map(usize::from)
    }

    /// What LAS stores for an intensity: itself if all are whole, else its place between the least and the
    /// greatest, up to 65535.
    #[cfg(feature = "laz")]
    pub(super) fn intensity(&self, intensity: f32) -> u16 {
        let [least, most] = self.intensities;
        let share = if most > least { (intensity - least) / (most - least) } else { 0.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let stored = if self.is_whole { intensity as u16 } else { (share * 65535.0).round() as u16 };
        stored
    }
}

/// Why points could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutError {
    /// The output failed.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Coordinates that LAS cannot count in 32 bits.
    #[error(
        "expected coordinates within 2^31 steps of {step} from {offset:?}, got {bounds:?}; write another format"
    )]
    TooWide {
        /// The length of a step.
        step: f64,
        /// Where counting starts.
        offset: [f64; 3],
        /// The least and the greatest coordinates.
        bounds: [[f64; 3]; 2],
    },
    /// A format that this build was made without.
    #[error("LAS and LAZ cannot be written by this build; build nearmiss-io with the feature `laz`")]
    Feature,
}
