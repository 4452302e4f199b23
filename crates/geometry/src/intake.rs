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

/// Which points are at the very place of an earlier one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Repeated {
    /// A bit a point.
    bits: Vec<u64>,
    count: usize,
}

/// Records that are sorted together: so many fit a cache.
const TOGETHER: usize = 1 << 17;

/// Most groups of records are two to this power.
const MOST_GROUPS: u32 = 8;

/// Records of a group that are written together, some pages of memory.
const RUN: usize = 1 << 12;

impl Repeated {
    /// Finds them. `records` is scratch with an element a point, and may be larger than memory: it is written
    /// in runs of 64 KiB, and then sorted part by part. O(n log n), and up to 16 MiB.
    ///
    /// # Panics
    /// When `records` is shorter than `points`.
    #[must_use]
    pub fn among(points: &[[f32; 3]], records: &mut [u128]) -> Self {
        let records = &mut records[..points.len()];
        if points.len() <= TOGETHER {
            records.iter_mut().zip((0..).zip(points)).for_each(|(to, (i, p))| *to = record(*p, i));
            let mut repeated = Self::none(points.len());
            repeated.find(records);
            return repeated;
        }
        // Equal points have equal hashes, and so come into the same group.
        let bits = (points.len() / TOGETHER).checked_ilog2().map_or(0, |log| (log + 1).min(MOST_GROUPS));
        let group = |p: &[f32; 3]| (hash(*p) >> 1 >> (63 - bits)) as usize;
        let mut starts = vec![0_usize; (1 << bits) + 1];
        points.iter().for_each(|p| starts[group(p) + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut runs: Vec<Vec<u128>> = vec![Vec::new(); 1 << bits];
        let mut write = |group: usize, run: &mut Vec<u128>| {
            let end = next[group] + run.len();
            records[next[group]..end].copy_from_slice(run);
            next[group] = end;
            run.clear();
        };
        for (i, p) in (0_u32..).zip(points) {
            let group = group(p);
            let run = &mut runs[group];
            run.push(record(*p, i));
            if run.len() == RUN {
                write(group, run);
            }
        }
        runs.iter_mut().enumerate().for_each(|(group, run)| write(group, run));
        drop(runs);
        let mut repeated = Self::none(points.len());
        starts.windows(2).for_each(|group| repeated.find(&mut records[group[0]..group[1]]));
        repeated
    }

    fn none(points: usize) -> Self {
        Self { bits: vec![0; points.div_ceil(64)], count: 0 }
    }

    /// Adds the later ones of equal points among these.
    fn find(&mut self, records: &mut [u128]) {
        // Half of a record is sorted faster, and tells nearly all points apart.
        let half = |record: u128| (record >> 64) as u64;
        records.sort_unstable_by_key(|record| half(*record));
        for alike in records.chunk_by_mut(|a, b| half(*a) == half(*b)).filter(|alike| alike.len() > 1) {
            alike.sort_unstable();
            for two in alike.windows(2).filter(|two| two[0] >> 32 == two[1] >> 32) {
                #[expect(clippy::cast_possible_truncation, reason = "the low 32 bits are the index")]
                let i = two[1] as u32 as usize;
                self.bits[i / 64] |= 1 << (i % 64);
                self.count += 1;
            }
        }
    }

    /// Returns `true` if the `i`-th point is one of them.
    #[must_use]
    pub fn contains(&self, i: usize) -> bool {
        self.bits[i / 64] >> (i % 64) & 1 == 1
    }

    /// How many there are.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.count
    }
}

/// The hash of a point, its z, and its index: equal points are equal but for that, others are not, and the
/// first of equal ones comes first.
fn record(p: [f32; 3], i: u32) -> u128 {
    u128::from(hash(p)) << 64 | u128::from(p[2].to_bits()) << 32 | u128::from(i)
}

/// The bits of a point, mixed: the highest bits of the result tell most points apart, and no two points of
/// equal z have the same, for each step can be undone.
fn hash(p: [f32; 3]) -> u64 {
    let [x, y, z] = p.map(|x| u64::from(x.to_bits()));
    let mixed = (x << 32 | y).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ z.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    (mixed ^ mixed >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Few or many groups, points that are repeated often, and zeros of either sign.
    #[test]
    fn the_later_ones_of_equal_points_are_repeated() {
        for (count, places) in [(0, 1), (1, 1), (1000, 7), (3000, 1), (5 * TOGETHER, 3 * TOGETHER)] {
            let mut state = 1_u64;
            let mut random = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                usize::try_from(state >> 33).unwrap_or_default() % places
            };
            #[expect(clippy::cast_precision_loss, reason = "small")]
            let mut points: Vec<[f32; 3]> = (0..count)
                .map(|_| random())
                .map(|k| [(k % 97) as f32 - 48.0, (k / 97) as f32, 0.5])
                .collect();
            if count > 2 {
                points[2] = [-0.0; 3];
                points[1] = [0.0; 3];
            }
            let found = Repeated::among(&points, &mut vec![0; count]);
            let mut seen = BTreeSet::new();
            let expected: Vec<bool> = points.iter().map(|p| !seen.insert(p.map(f32::to_bits))).collect();
            assert!((0..count).all(|i| found.contains(i) == expected[i]), "{count} points");
            assert_eq!(found.count(), expected.iter().filter(|is| **is).count());
        }
    }
}
