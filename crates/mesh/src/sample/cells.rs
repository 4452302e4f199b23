//! Points in a hash table of cubic cells, for the neighbours within a fixed radius.

use crate::triangle::{between, dot};

/// Cell side over radius. Above 1, so that rounding cannot place two points within the radius
/// further than one cell apart.
const SIDE: f64 = 1.05;

/// Normals with a smaller dot product face opposite sides: they differ by more than 120°. The faces
/// at an edge of a cube or a tetrahedron do not, the two sides of a thin sheet do.
const OPPOSITE: f32 = -0.5;

/// End of a chain.
const NONE: u32 = u32::MAX;

/// A point of a surface and the unit normal there, zero if unknown.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Site {
    pub(crate) at: [f64; 3],
    pub(crate) normal: [f32; 3],
}

/// Sites that can be added and removed, and found near a point. Memory and the order of visits
/// depend on the sites alone.
#[derive(Debug)]
pub(crate) struct Cells {
    radius: f64,
    /// First site of each bucket. The length is a power of two.
    heads: Vec<u32>,
    entries: Vec<Entry>,
}

/// A site in a bucket. Flat, so that it takes 48 bytes.
#[derive(Debug, Clone, Copy)]
struct Entry {
    at: [f64; 3],
    normal: [f32; 3],
    /// Next site of the same bucket.
    next: u32,
    /// The key of the cell.
    key: u64,
}

impl Entry {
    fn site(&self) -> Site {
        Site { at: self.at, normal: self.normal }
    }

    /// Returns `true` if both points face the same side. Points on the two sides of a thin sheet do
    /// not; an unknown normal faces every side.
    fn faces_with(&self, normal: &[f32; 3]) -> bool {
        (0..3).map(|k| self.normal[k] * normal[k]).sum::<f32>() >= OPPOSITE
    }
}

impl Cells {
    /// Creates an empty table with memory for `capacity` sites.
    pub(crate) fn new(radius: f64, capacity: usize) -> Self {
        let buckets = capacity.max(64).next_power_of_two();
        Self { radius, heads: vec![NONE; buckets], entries: Vec::with_capacity(capacity) }
    }

    /// Changes the radius. Removed sites return.
    pub(crate) fn resize(&mut self, radius: f64) {
        self.radius = radius;
        for i in 0..self.entries.len() {
            self.entries[i].key = key(self.cell(self.entries[i].at));
        }
        self.link_all(self.heads.len());
    }

    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Returns the positions of all sites ever added, in that order.
    pub(crate) fn positions(&self) -> impl Iterator<Item = [f64; 3]> {
        self.entries.iter().map(|entry| entry.at)
    }

    pub(crate) fn site(&self, i: u32) -> Site {
        self.entries[i as usize].site()
    }

    /// Adds a site. There must be fewer than 2³² − 1.
    pub(crate) fn add(&mut self, site: Site) {
        if self.entries.len() == self.heads.len() {
            self.link_all(2 * self.heads.len());
        }
        let Site { at, normal } = site;
        self.entries.push(Entry { at, normal, next: NONE, key: key(self.cell(at)) });
        self.link(self.entries.len() - 1);
    }

    fn link_all(&mut self, buckets: usize) {
        self.heads.clear();
        self.heads.resize(buckets, NONE);
        (0..self.entries.len()).for_each(|i| self.link(i));
    }

    /// Makes site `i` the first of its bucket.
    fn link(&mut self, i: usize) {
        let bucket = self.bucket(self.entries[i].key);
        self.entries[i].next = self.heads[bucket];
        #[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32 sites")]
        let index = i as u32;
        self.heads[bucket] = index;
    }

    /// Removes site `i` from all further visits.
    pub(crate) fn remove(&mut self, i: u32) {
        let Entry { key, next, .. } = self.entries[i as usize];
        let bucket = self.bucket(key);
        let mut before = self.heads[bucket];
        if before == i {
            self.heads[bucket] = next;
            return;
        }
        while before != NONE {
            let entry = &mut self.entries[before as usize];
            if entry.next == i {
                entry.next = next;
                return;
            }
            before = entry.next;
        }
    }

    /// Returns `true` if `test` does so for a site within the radius that faces the same side. The
    /// arguments of `test` are the index of the site, its position and its squared distance. Visits
    /// each site at most once, and none after `test` has returned `true`.
    pub(crate) fn any_near(&self, from: &Site, mut test: impl FnMut(u32, [f64; 3], f64) -> bool) -> bool {
        let most = self.radius * self.radius;
        let cell = self.cell(from.at);
        // Squared distance to the next cells along each axis, in sides.
        let apart = [0, 1, 2].map(|k| {
            let place = from.at[k] / (SIDE * self.radius);
            let above_wall = place - place.floor();
            [above_wall * above_wall, 0.0, (1.0 - above_wall) * (1.0 - above_wall)]
        });
        for (dz, of_z) in (-1..=1).zip(apart[2]) {
            for (dy, of_y) in (-1..=1).zip(apart[1]) {
                for (dx, of_x) in (-1..=1).zip(apart[0]) {
                    // A side is more than the radius, by more than the rounding.
                    if of_x + of_y + of_z > 1.0 {
                        continue;
                    }
                    let key =
                        key([cell[0].wrapping_add(dx), cell[1].wrapping_add(dy), cell[2].wrapping_add(dz)]);
                    let mut i = self.heads[self.bucket(key)];
                    while i != NONE {
                        let entry = &self.entries[i as usize];
                        if entry.key == key {
                            let way = between(from.at, entry.at);
                            let square = dot(way, way);
                            if square <= most && entry.faces_with(&from.normal) && test(i, entry.at, square) {
                                return true;
                            }
                        }
                        i = entry.next;
                    }
                }
            }
        }
        false
    }

    #[expect(clippy::cast_possible_truncation, reason = "saturates for extreme coordinates")]
    fn cell(&self, at: [f64; 3]) -> [i64; 3] {
        at.map(|x| (x / (SIDE * self.radius)).floor() as i64)
    }

    #[expect(clippy::cast_possible_truncation, reason = "the number of buckets fits")]
    fn bucket(&self, key: u64) -> usize {
        // Fibonacci hashing for rows of cells; the cells of a row follow each other in memory.
        let row = (key >> BITS).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
        (row + (key & MASK)) as usize & (self.heads.len() - 1)
    }
}

/// Bits of each number of a cell that a key holds.
const BITS: u32 = 21;
const MASK: u64 = (1 << BITS) - 1;

/// Packs the lower bits of the numbers of a cell. Keys of cells near each other differ.
fn key(cell: [i64; 3]) -> u64 {
    let [x, y, z] = cell.map(|x| x.cast_unsigned() & MASK);
    x | y << BITS | z << (2 * BITS)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Visits are those of a loop over all sites, also far from the origin and after removals.
    #[test]
    fn every_neighbour_is_visited_once() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut visits = 0;
        for (centre, radius) in [(0.0, 0.1), (-3e6, 0.07), (1e9, 0.2), (0.0, 5.0)] {
            let mut site = || Site {
                at: [0; 3].map(|_| centre + rng.random::<f64>()),
                normal: [[0.0, 0.0, 1.0], [0.0, 0.6, -0.8], [0.0; 3]][rng.random_range(0..3)],
            };
            let sites: Vec<Site> = (0..700).map(|_| site()).collect();
            let mut cells = Cells::new(0.3 * radius, 10);
            sites.iter().for_each(|site| cells.add(*site));
            cells.resize(radius);
            let is_there = |i: usize| i % 3 != 1;
            (0..700).filter(|i| !is_there(*i as usize)).for_each(|i| cells.remove(i));
            for from in &sites {
                let mut found = Vec::new();
                assert!(!cells.any_near(from, |i, near, square| {
                    assert_eq!(near, sites[i as usize].at);
                    found.push((i as usize, square));
                    false
                }));
                found.sort_by_key(|(i, _)| *i);
                let square = |to: &Site| (0..3).map(|k| (to.at[k] - from.at[k]).powi(2)).sum::<f64>();
                let angle = |to: &Site| (0..3).map(|k| to.normal[k] * from.normal[k]).sum::<f32>();
                let near = |to: &Site| square(to) <= radius * radius && angle(to) >= -0.5;
                let all = sites.iter().enumerate().filter(|(i, to)| is_there(*i) && near(to));
                assert_eq!(found, all.map(|(i, to)| (i, square(to))).collect::<Vec<_>>());
                visits += found.len();
            }
        }
        assert!(visits > 100_000, "{visits} visits");
    }
}
