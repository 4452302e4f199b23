//! The reach of an avatar: all places that it can walk to, found by a flood fill over the walker's
//! steps.
//!
//! The steps follow R. K. dos Anjos, J. M. Pereira, J. F. Oliveira, WSCG 2012.

use std::collections::BTreeSet;

use nearmiss_geometry::Aabb;

use crate::avatar::Avatar;
use crate::floors::{Storey, storey_of};
use crate::lattice::StepGrid;
use crate::map::SliceMap;
use crate::standing::Standing;
use crate::steps::Steps;
use crate::walk::Walker;
use crate::walk_error::WalkError;
use crate::{Grid, Up};

/// The places that an avatar can walk to from a start.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    up: Up,
    lattice: StepGrid,
    /// Column, row and height, sorted.
    places: Vec<([u32; 2], f64)>,
}

/// The part of a reach that lies on a storey.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Covered {
    /// Number of places of the lattice; places above each other on the same storey count once.
    pub places: u64,
    /// Their area, in square units of the input.
    pub area: f64,
}

impl Reach {
    /// Finds the reach of a walker.
    ///
    /// The places are those of the [`StepGrid`] whose spacing is the avatar's step, at the heights
    /// at which the avatar arrives there. From the start the avatar walks to the corners of its
    /// cell, then from each place to its eight neighbours, by [`Walker::step`]. Without `falls` it
    /// walks only where something supports it at every step. With `falls` it may also fall, if it
    /// lands on something.
    ///
    /// Takes about ten steps of a walker for each place and each footing of it.
    ///
    /// # Errors
    /// If there are more than 2^26 places, or a slice is not loaded.
    pub fn new(map: &SliceMap, start: &Walker, falls: bool) -> Result<Self, WalkError> {
        Self::new_watched(map, start, falls, &mut |_| ())
    }

    /// Like [`Reach::new`], and passes the number of explored places to `told`, again and
    /// again. Places of a cell within a climb of each other count once. There are at most about
    /// [`Avatar::estimated_places`].
    ///
    /// # Errors
    /// As for [`Reach::new`].
    pub fn new_watched(
        map: &SliceMap,
        start: &Walker,
        falls: bool,
        told: &mut dyn FnMut(usize),
    ) -> Result<Self, WalkError> {
        let mut steps = Steps::new(map, *start.avatar(), falls)?;
        let mut edges = Vec::new();
        steps.enter(start, &mut edges)?;
        steps.flood(edges, told)?;
        Ok(Self::of(map.grid(), &steps))
    }

    pub(crate) fn of(grid: &Grid, steps: &Steps<'_>) -> Self {
        let mut places: Vec<([u32; 2], f64)> =
            steps.nodes().iter().map(|node| (node.cell, node.height)).collect();
        places.sort_by(|(a, z), (b, w)| [a[1], a[0]].cmp(&[b[1], b[0]]).then(z.total_cmp(w)));
        places.dedup();
        Self { up: grid.up, lattice: steps.lattice, places }
    }

    /// Returns the lattice of the places.
    #[must_use]
    pub fn lattice(&self) -> &StepGrid {
        &self.lattice
    }

    /// Returns the number of places.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Returns `true` if no place is within reach.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Returns the column and row of each place, with the height of the feet there in the map's
    /// coordinates; sorted by rows, then columns, then heights.
    #[must_use]
    pub fn cells(&self) -> impl ExactSizeIterator<Item = ([u32; 2], f64)> + '_ {
        self.places.iter().copied()
    }

    /// Returns the places of the feet, in the caller's coordinates, in the order of
    /// [`Reach::cells`].
    #[must_use]
    pub fn positions(&self) -> impl ExactSizeIterator<Item = [f64; 3]> + '_ {
        self.places.iter().map(|(cell, height)| {
            let [x, y] = self.lattice.place(*cell);
            self.up.from_map([x, y, *height])
        })
    }

    /// Returns the bounds of the places, in the caller's coordinates, or `None` without places.
    #[must_use]
    pub fn bounds(&self) -> Option<Aabb> {
        (!self.is_empty()).then(|| Aabb::of(self.positions()))
    }

    /// Returns the part of the reach on each of these storeys, or a single part for all if there
    /// are no storeys.
    #[must_use]
    pub fn by_storey(&self, storeys: &[Storey]) -> Vec<Covered> {
        let mut found = vec![Covered::default(); storeys.len().max(1)];
        let mut before: Vec<Option<[u32; 2]>> = vec![None; found.len()];
        for (cell, height) in self.cells() {
            let storey = storey_of(storeys, height).unwrap_or(0);
            if before[storey].replace(cell) != Some(cell) {
                found[storey].places += 1;
            }
        }
        for covered in &mut found {
            #[expect(clippy::cast_precision_loss, reason = "places, below 2^53")]
            let places = covered.places as f64;
            covered.area = places * self.lattice.spacing * self.lattice.spacing;
        }
        found
    }
}

/// The golden ratio less one. Its multiples, modulo one, cover the unit interval evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The number of cells at which [`Avatar::estimated_places`] looks.
const LOOKS: u64 = 1024;

impl Avatar {
    /// Estimates the number of places of the lattice of [`Reach`] at which the avatar can stand, from
    /// about a thousand cells. To tell the progress of a search.
    ///
    /// # Errors
    /// If there are more than 2^26 places, or a slice is not loaded.
    pub fn estimated_places(&self, map: &SliceMap) -> Result<f64, WalkError> {
        let lattice = Steps::new(map, *self, false)?.lattice;
        let [columns, rows] = lattice.counts;
        let cells = columns.saturating_mul(rows);
        // Neighbouring cells have much in common, so the cells that are looked at are far apart:
        // they step by the golden ratio.
        let looks = cells.min(LOOKS);
        let (mut heights, mut found) = (Vec::new(), 0);
        for look in 0..looks {
            #[expect(
                clippy::cast_precision_loss,
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a cell of the lattice, below 2^53"
            )]
            let cell = ((look as f64 * GOLDEN).fract() * cells as f64) as u64;
            let cell = [cell % columns, cell / columns].map(|k| u32::try_from(k).unwrap_or(u32::MAX));
            self.standing_heights(map, lattice.place(cell), &mut heights)?;
            found += heights.len();
        }
        #[expect(clippy::cast_precision_loss, reason = "an estimate")]
        let share = found as f64 / looks.max(1) as f64;
        #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
        let cells = cells as f64;
        Ok(share * cells)
    }

    /// Finds a good place to start: the place nearest to the middle of the largest connected part
    /// of the lowest storey. Returns `None` if the avatar can stand nowhere. The distance of the
    /// result is 0.
    ///
    /// Takes as long as [`Reach::new`] for all parts together.
    ///
    /// # Errors
    /// If there are more than 2^26 places, or a slice is not loaded.
    pub fn roomy_start(&self, map: &SliceMap, storeys: &[Storey]) -> Result<Option<Standing>, WalkError> {
        self.roomy_start_watched(map, storeys, &mut |_| ())
    }

    /// Like [`Avatar::roomy_start`], and passes the number of explored places to `told`, as
    /// [`Reach::new_watched`] does.
    ///
    /// # Errors
    /// As for [`Avatar::roomy_start`].
    pub fn roomy_start_watched(
        &self,
        map: &SliceMap,
        storeys: &[Storey],
        told: &mut dyn FnMut(usize),
    ) -> Result<Option<Standing>, WalkError> {
        let mut heights = Vec::new();
        let range = storeys.first().map_or([f64::NEG_INFINITY, f64::INFINITY], |storey| storey.heights);
        let is_lowest = |height: f64| range[0] <= height && height < range[1];
        let mut steps = Steps::new(map, *self, false)?;
        let (lattice, mut parts) = (steps.lattice, Vec::new());
        let [columns, rows] = lattice.counts.map(|count| u32::try_from(count).unwrap_or(u32::MAX));
        for row in 0..rows {
            for column in 0..columns {
                let [x, y] = lattice.place([column, row]);
                self.standing_heights(map, [x, y], &mut heights)?;
                for &height in heights.iter().filter(|height| is_lowest(**height)) {
                    if steps.knows([column, row], height) {
                        continue;
                    }
                    let first = steps.nodes().len();
                    let walker = Walker::new(*self, map, map.grid().up.from_map([x, y, height]))?;
                    let (node, _) = steps.node([column, row], &walker)?;
                    let mut edges = Vec::new();
                    steps.leave(node, &mut edges)?;
                    steps.flood(edges, told)?;
                    parts.push(first..steps.nodes().len());
                }
            }
        }
        let cells_of = |part: &std::ops::Range<usize>| {
            let nodes = steps.nodes()[part.clone()].iter().filter(|node| is_lowest(node.height));
            nodes.map(|node| node.cell).collect::<BTreeSet<_>>()
        };
        // The first of several parts of the same size.
        let largest = parts.iter().rev().max_by_key(|part| cells_of(part).len());
        let Some(largest) = largest else {
            return Ok(None);
        };
        let places = cells_of(largest).into_iter().map(|cell| lattice.place(cell));
        let (mut sum, mut count) = ([0.0; 2], 0.0);
        for place in places {
            sum = [0, 1].map(|k| sum[k] + place[k]);
            count += 1.0;
        }
        let middle = sum.map(|sum| sum / count);
        let nodes = steps.nodes()[largest.clone()].iter().filter(|node| is_lowest(node.height));
        let mut candidates: Vec<(f64, [f64; 3])> = nodes
            .map(|node| {
                let [x, y] = lattice.place(node.cell);
                ((x - middle[0]).hypot(y - middle[1]), [x, y, node.height])
            })
            .collect();
        candidates.sort_by(|(a, p), (b, q)| a.total_cmp(b).then(p[2].total_cmp(&q[2])));
        for (_, place) in candidates {
            if self.rests(map, place)? {
                return Ok(Some(Standing { position: map.grid().up.from_map(place), distance: 0.0 }));
            }
        }
        Ok(None)
    }
}
