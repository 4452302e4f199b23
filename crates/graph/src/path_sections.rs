//! Storage of close pairs and coarser levels in a container, and the validation of loaded ones.

use bytemuck::Pod;
use nearmiss_store::{Array, Check, File, Flaw, LoadError, OpenError, WriteError, Writer};

use crate::Adjacency;
use crate::close_list::{BESIDE, is_floor, pack, rounded};
use crate::close_pairs::ClosePairs;
use crate::levels::{LevelCells, Levels};
use crate::sanity::ListNames;

/// Part 0 belongs to the points, part k to the cells of level k.
const LIST_STARTS: [u8; 4] = *b"CPST";
const FLOORS: [u8; 4] = *b"CPFL";
const OFFSETS: [u8; 4] = *b"CPOF";
const CODES: [u8; 4] = *b"CPDI";
const BESIDES: [u8; 4] = *b"CPBS";
const ONWARD: [u8; 4] = *b"CPON";
/// Part k maps the previous level to level k.
const OWNERS: [u8; 4] = *b"CELL";
const TO_CENTRE: [u8; 4] = *b"CDST";
const INWARDS: [u8; 4] = *b"CWAY";
const CENTRES: [u8; 4] = *b"CNTR";
const STARTS: [u8; 4] = *b"CEST";
const NEIGHBOURS: [u8; 4] = *b"CEDG";
const LENGTHS: [u8; 4] = *b"CLEN";
const CROSSINGS: [u8; 4] = *b"CCRS";
const RADII: [u8; 4] = *b"CRAD";

const LISTS: &str = "lists of close pairs";
const LIST: &str = "the list of close pairs of point";
const CELL: &str = "the cell of point";
const EDGES: ListNames = ListNames { array: "edges of cells", item: "the edges of cell" };

impl ClosePairs {
    /// Adds the arrays to a container; `part` distinguishes several maps.
    ///
    /// # Errors
    /// Fails if the container already has sections of these names.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>, part: u32) -> Result<(), WriteError> {
        writer
            .section(LIST_STARTS, part, &self.starts)?
            .section(FLOORS, part, &self.floors)?
            .section(OFFSETS, part, &self.offsets)?
            .section(CODES, part, &self.codes)?
            .section(BESIDES, part, &self.beside)?;
        if !self.onward.is_empty() {
            writer.section(ONWARD, part, &self.onward)?;
        }
        Ok(())
    }

    /// Loads the map of `points` points with these support radii from `file`. Arrays stay in the
    /// file.
    ///
    /// With either `check` the structure of the lists is validated, so that no method fails
    /// afterwards. [`Check::Full`] also validates the contents: a list names existing points in
    /// ascending distance, begins with the point itself, and ends within the support radii. Only
    /// pairs that do not fit into the entries of the list may be stored separately.
    ///
    /// # Errors
    /// Fails if a section is missing, holds values that no build writes, or contradicts another
    /// section.
    pub fn load(
        file: &File,
        part: u32,
        (points, support_radius): (usize, impl Fn(usize) -> f32),
        check: Check,
    ) -> Result<Self, LoadError> {
        let onward = if file.has(ONWARD, part) { file.array(ONWARD, part)? } else { Array::default() };
        let map = Self {
            starts: file.array(LIST_STARTS, part)?,
            floors: file.array(FLOORS, part)?,
            offsets: file.array(OFFSETS, part)?,
            codes: file.array(CODES, part)?,
            beside: file.array(BESIDES, part)?,
            onward,
        };
        map.check_structure(points)?;
        if check == Check::Full {
            map.check_contents(points, support_radius)?;
        }
        Ok(map)
    }

    fn check_structure(&self, points: usize) -> Result<(), Flaw> {
        Flaw::length(LISTS, self.starts.len(), points + 1)?;
        Flaw::length(LISTS, self.pair_count(), self.starts[points] as usize)?;
        Flaw::length("distances of close pairs", self.codes.len(), self.pair_count())?;
        if !self.onward.is_empty() {
            Flaw::length("steps of paths", self.onward.len(), self.pair_count())?;
        }
        // With valid floors, every code is a valid distance.
        Flaw::length("floors of close pairs", self.floors.len(), points)?;
        Flaw::first(LIST, self.floors.iter().position(|&floor| !is_floor(floor)))?;
        let starts: &[u32] = &self.starts;
        let descends = starts.windows(2).position(|two| two[0] > two[1]);
        Flaw::first(LIST, descends.or((starts[0] != 0).then_some(0)))
    }

    fn check_contents(&self, points: usize, support_radius: impl Fn(usize) -> f32) -> Result<(), Flaw> {
        let (view, floors): (_, &[u8]) = (self.view(), &self.floors);
        let mut beside = self.beside.iter();
        for (i, own) in (0..self.len()).zip(0..) {
            let (pairs, mut before) = (self.starts[i]..self.starts[i + 1], 0.0);
            let mut is_sound = !pairs.is_empty();
            for (pair, close) in pairs.clone().zip(view.of(i)) {
                if self.offsets[pair as usize] == BESIDE {
                    let fits = pack(own, floors[i], close).0 != BESIDE;
                    is_sound &= beside.next().is_some_and(|b| b.pair == pair) && !fits;
                }
                let point = close.point as usize;
                let is_within = point < points && close.distance <= rounded(support_radius(point));
                let is_own = close.point == own && close.distance.to_bits() == 0;
                let is_first = pair == pairs.start;
                is_sound &= (is_within || is_own) && is_own == is_first && before <= close.distance;
                before = close.distance;
            }
            Flaw::first(LIST, (!is_sound).then_some(i))?;
        }
        Flaw::length("close pairs stored separately", self.beside.len(), self.beside.len() - beside.len())
    }
}

fn put<'a, T: Pod>(
    writer: &mut Writer<'a>,
    tag: [u8; 4],
    part: u32,
    array: &'a [T],
) -> Result<(), WriteError> {
    writer.section(tag, part, array).map(|_| ())
}

impl Levels {
    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// Fails if the container already has sections of these names.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        for (part, cells) in (1..).zip(&self.cells) {
            put(writer, OWNERS, part, &cells.owner)?;
            put(writer, TO_CENTRE, part, &cells.to_centre)?;
            put(writer, INWARDS, part, &cells.inwards)?;
            put(writer, CENTRES, part, &cells.centres)?;
            put(writer, STARTS, part, &cells.graph.starts)?;
            put(writer, NEIGHBOURS, part, &cells.graph.neighbours)?;
            put(writer, LENGTHS, part, &cells.lengths)?;
            put(writer, CROSSINGS, part, &cells.crossings)?;
            put(writer, RADII, part, &cells.radii)?;
        }
        Ok(())
    }

    /// Loads the levels over `points` points from `file` without copying arrays.
    ///
    /// With either `check`, validates what searches rely on: all indices are in range, every path
    /// inwards ends at the centre of its cell, and every edge leads from one of its cells to the
    /// other. [`Check::Full`] also validates the distances.
    ///
    /// # Errors
    /// Fails if a section is missing, holds values that no build writes, or contradicts another
    /// section.
    pub fn load(file: &File, points: usize, check: Check) -> Result<Self, LoadError> {
        let mut cells: Vec<LevelCells> = Vec::new();
        let mut finer = points;
        for part in (1..).take_while(|&part| file.has(OWNERS, part)) {
            let mut next = load_cells(file, part)?;
            next.check_structure(finer)?;
            if check == Check::Full {
                next.check_contents()?;
            }
            // Each level must be smaller than the previous one, so that the number of levels is
            // bounded.
            if next.len() >= finer {
                return Err(Flaw::Metadata { what: "the number of cells" }.into());
            }
            finer = next.len();
            next.find_points(cells.last());
            cells.push(next);
        }
        Ok(Self { cells })
    }
}

fn load_cells(file: &File, part: u32) -> Result<LevelCells, OpenError> {
    Ok(LevelCells {
        owner: file.array(OWNERS, part)?,
        to_centre: file.array(TO_CENTRE, part)?,
        inwards: file.array(INWARDS, part)?,
        centres: file.array(CENTRES, part)?,
        points: Vec::new(),
        graph: Adjacency { starts: file.array(STARTS, part)?, neighbours: file.array(NEIGHBOURS, part)? },
        lengths: file.array(LENGTHS, part)?,
        crossings: file.array(CROSSINGS, part)?,
        radii: file.array(RADII, part)?,
    })
}

impl LevelCells {
    fn check_structure(&self, finer: usize) -> Result<(), Flaw> {
        Flaw::length("cells", self.owner.len(), finer)?;
        Flaw::length("distances within cells", self.to_centre.len(), finer)?;
        Flaw::length("paths within cells", self.inwards.len(), finer)?;
        Flaw::length("radii of cells", self.radii.len(), self.len())?;
        self.graph.check_structure(self.len(), EDGES)?;
        Flaw::length("lengths of edges between cells", self.lengths.len(), self.graph.neighbours.len())?;
        Flaw::length("crossings between cells", self.crossings.len(), self.graph.neighbours.len())?;
        let (owner, inwards, centres): (&[u32], &[u32], &[u32]) = (&self.owner, &self.inwards, &self.centres);
        let is_owned = |point: u32, cell: u32| owner.get(point as usize) == Some(&cell);
        let stray = (0..)
            .zip(centres)
            .position(|(cell, &centre)| !is_owned(centre, cell) || inwards[centre as usize] != centre);
        Flaw::first("the centre of cell", stray)?;
        // A path inwards must get nearer with every step, so that it ends, and may only end at a
        // centre.
        let to_centre: &[f32] = &self.to_centre;
        let lost = (0..).zip(owner).position(|(point, &cell)| {
            let next = inwards[point as usize];
            let ends = next == point;
            let goes = is_owned(next, cell) && to_centre[next as usize] < to_centre[point as usize];
            let is_centre = centres.get(cell as usize) == Some(&point);
            !(if ends { is_centre } else { goes })
        });
        Flaw::first(CELL, lost)?;
        let mut crossings = self.crossings.iter();
        let (starts, neighbours) = self.graph.slices();
        let wrong = (0_u32..).zip(starts.windows(2)).position(|(cell, two)| {
            let others = &neighbours[two[0] as usize..two[1] as usize];
            others
                .iter()
                .zip(&mut crossings)
                .any(|(&other, &[near, far])| !is_owned(near, cell) || !is_owned(far, other))
        });
        Flaw::first(EDGES.item, wrong)
    }

    fn check_contents(&self) -> Result<(), Flaw> {
        let is_length = |d: &f32| d.is_finite() && *d >= 0.0;
        Flaw::first(CELL, self.to_centre.iter().position(|d| !is_length(d)))?;
        Flaw::first("the length of edge", self.lengths.iter().position(|d| !is_length(d)))?;
        Flaw::first("the radius of cell", self.radii.iter().position(|r| !is_length(r)))
    }
}
