//! Shortest walkable routes: A* over a walker's own steps (P. E. Hart, N. J. Nilsson, B. Raphael,
//! "A Formal Basis for the Heuristic Determination of Minimum Cost Paths", 1968), then shortcuts.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use thiserror::Error;

use crate::avatar::Avatar;
use crate::map::{SliceMap, Unloaded};
use crate::reach::Reach;
use crate::route::Route;
use crate::smooth::{length, smoothed};
use crate::standing::{Standing, StartError};
use crate::steps::{Edge, Steps};
use crate::walk::Walker;
use crate::walk_error::WalkError;

/// A route that was found, which an avatar walks without a stop.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundRoute {
    /// The route.
    pub route: Route,
    /// Its horizontal length.
    pub length: f64,
    /// Horizontal length of the shortest path on the lattice, before smoothing.
    pub lattice_length: f64,
    /// The place where the feet end, in the caller's coordinates.
    pub end: [f64; 3],
    /// Number of explored states of the walker.
    pub visited: usize,
}

/// The reason why there is no route.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RouteError {
    /// The avatar cannot stand at the start.
    #[error("start {0}")]
    Start(StartError),
    /// The avatar cannot stand at the goal. The nearest place that the error names is within reach of
    /// the start.
    #[error("goal {0}")]
    Goal(StartError),
    /// The goal is out of reach.
    #[error(
        "no route from {from:?} to {to:?}: the avatar gets as near as {away}, to {nearest:?}; give another goal, a \
         smaller avatar or a greater climb"
    )]
    NoRoute {
        /// The start, in the caller's coordinates.
        from: [f64; 3],
        /// The goal, in the caller's coordinates.
        to: [f64; 3],
        /// The place within reach that is nearest to the goal, in the caller's coordinates.
        nearest: [f64; 3],
        /// Its distance from the goal.
        away: f64,
    },
    /// There are too many places, or a slice is not loaded.
    #[error(transparent)]
    Walk(#[from] WalkError),
}

impl From<Unloaded> for RouteError {
    fn from(cause: Unloaded) -> Self {
        Self::Walk(cause.into())
    }
}

impl Route {
    /// Finds a short route between two places of the caller's coordinates, both within a climb of a
    /// place to stand.
    ///
    /// The graph is that of [`Reach`](crate::Reach): the places of the
    /// [`StepGrid`](crate::StepGrid) and their eight neighbours. Start and goal are joined to the
    /// corners of their cells, and to each other if they share a cell. Every edge is simulated by
    /// the walker. A* finds the path with the least horizontal length. The path is then smoothed
    /// where the walker confirms a shortcut, so `length ≤ lattice_length`. With `falls` the avatar
    /// may fall on its way.
    ///
    /// Explores no more places than [`Reach::new`](crate::Reach::new), and all of them if there is
    /// no route.
    ///
    /// # Errors
    /// If the avatar cannot stand at the start or at the goal, the goal is out of reach, there are
    /// more than 2^26 places, or a slice is not loaded.
    pub fn find(
        map: &SliceMap,
        avatar: &Avatar,
        [from, to]: [[f64; 3]; 2],
        falls: bool,
    ) -> Result<FoundRoute, RouteError> {
        Self::find_watched(map, avatar, [from, to], falls, &mut |_| ())
    }

    /// Like [`Route::find`], and passes the number of places found so far to `told`, again and
    /// again. There are at most about [`Avatar::estimated_places`].
    ///
    /// # Errors
    /// As for [`Route::find`].
    pub fn find_watched(
        map: &SliceMap,
        avatar: &Avatar,
        [from, to]: [[f64; 3]; 2],
        falls: bool,
        told: &mut dyn FnMut(usize),
    ) -> Result<FoundRoute, RouteError> {
        let start = avatar.placed(map, from).map_err(RouteError::Start)?;
        let goal = match avatar.placed(map, to) {
            Ok(goal) => goal,
            Err(cause) => return Err(RouteError::Goal(with_reach(map, &start, cause, falls, told)?)),
        };
        let mut search = Search::new(map, &start, goal, falls)?;
        search.run(told)?;
        let grid = map.grid();
        let Some(end) = search.end else {
            let (nearest, away) = search.nearest();
            return Err(RouteError::NoRoute { from, to, nearest: grid.up.from_map(nearest), away });
        };
        let path = search.path(&end);
        let lattice_length = length(&path);
        let path = smoothed(map, path, falls)?;
        let points = path[1..].iter().map(|walker| {
            let [x, y, _] = walker.place();
            grid.up.across([x, y])
        });
        Ok(FoundRoute {
            route: Self { start: from, points: points.collect() },
            length: length(&path),
            lattice_length,
            end: end.walker.position(grid),
            visited: search.steps.nodes().len(),
        })
    }
}

/// The error of a goal, with the nearest place that the avatar can walk to from `start`. The nearest
/// place to stand may be the top of a wall.
fn with_reach(
    map: &SliceMap,
    start: &Walker,
    error: StartError,
    falls: bool,
    told: &mut dyn FnMut(usize),
) -> Result<StartError, WalkError> {
    let StartError::Misplaced { place, cause, .. } = error else { return Ok(error) };
    let reach = Reach::new_watched(map, start, falls, told)?;
    let all = std::iter::once(start.position(map.grid())).chain(reach.positions());
    let standing = all.map(|position| {
        let [x, y, z] = [0, 1, 2].map(|k| position[k] - place[k]);
        Standing { position, distance: x.hypot(y).hypot(z) }
    });
    let nearest = standing.min_by(|a, b| a.distance.total_cmp(&b.distance));
    Ok(StartError::Misplaced { place, cause, nearest })
}

/// The absence of a node before.
const NONE: u32 = u32::MAX;

/// The shortest path found to a node so far.
#[derive(Debug, Clone, Copy)]
struct Known {
    /// Length of the shortest path to it.
    length: f64,
    /// The node before it; `NONE` if that is the start.
    before: u32,
}

/// The goal, once it is reached.
#[derive(Debug, Clone, Copy)]
struct End {
    walker: Walker,
    known: Known,
}

/// A node to explore, or the goal.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Open {
    /// Length of the path to it plus the straight line from there to the goal.
    whole: f64,
    length: f64,
    /// `NONE` for the goal.
    node: u32,
}

impl Eq for Open {}

impl Ord for Open {
    /// The shortest path is the greatest. Ties go to the node nearest to the goal, then to the
    /// first.
    fn cmp(&self, other: &Self) -> Ordering {
        let by_whole = other.whole.total_cmp(&self.whole).then(self.length.total_cmp(&other.length));
        by_whole.then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

struct Search<'a> {
    steps: Steps<'a>,
    start: Walker,
    goal: Walker,
    /// An entry for each node of the graph.
    known: Vec<Known>,
    open: BinaryHeap<Open>,
    end: Option<End>,
    edges: Vec<Edge>,
    /// The corners of the goal's cell.
    doorsteps: Vec<[u32; 2]>,
}

impl<'a> Search<'a> {
    fn new(map: &'a SliceMap, start: &Walker, goal: Walker, falls: bool) -> Result<Self, WalkError> {
        let steps = Steps::new(map, *start.avatar(), falls)?;
        let [x, y, _] = goal.place();
        let doorsteps = steps.lattice.corners([x, y]).collect();
        let (known, open, edges) = (Vec::new(), BinaryHeap::new(), Vec::new());
        Ok(Self { steps, start: *start, goal, known, open, end: None, edges, doorsteps })
    }

    /// Explores the graph until the goal is the nearest open node, or no node is open. Passes the
    /// number of known places to `told`, again and again.
    fn run(&mut self, told: &mut dyn FnMut(usize)) -> Result<(), WalkError> {
        let mut edges = std::mem::take(&mut self.edges);
        let start = self.start;
        self.steps.enter(&start, &mut edges)?;
        let [x, y, _] = start.place();
        // Start and goal share a cell.
        if self.steps.lattice.corners([x, y]).eq(self.doorsteps.iter().copied()) {
            self.try_goal(&start, 0.0, NONE)?;
        }
        self.take_in(&edges, 0.0, NONE);
        while let Some(Open { length, node, .. }) = self.open.pop() {
            if node == NONE {
                break;
            }
            // A shorter path to the node was found since.
            if length > self.known[node as usize].length {
                continue;
            }
            if self.doorsteps.contains(&self.steps.nodes()[node as usize].cell) {
                let walker = self.steps.walker(node);
                self.try_goal(&walker, length, node)?;
            }
            self.steps.leave(node, &mut edges)?;
            self.take_in(&edges, length, node);
            told(self.steps.places());
        }
        Ok(())
    }

    fn take_in(&mut self, edges: &[Edge], so_far: f64, before: u32) {
        for edge in edges {
            let length = so_far + edge.length;
            let known = Known { length, before };
            if edge.is_new {
                self.known.push(known);
            } else if length < self.known[edge.node as usize].length {
                self.known[edge.node as usize] = known;
            } else {
                continue;
            }
            let place = self.steps.lattice.place(self.steps.nodes()[edge.node as usize].cell);
            self.open.push(Open { whole: length + self.to_goal(place), length, node: edge.node });
        }
    }

    /// Records an edge to the goal if the walker arrives there on the same storey, that is within a
    /// climb of the goal's height.
    fn try_goal(&mut self, walker: &Walker, so_far: f64, before: u32) -> Result<(), WalkError> {
        let [x, y, z] = self.goal.place();
        let Some(arrived) = self.steps.straight(walker, [x, y])? else { return Ok(()) };
        let [u, v, _] = walker.place();
        let length = so_far + (x - u).hypot(y - v);
        let is_shorter = self.end.is_none_or(|end| length < end.known.length);
        if (arrived.feet() - z).abs() <= arrived.climb() && is_shorter {
            self.end = Some(End { walker: arrived, known: Known { length, before } });
            self.open.push(Open { whole: length, length, node: NONE });
        }
        Ok(())
    }

    fn to_goal(&self, [x, y]: [f64; 2]) -> f64 {
        let [u, v, _] = self.goal.place();
        (u - x).hypot(v - y)
    }

    /// Returns the states at the start, at every node of the shortest path, and at the goal.
    fn path(&self, end: &End) -> Vec<Walker> {
        let mut path = vec![end.walker];
        let mut node = end.known.before;
        while node != NONE {
            path.push(self.steps.walker(node));
            node = self.known[node as usize].before;
        }
        path.push(self.start);
        path.reverse();
        path
    }

    /// Returns the place within reach that is nearest to the goal, in the map's coordinates, and
    /// its distance.
    fn nearest(&self) -> ([f64; 3], f64) {
        let [x, y, z] = self.goal.place();
        let away = |p: [f64; 3]| (p[0] - x).hypot(p[1] - y).hypot(p[2] - z);
        let nodes = self.steps.nodes().iter().map(|node| {
            let [u, v] = self.steps.lattice.place(node.cell);
            [u, v, node.height]
        });
        let all = std::iter::once(self.start.place()).chain(nodes).map(|place| (place, away(place)));
        all.min_by(|(_, a), (_, b)| a.total_cmp(b)).unwrap_or(([x, y, z], 0.0))
    }
}
