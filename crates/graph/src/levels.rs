//! Coarser graphs over nested subsets of the points, for distances and paths of any length.
//!
//! Each level selects centres among the points of the finer level. The minimum distance of centres
//! along the graph doubles from level to level, and every other point is within that distance of a
//! centre. Each point belongs to the cell of its nearest centre (a Voronoi diagram along the
//! graph). Two cells are adjacent if an edge joins them. The length of their edge is that of the
//! shortest path between their centres through one such edge. That edge is stored, so a path
//! between centres expands to a path of points. A shortest path is first searched among the few
//! cells of the coarsest level. Each finer level is then searched only in the cells near the
//! previous path.

use nearmiss_lanes::id32;
use nearmiss_store::Array;

use crate::Adjacency;
use crate::geodesic::{GeodesicScratch, Reached};
use crate::length::Network;

/// Distance between centres over the distance of a point's sixth neighbour. A quarter of the points
/// become centres.
const APART: f32 = 1.2;

/// Growth of the distance between centres from level to level.
const GROWTH: f32 = 2.0;

/// Number of cells up to which a level is searched completely and no coarser level is built.
const FEW: usize = 256;

/// A level that keeps more than this share of the points is useless, because components are down to
/// one cell each.
const MOST_KEPT: f64 = 0.7;

/// Relative excess over the shortest path up to which paths on the coarsest level are refined.
const DETOUR: f32 = 0.15;

/// Factor on that excess for each finer level.
const SURER: f32 = 0.4;

/// Rings of cells around the coarser path that are searched as well.
const RINGS: usize = 1;

/// The cells of a level. Their centres are points of the finer level.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelCells {
    /// Cell of each point of the finer level.
    pub(crate) owner: Array<u32>,
    /// Distance of each point of the finer level from the centre of its cell.
    pub(crate) to_centre: Array<f32>,
    /// Next point on the path to the centre; a centre points to itself.
    pub(crate) inwards: Array<u32>,
    /// Centre of each cell, as a point of the finer level.
    pub(crate) centres: Array<u32>,
    /// Adjacency of the cells.
    pub(crate) graph: Adjacency,
    /// Centre of each cell, as a point of the original graph; not stored.
    pub(crate) points: Vec<u32>,
    /// Distances between the centres of adjacent cells.
    pub(crate) lengths: Array<f32>,
    /// The edge of the finer level that joins two adjacent cells: the end in the cell itself, then
    /// the end in the other cell.
    pub(crate) crossings: Array<[u32; 2]>,
    /// Local sampling radius of each centre, doubled with each level.
    pub(crate) radii: Array<f32>,
}

/// Increasingly coarse levels over a graph.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Levels {
    pub(crate) cells: Vec<LevelCells>,
}

/// Scratch memory for searches. Reuse it for later searches.
#[derive(Debug, Clone, Default)]
pub struct LevelScratch {
    search: GeodesicScratch,
    /// Number of the last search that opened each cell.
    open: Vec<u32>,
    number: u32,
    /// Cells that are open in the current search.
    opened: Vec<u32>,
    /// Cells reached from the first end, with their distances.
    far: Vec<Reached>,
    ancestors: Vec<[u32; 2]>,
    reached: usize,
}

impl LevelScratch {
    /// Returns the number of points and cells that the last search reached, on all levels.
    #[must_use]
    pub fn reached(&self) -> usize {
        self.reached
    }

    /// Opens the cells of `graph` in `self.opened`, and the rings around them.
    fn open_about(&mut self, graph: &Adjacency) {
        if self.open.len() < graph.len() {
            self.open.resize(graph.len(), 0);
        }
        self.number = self.number.checked_add(1).unwrap_or_else(|| {
            self.open.fill(0);
            1
        });
        for &cell in &self.opened {
            self.open[cell as usize] = self.number;
        }
        let (starts, neighbours) = graph.slices();
        let mut ring = 0..0;
        for _ in 0..RINGS {
            ring = ring.end..self.opened.len();
            for k in ring.clone() {
                let cell = self.opened[k] as usize;
                for &other in &neighbours[starts[cell] as usize..starts[cell + 1] as usize] {
                    if std::mem::replace(&mut self.open[other as usize], self.number) != self.number {
                        self.opened.push(other);
                    }
                }
            }
        }
    }

    /// Searches from `a` and from `b` through open cells. Replaces `self.opened` by the cells on
    /// paths from `a` to `b` whose length exceeds the shortest by at most the fraction `detour`.
    /// Finer levels decide which of these paths is the shortest.
    fn survey(
        &mut self,
        network: Network<'_>,
        [a, b]: [u32; 2],
        detour: f32,
        is_open: impl Fn(&[u32], u32) -> bool,
    ) -> Option<f32> {
        let open = &self.open[..];
        self.search.search(network, [(a, 0.0)], f32::MAX, |i, _| is_open(open, i), |_| false);
        let shortest = self.search.found(b)?;
        let most = (1.0 + detour) * shortest;
        self.reached += self.search.reached();
        self.far.clear();
        self.far.extend(self.search.all_reached());
        self.search.search(network, [(b, 0.0)], most, |i, _| is_open(open, i), |_| false);
        self.reached += self.search.reached();
        self.opened.clear();
        let ways =
            self.far.iter().filter_map(|far| Some((far.point, far.distance + self.search.found(far.point)?)));
        self.opened.extend(ways.filter(|(_, length)| *length <= most).map(|(cell, _)| cell));
        Some(shortest)
    }
}

impl LevelCells {
    /// Builds the next level over a graph whose points have these local sampling radii. Takes
    /// O(n log n) time on one core.
    fn over(network: Network<'_>, radii: &[f32], scratch: &mut GeodesicScratch) -> Self {
        let centres = centres(network, radii, scratch);
        scratch.search(network, centres.iter().map(|&c| (c, 0.0)), f32::MAX, |_, _| true, |_| false);
        let count = network.len();
        let (mut owner, mut to_centre, mut inwards) = (vec![0; count], vec![0.0; count], vec![0; count]);
        for (cell, &centre) in centres.iter().enumerate() {
            owner[centre as usize] = id32(cell);
        }
        for found in scratch.all_reached() {
            let point = found.point as usize;
            let before = scratch.before(found.point);
            (to_centre[point], inwards[point]) = (found.distance, before);
            owner[point] = owner[before as usize];
        }
        let touching = touching(network, &owner, &to_centre, centres.len());
        let edges: Vec<[u32; 2]> = touching.iter().map(|touch| touch.cells).collect();
        let graph = Adjacency::from_edges(centres.len(), &edges);
        // Sorted like the entries of the graph.
        let mut ends: Vec<Touch> = touching.iter().flat_map(|&touch| [touch, touch.turned()]).collect();
        ends.sort_unstable_by_key(|touch| touch.cells);
        let radii: Vec<f32> = centres.iter().map(|&centre| GROWTH * radii[centre as usize]).collect();
        Self {
            owner: owner.into(),
            to_centre: to_centre.into(),
            inwards: inwards.into(),
            centres: centres.into(),
            points: Vec::new(),
            graph,
            lengths: ends.iter().map(|touch| touch.length).collect::<Vec<f32>>().into(),
            crossings: ends.iter().map(|touch| touch.crossing).collect::<Vec<[u32; 2]>>().into(),
            radii: radii.into(),
        }
    }

    /// Sets `points`, given the finer level.
    pub(crate) fn find_points(&mut self, finer: Option<&Self>) {
        let point = |&id: &u32| finer.map_or(id, |finer| finer.points[id as usize]);
        self.points = self.centres.iter().map(point).collect();
    }

    /// Returns the graph of the cells, with the distances of their centres.
    #[must_use]
    pub fn network(&self) -> Network<'_> {
        Network::new(&self.graph, &self.lengths)
    }

    /// Returns the number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Returns `true` if there are no cells.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.centres.is_empty()
    }

    /// Returns the centre of each cell, as a point of the finer level, ascending.
    #[must_use]
    pub fn centres(&self) -> &[u32] {
        &self.centres
    }

    /// Returns the cell of each point of the finer level.
    #[must_use]
    pub fn owners(&self) -> &[u32] {
        &self.owner
    }

    /// Returns the distance of each point of the finer level from the centre of its cell, along
    /// that level's graph.
    #[must_use]
    pub fn distances(&self) -> &[f32] {
        &self.to_centre
    }

    /// Returns the local sampling radii of the centres, doubled with each level. Times the support
    /// radius in sampling radii, they are the support radii of the cells in the
    /// [`ClosePairs`](crate::ClosePairs) of this level.
    #[must_use]
    pub fn radii(&self) -> &[f32] {
        &self.radii
    }

    /// Returns the size of all arrays in bytes.
    #[must_use]
    pub fn byte_len(&self) -> usize {
        let (starts, neighbours) = self.graph.slices();
        4 * (3 * self.owner.len() + 2 * self.centres.len() + starts.len() + 4 * neighbours.len())
    }

    /// Expands a path of cells to the points of the finer level, from the centre of the first cell
    /// to the centre of the last.
    ///
    /// # Panics
    /// Panics if consecutive `cells` are not adjacent.
    pub fn expand(&self, cells: &[u32], path: &mut Vec<u32>) {
        path.clear();
        path.extend(cells.first().map(|&cell| self.centres[cell as usize]));
        for two in cells.windows(2) {
            self.cross([two[0], two[1]], path);
        }
    }

    /// Appends the path from the centre of one cell, which `path` already ends with, to the centre
    /// of an adjacent cell. Returns the index in `path` of the first point in that cell.
    ///
    /// # Panics
    /// Panics if the cells are not adjacent.
    pub(crate) fn cross(&self, [from, to]: [u32; 2], path: &mut Vec<u32>) -> usize {
        let (starts, neighbours) = self.graph.slices();
        let first = starts[from as usize] as usize;
        let others = &neighbours[first..starts[from as usize + 1] as usize];
        let Ok(place) = others.binary_search(&to) else {
            panic!("expected adjacent cells, got {from} and {to}")
        };
        let [near, far] = self.crossings[first + place];
        // The centre, the last point of the walk inwards, is already in `path`.
        let first = path.len();
        self.walk_in(near, path);
        path.pop();
        path[first..].reverse();
        let crossed = path.len();
        self.walk_in(far, path);
        crossed
    }

    /// Appends the points from `point` to the centre of its cell.
    fn walk_in(&self, mut point: u32, path: &mut Vec<u32>) {
        path.push(point);
        while self.inwards[point as usize] != point {
            point = self.inwards[point as usize];
            path.push(point);
        }
    }
}

/// Selects, in order, each point that is not nearer to an earlier centre than that centre's own
/// minimum distance.
fn centres(network: Network<'_>, radii: &[f32], scratch: &mut GeodesicScratch) -> Vec<u32> {
    let mut is_near = vec![false; network.len()];
    let mut centres = Vec::new();
    for point in 0..id32(network.len()) {
        if is_near[point as usize] {
            continue;
        }
        centres.push(point);
        let apart = APART * radii[point as usize];
        for found in scratch.within(network, point, apart) {
            is_near[found.point as usize] |= found.distance < apart;
        }
    }
    centres
}

/// Two adjacent cells.
#[derive(Debug, Clone, Copy)]
struct Touch {
    cells: [u32; 2],
    length: f32,
    crossing: [u32; 2],
}

impl Touch {
    fn turned(self) -> Self {
        let ([a, b], [u, v]) = (self.cells, self.crossing);
        Self { cells: [b, a], crossing: [v, u], ..self }
    }
}

/// Returns all pairs of adjacent cells, the lesser cell first, ascending, each with its shortest
/// path. Of equally short paths the first counts.
fn touching(network: Network<'_>, owner: &[u32], to_centre: &[f32], cells: usize) -> Vec<Touch> {
    let mut starts = vec![0_u32; cells + 1];
    for cell in owner {
        starts[*cell as usize + 1] += 1;
    }
    for cell in 0..cells {
        starts[cell + 1] += starts[cell];
    }
    let mut members = vec![0_u32; owner.len()];
    let mut next = starts.clone();
    for (point, cell) in (0..).zip(owner) {
        members[next[*cell as usize] as usize] = point;
        next[*cell as usize] += 1;
    }
    let mut all: Vec<Touch> = Vec::new();
    // Index in `all` of the pair of the current cell with each other cell.
    let mut place = vec![usize::MAX; cells];
    for cell in 0..id32(cells) {
        let first = all.len();
        for &near in &members[starts[cell as usize] as usize..starts[cell as usize + 1] as usize] {
            for (far, edge) in network.edges(near as usize) {
                let other = owner[far as usize];
                if other <= cell {
                    continue;
                }
                let length = to_centre[near as usize] + to_centre[far as usize] + edge;
                let touch = Touch { cells: [cell, other], length, crossing: [near, far] };
                let known = &mut place[other as usize];
                if *known == usize::MAX || *known < first {
                    *known = all.len();
                    all.push(touch);
                } else if length < all[*known].length {
                    all[*known] = touch;
                }
            }
        }
        all[first..].sort_unstable_by_key(|touch| touch.cells[1]);
    }
    all
}

impl Levels {
    /// Builds the levels over a graph whose points have these local sampling radii, such as the
    /// distances of their sixth neighbours. Stops at a level with few cells. Takes O(n log n) time
    /// and O(n) memory.
    ///
    /// # Panics
    /// Panics if the number of radii differs from the number of points.
    #[must_use]
    pub fn build(network: Network<'_>, radii: &[f32]) -> Self {
        assert_eq!(network.len(), radii.len(), "expected a radius for each point");
        let mut scratch = GeodesicScratch::default();
        let mut cells: Vec<LevelCells> = Vec::new();
        loop {
            let (finer, radii) =
                cells.last().map_or((network, radii), |cells| (cells.network(), &cells.radii));
            if finer.len() <= FEW {
                break;
            }
            let mut next = LevelCells::over(finer, radii, &mut scratch);
            #[expect(clippy::cast_precision_loss, reason = "a share")]
            if next.len() as f64 > MOST_KEPT * finer.len() as f64 {
                break;
            }
            next.find_points(cells.last());
            cells.push(next);
        }
        Self { cells }
    }

    /// Returns the levels, finest first.
    #[must_use]
    pub fn cells(&self) -> &[LevelCells] {
        &self.cells
    }

    /// Returns the size of all arrays in bytes.
    #[must_use]
    pub fn byte_len(&self) -> usize {
        self.cells.iter().map(LevelCells::byte_len).sum()
    }

    /// Returns the length of a path from `a` to `b` in the graph that the levels are over; `None`
    /// if they are not connected.
    ///
    /// The path is the shortest in the cells that were searched. A path elsewhere may be shorter;
    /// `benches` measures by how much.
    ///
    /// # Panics
    /// Panics if `a` or `b` is not a point.
    pub fn distance(&self, network: Network<'_>, a: u32, b: u32, scratch: &mut LevelScratch) -> Option<f32> {
        scratch.reached = 0;
        scratch.ancestors.clear();
        scratch.ancestors.push([a, b]);
        for cells in &self.cells {
            let [a, b] = scratch.ancestors[scratch.ancestors.len() - 1];
            scratch.ancestors.push([cells.owner[a as usize], cells.owner[b as usize]]);
        }
        let coarsest = self.cells.len();
        let mut detour = DETOUR;
        for level in (1..=coarsest).rev() {
            let finer = self.cells[level - 1].network();
            match self.cells.get(level) {
                None => scratch.survey(finer, scratch.ancestors[level], detour, |_, _| true)?,
                Some(cells) => {
                    scratch.open_about(&cells.graph);
                    let (owner, number): (&[u32], _) = (&cells.owner, scratch.number);
                    let is_open = |open: &[u32], i: u32| open[owner[i as usize] as usize] == number;
                    scratch.survey(finer, scratch.ancestors[level], detour, is_open)?
                }
            };
            detour *= SURER;
        }
        match self.cells.first() {
            None => scratch.search.search(network, [(a, 0.0)], f32::MAX, |_, _| true, |i| i == b),
            Some(cells) => {
                scratch.open_about(&cells.graph);
                let (owner, open, number): (&[u32], _, _) = (&cells.owner, &scratch.open, scratch.number);
                let is_open = |i: u32, _: f32| open[owner[i as usize] as usize] == number;
                scratch.search.search(network, [(a, 0.0)], f32::MAX, is_open, |i| i == b);
            }
        }
        scratch.reached += scratch.search.reached();
        scratch.search.found(b)
    }

    /// Returns the length of a path as [`Self::distance`] does, and sets `path` to its points from
    /// `a` to `b`, both included. `path` is empty if `b` cannot be reached.
    ///
    /// # Panics
    /// Panics if `a` or `b` is not a point.
    pub fn path(
        &self,
        network: Network<'_>,
        [a, b]: [u32; 2],
        scratch: &mut LevelScratch,
        path: &mut Vec<u32>,
    ) -> Option<f32> {
        path.clear();
        let distance = self.distance(network, a, b, scratch)?;
        scratch.search.trace(b, path);
        path.reverse();
        Some(distance)
    }
}
