//! The graph of a walker's steps: places of a lattice, joined where an avatar walks from one to the
//! next.
//!
//! A node is a state of a [`Walker`]: its place and its footing, on which the next step depends. An
//! edge is simulated by the walker itself, so each one can be walked.

use crate::lattice::StepGrid;
use crate::map::{SliceMap, Unloaded};
use crate::walk::Walker;
use crate::walk_error::WalkError;
use crate::{Avatar, Back};

/// The greatest number of states of a search, which take some 4 GB.
const MOST_NODES: usize = 1 << 26;

/// The greatest number of pixels under bases at all places of a lattice, a search of minutes.
const MOST_WORK: u64 = 1 << 36;

/// Cells along a side of a tile, and the greatest number of tiles.
const TILE: u32 = 64;
const MOST_TILES: u64 = 1 << 24;

/// The absence of a node.
const NONE: u32 = u32::MAX;

/// The eight neighbours.
const DIRECTIONS: [[i32; 2]; 8] = [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]];

/// A state of the walker on the lattice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    /// Column and row.
    pub(crate) cell: [u32; 2],
    /// Height of the feet, in the map's coordinates.
    pub(crate) height: f64,
    footing: f64,
    /// The next node of the same cell.
    next: u32,
}

/// An edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    /// The node that it leads to.
    pub(crate) node: u32,
    /// Its horizontal length.
    pub(crate) length: f64,
    /// `true` if the node was not known before.
    pub(crate) is_new: bool,
}

/// The explored part of the graph.
#[derive(Debug)]
pub(crate) struct Steps<'a> {
    map: &'a SliceMap,
    avatar: Avatar,
    /// The places of nodes.
    pub(crate) lattice: StepGrid,
    falls: bool,
    nodes: Vec<Node>,
    /// The number of nodes that are more than a climb away from all earlier nodes of their cell.
    places: usize,
    /// The first node of each cell, tile by tile; tiles without nodes take no memory.
    tiles: Vec<Option<Box<[u32]>>>,
    tile_columns: usize,
}

impl<'a> Steps<'a> {
    /// Returns the graph of an avatar in a map, with nothing explored yet. With `falls` an edge may
    /// include a fall.
    pub(crate) fn new(map: &'a SliceMap, avatar: Avatar, falls: bool) -> Result<Self, WalkError> {
        let step = avatar.stride().1;
        let lattice = StepGrid::new(map.grid(), &avatar, step);
        let [columns, rows] = lattice.counts.map(|count| count.div_ceil(u64::from(TILE)));
        let tiles = columns.saturating_mul(rows);
        let most = usize::try_from(tiles).ok().filter(|_| tiles <= MOST_TILES && columns <= MOST_TILES);
        let Some(tiles) = most else {
            return Err(WalkError::TooManyPlaces { limit: MOST_NODES, step });
        };
        let pixels = avatar.most_pixels(map.grid());
        let places = lattice.counts[0].saturating_mul(lattice.counts[1]);
        if places.saturating_mul(pixels) > MOST_WORK {
            return Err(WalkError::TooMuchWork { places, pixels });
        }
        let tile_columns = usize::try_from(columns).unwrap_or(usize::MAX);
        Ok(Self {
            map,
            avatar,
            lattice,
            falls,
            nodes: Vec::new(),
            places: 0,
            tiles: vec![None; tiles],
            tile_columns,
        })
    }

    /// Returns all known nodes, in the order in which they were found.
    pub(crate) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Returns the number of known places. Heights within a climb of each other are one place.
    pub(crate) fn places(&self) -> usize {
        self.places
    }

    /// Returns the walker that is in the state of a node.
    pub(crate) fn walker(&self, node: u32) -> Walker {
        let Node { cell, height, footing, .. } = self.nodes[node as usize];
        let [x, y] = self.lattice.place(cell);
        Walker::resumed(self.avatar, [x, y, height], footing)
    }

    /// Returns `true` if the avatar is known to stand at this height of a cell.
    pub(crate) fn knows(&self, cell: [u32; 2], height: f64) -> bool {
        let (tile, place) = self.tile_of(cell);
        let mut node = self.tiles[tile].as_ref().map_or(NONE, |tile| tile[place]);
        while let Some(found) = self.nodes.get(node as usize) {
            if found.height.to_bits() == height.to_bits() {
                return true;
            }
            node = found.next;
        }
        false
    }

    fn tile_of(&self, [column, row]: [u32; 2]) -> (usize, usize) {
        let tile = (row / TILE) as usize * self.tile_columns + (column / TILE) as usize;
        (tile, (row % TILE * TILE + column % TILE) as usize)
    }

    /// Returns the node of a walker that stands on a cell, and whether it is new.
    pub(crate) fn node(&mut self, cell: [u32; 2], walker: &Walker) -> Result<(u32, bool), WalkError> {
        let (height, footing) = (walker.feet(), walker.footing());
        let (tile, place) = self.tile_of(cell);
        let tile =
            self.tiles[tile].get_or_insert_with(|| vec![NONE; (TILE * TILE) as usize].into_boxed_slice());
        let mut node = tile[place];
        let (climb, mut is_place) = (self.avatar.options().climb, true);
        while let Some(found) = self.nodes.get(node as usize) {
            is_place &= (found.height - height).abs() > climb;
            if found.height.to_bits() == height.to_bits() && found.footing.to_bits() == footing.to_bits() {
                return Ok((node, false));
            }
            node = found.next;
        }
        if self.nodes.len() >= MOST_NODES {
            return Err(WalkError::TooManyPlaces { limit: MOST_NODES, step: self.lattice.spacing });
        }
        let index = u32::try_from(self.nodes.len()).unwrap_or(NONE);
        self.nodes.push(Node { cell, height, footing, next: tile[place] });
        tile[place] = index;
        self.places += usize::from(is_place);
        Ok((index, true))
    }

    /// Returns the state of a walker after it walks straight to a place, in the map's horizontal
    /// coordinates; `None` if it does not arrive.
    pub(crate) fn straight(&self, walker: &Walker, to: [f64; 2]) -> Result<Option<Walker>, Unloaded> {
        straight(self.map, walker, to, self.falls, |_| ())
    }

    /// Collects the edges from a walker at any place to the corners of its cell of the lattice.
    pub(crate) fn enter(&mut self, walker: &Walker, edges: &mut Vec<Edge>) -> Result<(), WalkError> {
        let [x, y, _] = walker.place();
        edges.clear();
        for cell in self.lattice.corners([x, y]) {
            self.join(walker, cell, edges)?;
        }
        Ok(())
    }

    /// Collects the edges from a node to its neighbours.
    pub(crate) fn leave(&mut self, node: u32, edges: &mut Vec<Edge>) -> Result<(), WalkError> {
        let (walker, from) = (self.walker(node), self.nodes[node as usize].cell);
        edges.clear();
        let lattice = self.lattice;
        for cell in DIRECTIONS.into_iter().filter_map(|way| lattice.neighbour(from, way)) {
            self.join(&walker, cell, edges)?;
        }
        Ok(())
    }

    fn join(&mut self, walker: &Walker, cell: [u32; 2], edges: &mut Vec<Edge>) -> Result<(), WalkError> {
        let to = self.lattice.place(cell);
        if let Some(arrived) = self.straight(walker, to)? {
            let (node, is_new) = self.node(cell, &arrived)?;
            let [x, y, _] = walker.place();
            edges.push(Edge { node, length: (to[0] - x).hypot(to[1] - y), is_new });
        }
        Ok(())
    }

    /// Explores everything that can be reached from the nodes of `edges`. Passes the number of
    /// explored places to `told`, again and again.
    pub(crate) fn flood(
        &mut self,
        mut edges: Vec<Edge>,
        told: &mut dyn FnMut(usize),
    ) -> Result<(), WalkError> {
        let mut open: Vec<u32> = edges.iter().filter(|edge| edge.is_new).map(|edge| edge.node).collect();
        while let Some(node) = open.pop() {
            self.leave(node, &mut edges)?;
            open.extend(edges.iter().filter(|edge| edge.is_new).map(|edge| edge.node));
            let explored = self.nodes.len() - open.len();
            told(self.places * explored / self.nodes.len().max(1));
        }
        Ok(())
    }
}

/// Walks straight to a place, in the map's horizontal coordinates, as
/// [`Route::follow`](crate::Route::follow) does, and passes every state on the way to `each`.
/// Returns `None` if anything is in the way, if the walker falls without `falls`, or if it leaves
/// the map.
pub(crate) fn straight(
    map: &SliceMap,
    walker: &Walker,
    to: [f64; 2],
    falls: bool,
    mut each: impl FnMut(&Walker),
) -> Result<Option<Walker>, Unloaded> {
    let grid = map.grid();
    let target = grid.up.across(to);
    let mut walker = *walker;
    while !walker.is_at(grid, target) || walker.is_falling() {
        let before = walker;
        let step = walker.step(map, target, &Back)?;
        let is_lost = walker.feet() < grid.origin[2] - walker.climb();
        let is_stuck = walker == before || (walker.creeps(&before) && !walker.is_at(grid, target));
        if step.blocked || (step.falling && !falls) || is_lost || is_stuck {
            return Ok(None);
        }
        each(&walker);
    }
    Ok(Some(walker))
}
