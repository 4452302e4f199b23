//! The r-SIG of a changing set of points.
//!
//! A point's sphere of influence changes when its r-th nearest neighbour does: when a nearer point
//! is inserted, or a point that is not further is removed. An update therefore finds the points
//! whose spheres contain the position, recomputes their radii, and then their edges and those of
//! the new point. After every update the graph equals that of a fresh build over all points, bit
//! for bit.
//!
//! Klein & Zachmann 2005, §6, state O(log³ N) for an update. Here the number of points that an
//! update touches does not grow with N where density is bounded: each point is among the r nearest
//! of O(r) others, and has O(r) neighbours. Each touched point costs a search in an R*-tree ("The
//! R*-tree: an efficient and robust access method for points and rectangles", Beckmann et al.
//! 1990).

use nearmiss_lanes::vector::distance_sq;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use crate::influence::{distance, influence, radii_sq, support_radius};
use crate::options::{GraphError, GraphOptions, check_positions};

type Point = GeomWithData<[f32; 3], u32>;
type Ball = GeomWithData<Rectangle<[f32; 3]>, u32>;

/// Numbers of points that an update changed. A move is a removal and an insertion; points that both
/// change count twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Touched {
    /// Number of points whose sphere of influence was recomputed.
    pub spheres: usize,
    /// Number of points whose neighbours changed, or whose sphere was recomputed.
    pub points: usize,
}

/// The r-SIG of a changing set of points, without pruning. A point keeps its id until it is
/// removed. Ids are not reused.
#[derive(Debug, Clone)]
pub struct DynamicGraph {
    neighbours: usize,
    /// `None` for removed points.
    positions: Vec<Option<[f32; 3]>>,
    count: usize,
    radii_sq: Vec<f32>,
    lists: Vec<Vec<u32>>,
    points: RTree<Point>,
    /// Bounding boxes of the spheres of influence.
    balls: RTree<Ball>,
}

impl DynamicGraph {
    /// Creates the graph of distinct `positions`, whose ids are their indices. Of the options, only
    /// r is used.
    ///
    /// # Errors
    /// As [`PointGraph::build`](crate::PointGraph::build).
    pub fn new(positions: &[[f32; 3]], options: &GraphOptions) -> Result<Self, GraphError> {
        options.check()?;
        check_positions(positions)?;
        let radii_sq = radii_sq(positions, options.neighbours);
        let graph = influence(positions, &radii_sq)?;
        let points = (0..).zip(positions).map(|(id, &p)| Point::new(p, id)).collect();
        let balls = (0..).zip(positions.iter().zip(&radii_sq));
        let balls = balls.map(|(id, (&p, &sq))| Ball::new(about(p, sq), id)).collect();
        Ok(Self {
            neighbours: options.neighbours as usize,
            positions: positions.iter().copied().map(Some).collect(),
            count: positions.len(),
            lists: (0..positions.len()).map(|i| graph.of(i).to_vec()).collect(),
            radii_sq,
            points: RTree::bulk_load(points),
            balls: RTree::bulk_load(balls),
        })
    }

    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns `true` if there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the position of a point; `None` if it was removed or never existed.
    #[must_use]
    pub fn position(&self, id: u32) -> Option<[f32; 3]> {
        *self.positions.get(id as usize)?
    }

    /// Returns the neighbours of a point, ascending; empty if there is no such point.
    #[must_use]
    pub fn of(&self, id: u32) -> &[u32] {
        self.lists.get(id as usize).map_or(&[], Vec::as_slice)
    }

    /// Returns `d_i`, the distance of a point from its r-th nearest neighbour; `None` if there is
    /// no such point.
    #[must_use]
    pub fn radius(&self, id: u32) -> Option<f32> {
        self.position(id).map(|_| self.radii_sq[id as usize].sqrt())
    }

    /// Adds a point at a position distinct from all others, and returns its id.
    ///
    /// # Errors
    /// Fails if a coordinate is not finite or beyond ±1e18, or if all ids are used.
    pub fn insert(&mut self, position: [f32; 3]) -> Result<(u32, Touched), GraphError> {
        check_positions(&[position])?;
        let index = self.positions.len();
        let id = u32::try_from(index).ok().filter(|&id| id < u32::MAX);
        let id = id.ok_or(GraphError::TooLarge { ends: index })?;
        self.positions.push(None);
        self.radii_sq.push(0.0);
        self.lists.push(Vec::new());
        Ok((id, self.place(id, position)))
    }

    /// Removes a point; `None` if there is no such point.
    pub fn remove(&mut self, id: u32) -> Option<Touched> {
        let (orphans, mut touched) = self.take(id)?;
        let spheres = self.refresh(&orphans, &mut touched);
        Some(tally(spheres, touched))
    }

    /// Moves a point to a position distinct from all others; `None` if there is no such point.
    ///
    /// # Errors
    /// Fails if a coordinate is not finite or beyond ±1e18. The point then stays in place.
    pub fn relocate(&mut self, id: u32, position: [f32; 3]) -> Result<Option<Touched>, GraphError> {
        check_positions(&[position])?;
        let Some(gone) = self.remove(id) else { return Ok(None) };
        let come = self.place(id, position);
        Ok(Some(Touched { spheres: gone.spheres + come.spheres, points: gone.points + come.points }))
    }

    /// Inserts a removed or new point at a position.
    fn place(&mut self, id: u32, position: [f32; 3]) -> Touched {
        // A point with fewer than r others gains a neighbour, wherever it is.
        let mut nearer: Vec<u32> = if self.count <= self.neighbours {
            self.points.iter().map(|point| point.data).collect()
        } else {
            let at = AABB::from_point(position);
            let contains = |i: &u32| self.sq(*i, position).is_some_and(|sq| sq < self.radii_sq[*i as usize]);
            self.balls.locate_in_envelope_intersecting(at).map(|ball| ball.data).filter(contains).collect()
        };
        self.positions[id as usize] = Some(position);
        self.count += 1;
        self.points.insert(Point::new(position, id));
        self.balls.insert(Ball::new(about(position, 0.0), id));
        self.radii_sq[id as usize] = 0.0;
        nearer.push(id);
        nearer.sort_unstable();
        let mut touched = Vec::new();
        let spheres = self.refresh(&nearer, &mut touched);
        tally(spheres, touched)
    }

    /// Removes a point with its edges. Returns the points that had it among their r nearest, and
    /// all points whose lists changed.
    fn take(&mut self, id: u32) -> Option<(Vec<u32>, Vec<u32>)> {
        let position = self.positions.get_mut(id as usize)?.take()?;
        let list = std::mem::take(&mut self.lists[id as usize]);
        for &j in &list {
            unlink(&mut self.lists[j as usize], id);
        }
        self.count -= 1;
        self.points.remove(&Point::new(position, id));
        self.balls.remove(&Ball::new(about(position, self.radii_sq[id as usize]), id));
        let had = |i: &u32| self.sq(*i, position).is_some_and(|sq| sq <= self.radii_sq[*i as usize]);
        let orphans = list.iter().copied().filter(had).collect();
        Some((orphans, list))
    }

    /// Recomputes the radii, then the edges of some points. Adds all points whose lists changed to
    /// `touched`. Returns the number of points recomputed.
    fn refresh(&mut self, ids: &[u32], touched: &mut Vec<u32>) -> usize {
        for &i in ids {
            let Some(position) = self.position(i) else { continue };
            let sq = self.radius_sq(i, position);
            let old = std::mem::replace(&mut self.radii_sq[i as usize], sq);
            if sq.to_bits() != old.to_bits() {
                self.balls.remove(&Ball::new(about(position, old), i));
                self.balls.insert(Ball::new(about(position, sq), i));
            }
        }
        for &i in ids {
            let Some(position) = self.position(i) else { continue };
            let new = self.list(i, position);
            let old = std::mem::take(&mut self.lists[i as usize]);
            for &j in old.iter().filter(|j| new.binary_search(j).is_err()) {
                unlink(&mut self.lists[j as usize], i);
                touched.push(j);
            }
            for &j in new.iter().filter(|j| old.binary_search(j).is_err()) {
                link(&mut self.lists[j as usize], i);
                touched.push(j);
            }
            self.lists[i as usize] = new;
            touched.push(i);
        }
        ids.len()
    }

    /// Returns the squared distance of point `i` from a position.
    fn sq(&self, i: u32, place: [f32; 3]) -> Option<f32> {
        Some(distance_sq(self.position(i)?, place))
    }

    /// Returns `d_i²` of a point.
    fn radius_sq(&self, id: u32, position: [f32; 3]) -> f32 {
        // The tree may round differently, so the search goes slightly beyond the r-th nearest.
        let mut nearest: Vec<f32> = Vec::with_capacity(self.neighbours + 1);
        for (point, rough) in self.points.nearest_neighbor_iter_with_distance_2(position) {
            if nearest.len() >= self.neighbours && rough > nearest[self.neighbours - 1] * (1.0 + 1e-5) + 1e-38
            {
                break;
            }
            if point.data != id {
                let sq = distance_sq(*point.geom(), position);
                nearest.insert(nearest.partition_point(|&other| other <= sq), sq);
            }
        }
        nearest.truncate(self.neighbours);
        nearest.last().copied().unwrap_or(0.0)
    }

    /// Returns the neighbours of a point, given the radii.
    fn list(&self, id: u32, position: [f32; 3]) -> Vec<u32> {
        let radius = |i: u32| f64::from(self.radii_sq[i as usize]).sqrt();
        let own = radius(id);
        let joined = |&j: &u32| {
            let apart = self.position(j).map_or(f64::INFINITY, |p| distance(position, p));
            j != id && apart <= own + radius(j)
        };
        let ball = about(position, self.radii_sq[id as usize]);
        let ball = AABB::from_corners(ball.lower(), ball.upper());
        let near = self.balls.locate_in_envelope_intersecting(ball);
        let mut list: Vec<u32> = near.map(|ball| ball.data).filter(joined).collect();
        list.sort_unstable();
        list
    }
}

/// Returns the bounding box of a sphere of influence.
fn about(position: [f32; 3], radius_sq: f32) -> Rectangle<[f32; 3]> {
    let reach = support_radius(radius_sq);
    // Beside a large coordinate, the radius itself may be lost in rounding.
    let low = position.map(|c| (c - reach).next_down());
    Rectangle::from_corners(low, position.map(|c| (c + reach).next_up()))
}

fn link(list: &mut Vec<u32>, id: u32) {
    if let Err(place) = list.binary_search(&id) {
        list.insert(place, id);
    }
}

fn unlink(list: &mut Vec<u32>, id: u32) {
    if let Ok(place) = list.binary_search(&id) {
        list.remove(place);
    }
}

fn tally(spheres: usize, mut touched: Vec<u32>) -> Touched {
    touched.sort_unstable();
    touched.dedup();
    Touched { spheres, points: touched.len() }
}
