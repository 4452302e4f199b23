//! What has to be known of points before a cloud is made of them: their frame, and which are repeated.

use crate::cloud_error::CloudError;
use crate::{Aabb, Frame};

/// Fewer distinct points than this define no surface worth asking about.
pub const LEAST_POINTS: usize = 8;

/// Beyond this a squared distance leaves the range of double precision.
const FARTHEST: f64 = 1e150;

/// Bounds and counts of points that are given piece by piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intake {
    bounds: Aabb,
    given: usize,
    not_finite: usize,
    /// The first point that is too far from the origin.
    too_far: Option<usize>,
}

impl Default for Intake {
    fn default() -> Self {
        Self { bounds: Aabb::EMPTY, given: 0, not_finite: 0, too_far: None }
    }
}

impl Intake {
    /// Takes another point into account.
    pub fn add(&mut self, p: [f64; 3]) {
        if p.iter().all(|x| x.is_finite()) {
            if self.too_far.is_none() && p.iter().any(|x| x.abs() > FARTHEST) {
                self.too_far = Some(self.given);
            }
            self.bounds.grow(p);
        } else {
            self.not_finite += 1;
        }
        self.given += 1;
    }

    /// How many points were given.
    #[must_use]
    pub const fn given(&self) -> usize {
        self.given
    }

    /// How many of them have a coordinate that is not finite.
    #[must_use]
    pub const fn not_finite(&self) -> usize {
        self.not_finite
    }

    /// The frame of a cloud of these points.
    ///
    /// # Errors
    /// When they are too many, or one is too far from the origin.
    pub fn frame(&self) -> Result<Frame, CloudError> {
        match self.too_far {
            _ if u32::try_from(self.given).is_err() => Err(CloudError::TooMany { given: self.given }),
            Some(index) => Err(CloudError::TooLarge { index }),
            None => Ok(Frame::around(self.bounds.min, self.bounds.max)),
        }
    }
}

/// Calls `repeated` with the index of every point at the very place of an earlier one, in no order. `keys` is
/// scratch with an element a point. O(n log n).
///
/// # Panics
/// When `keys` is shorter than `points`.
pub fn find_repeated(points: &[[f32; 3]], keys: &mut [u64], mut repeated: impl FnMut(u32)) {
    // A hash of each point above its index: equal points come to stand in one run.
    let keys = &mut keys[..points.len()];
    for ((i, p), key) in (0..).zip(points).zip(&mut *keys) {
        *key = hash(*p) & !0xffff_ffff | i;
    }
    keys.sort_unstable();
    #[expect(clippy::cast_possible_truncation, reason = "the low 32 bits are the index")]
    let index = |key: u64| key as u32;
    for run in keys.chunk_by_mut(|a, b| a >> 32 == b >> 32).filter(|run| run.len() > 1) {
        let bits = |key: u64| points[index(key) as usize].map(f32::to_bits);
        run.sort_unstable_by_key(|&key| (bits(key), key));
        let repeats = run.windows(2).filter(|two| bits(two[0]) == bits(two[1]));
        repeats.for_each(|two| repeated(index(two[1])));
    }
}

/// The bits of a point, mixed: the upper half of the result tells most points apart.
fn hash(p: [f32; 3]) -> u64 {
    let [x, y, z] = p.map(|x| u64::from(x.to_bits()));
    let mixed = (x << 32 | y).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ z.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    (mixed ^ mixed >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}
