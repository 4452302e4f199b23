//! First pass over the input of a cloud: the frame of the points, and which points are repeated.

use crate::cloud_error::CloudError;
use crate::{Aabb, Frame};

/// Least number of distinct points in a cloud. Fewer points define no useful surface.
pub const LEAST_POINTS: usize = 8;

/// Coordinates beyond this have squared distances outside the range of double precision.
const FARTHEST: f64 = 1e150;

/// Bounds and counts of points that are given one by one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intake {
    bounds: Aabb,
    given: usize,
    not_finite: usize,
    /// Index of the first point that is too far from the origin.
    too_far: Option<usize>,
}

impl Default for Intake {
    fn default() -> Self {
        Self { bounds: Aabb::EMPTY, given: 0, not_finite: 0, too_far: None }
    }
}

impl Intake {
    /// Adds a point.
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

    /// Returns the number of points added.
    #[must_use]
    pub const fn given(&self) -> usize {
        self.given
    }

    /// Returns the number of added points with a NaN or infinite coordinate.
    #[must_use]
    pub const fn not_finite(&self) -> usize {
        self.not_finite
    }

    /// Returns the frame for a cloud of the added points.
    ///
    /// # Errors
    /// Fails if there are more than 2³² − 1 points, or if a coordinate is beyond ±1e150.
    pub fn frame(&self) -> Result<Frame, CloudError> {
        match self.too_far {
            _ if u32::try_from(self.given).is_err() => Err(CloudError::TooMany { given: self.given }),
            Some(index) => Err(CloudError::TooLarge { index }),
            None => Ok(Frame::around(self.bounds.min, self.bounds.max)),
        }
    }
}

/// The set of points that have the same position as an earlier point.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Repeated {
    /// One bit for each point.
    bits: Vec<u64>,
    count: usize,
}

/// Number of records that are searched together; they fit into a cache.
const TOGETHER: usize = 1 << 17;

/// Binary logarithm of the greatest number of groups of records.
const MOST_GROUPS: u32 = 8;

/// Number of records of a group that are written at once: 64 KiB.
const RUN: usize = 1 << 12;

/// The greatest number of records that are put into a hash table. A group is larger if many points are
/// at one place, or in clouds of some hundred million points.
const MOST_HASHED: usize = 1 << 20;

/// Number of places of a hash table that are tried for a record. The table is at most half full, so more
/// are needed only if many hashes are alike.
const MOST_TRIES: usize = 64;

impl Repeated {
    /// Finds the repeated points among `points`.
    ///
    /// `records` is scratch memory with one element for each point. It may be larger than main
    /// memory: it is written in runs of 64 KiB, and then searched group by group. Takes O(n)
    /// time, or O(n log n) where many hashes are alike, and some 24 MiB.
    ///
    /// # Panics
    /// Panics if `records` is shorter than `points`.
    #[must_use]
    pub fn among(points: &[[f32; 3]], records: &mut [u128]) -> Self {
        let records = &mut records[..points.len()];
        let mut table = Vec::new();
        if points.len() <= TOGETHER {
            records.iter_mut().zip((0..).zip(points)).for_each(|(to, (i, p))| *to = record(*p, i));
            let mut repeated = Self::none(points.len());
            repeated.find(records, &mut table);
            return repeated;
        }
        // Equal points have equal hashes, so they are in the same group.
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
        starts.windows(2).for_each(|group| repeated.find(&mut records[group[0]..group[1]], &mut table));
        repeated
    }

    fn none(points: usize) -> Self {
        Self { bits: vec![0; points.div_ceil(64)], count: 0 }
    }

    /// Adds the points of `records` that repeat an earlier point. Indices ascend. `table` is reused
    /// memory.
    fn find(&mut self, records: &mut [u128], table: &mut Vec<u32>) {
        if records.len() > MOST_HASHED || !self.find_by_hash(records, table) {
            self.find_by_order(records);
        }
    }

    /// Finds them in O(n). Returns `false`, and may have added only some, if hashes that are alike make
    /// that slow.
    fn find_by_hash(&mut self, records: &[u128], table: &mut Vec<u32>) -> bool {
        const FREE: u32 = u32::MAX;
        let mask = (2 * records.len()).next_power_of_two() - 1;
        table.clear();
        table.resize(mask + 1, FREE);
        for (number, record) in (0_u32..).zip(records) {
            #[expect(clippy::cast_possible_truncation, reason = "the lowest bits of the hash")]
            let first = (record >> 64) as usize & mask;
            let places = (first..first + MOST_TRIES).map(|place| place & mask);
            let is_known = |place: &usize| {
                let other = table[*place];
                other == FREE || records[other as usize] >> 32 == record >> 32
            };
            match places.into_iter().find(is_known) {
                None => return false,
                Some(place) if table[place] == FREE => table[place] = number,
                Some(_) => self.add(*record),
            }
        }
        true
    }

    /// Finds them in O(n log n).
    fn find_by_order(&mut self, records: &mut [u128]) {
        // The upper half of a record is faster to sort, and differs for nearly all distinct points.
        let half = |record: u128| (record >> 64) as u64;
        records.sort_unstable_by_key(|record| half(*record));
        for alike in records.chunk_by_mut(|a, b| half(*a) == half(*b)).filter(|alike| alike.len() > 1) {
            alike.sort_unstable();
            alike.windows(2).filter(|two| two[0] >> 32 == two[1] >> 32).for_each(|two| self.add(two[1]));
        }
    }

    /// Adds the point of a record; nothing if it has been added before.
    #[expect(clippy::cast_possible_truncation, reason = "the low 32 bits are the index")]
    fn add(&mut self, record: u128) {
        let i = record as u32 as usize;
        self.count += usize::from(!self.contains(i));
        self.bits[i / 64] |= 1 << (i % 64);
    }

    /// Returns `true` if point `i` repeats an earlier point.
    #[must_use]
    pub fn contains(&self, i: usize) -> bool {
        self.bits[i / 64] >> (i % 64) & 1 == 1
    }

    /// Returns the number of repeated points.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.count
    }
}

/// The hash of a point, its z coordinate and its index, from high bits to low. Records of equal
/// points differ in the index alone, so sorting puts the first of equal points first.
fn record(p: [f32; 3], i: u32) -> u128 {
    u128::from(hash(p)) << 64 | u128::from(p[2].to_bits()) << 32 | u128::from(i)
}

/// Mixes the bits of a point. Each step is invertible, so distinct points of equal z have distinct
/// hashes. The highest bits of the hash differ for most distinct points.
fn hash(p: [f32; 3]) -> u64 {
    let [x, y, z] = p.map(|x| u64::from(x.to_bits()));
    let mixed = (x << 32 | y).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ z.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    (mixed ^ mixed >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Covers few and many groups, points that are repeated often, and zeros of either sign.
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
            let mut records: Vec<u128> = (0..).zip(&points).map(|(i, p)| record(*p, i)).collect();
            let mut by_order = Repeated::none(count);
            by_order.find_by_order(&mut records);
            assert_eq!(by_order, found, "{count} points, by order");
            let mut seen = BTreeSet::new();
            let expected: Vec<bool> = points.iter().map(|p| !seen.insert(p.map(f32::to_bits))).collect();
            assert!((0..count).all(|i| found.contains(i) == expected[i]), "{count} points");
            assert_eq!(found.count(), expected.iter().filter(|is| **is).count());
        }
    }

    #[test]
    fn records_of_one_hash_are_found_by_order() {
        // Two points of each of a hundred places.
        let mut records: Vec<u128> =
            (0..200_u32).map(|i| 7 << 64 | u128::from(i % 100) << 32 | u128::from(i)).collect();
        let mut found = Repeated::none(200);
        assert!(!found.find_by_hash(&records, &mut Vec::new()), "too many of one hash");
        found.find(&mut records, &mut Vec::new());
        assert!((0..200).all(|i| found.contains(i) == (i >= 100)));
        assert_eq!(found.count(), 100);
    }
}
