//! The path of a walk, for its picture.

use std::collections::BTreeMap;

use nearmiss::slices::{Grid, Route};

/// Greatest number of kept places, far more than a picture shows.
const MOST: usize = 1 << 20;

/// Greatest number of kept stops.
const MOST_STOPS: usize = 1000;

/// The places of a walk, in the map's coordinates, with their distances from the start. For a
/// longer walk, only every second place is kept, or every fourth, and so on.
pub(super) struct Track {
    /// The start first.
    pub(super) places: Vec<[f64; 3]>,
    /// Horizontal distance from the start, for each place.
    pub(super) distances: Vec<f64>,
    /// The points of the route, in the map's coordinates.
    pub(super) targets: Vec<[f64; 2]>,
    /// For each point of the route, the number of the first point at the same place, counted from
    /// 1.
    pub(super) numbers: Vec<usize>,
    /// Distance and height of the avatar at each point of the route that it has reached, in their
    /// order.
    pub(super) reached: Vec<[f64; 2]>,
    /// Places where the avatar was stopped, with the distance. Only the first places are kept, and
    /// consecutive equal ones once.
    pub(super) stops: Vec<([f64; 3], f64)>,
    /// Number of steps between kept places.
    every: usize,
    /// Number of steps so far.
    steps: usize,
}

impl Track {
    /// Creates a track that begins at `start`.
    pub(super) fn new(route: &Route, grid: &Grid, start: [f64; 3]) -> Self {
        let targets: Vec<[f64; 2]> = route.points.iter().map(|p| grid.up.across(*p)).collect();
        let mut first = BTreeMap::new();
        // Adding 0 turns -0 into 0.
        let bits = |target: [f64; 2]| target.map(|x| (x + 0.0).to_bits());
        let numbers = (1..).zip(&targets).map(|(i, target)| *first.entry(bits(*target)).or_insert(i));
        let numbers = numbers.collect();
        let mut track = Self {
            places: Vec::new(),
            distances: Vec::new(),
            targets,
            numbers,
            reached: Vec::new(),
            stops: Vec::new(),
            every: 1,
            steps: 0,
        };
        track.put(start, 0.0);
        track.reach(start, 0.0);
        track
    }

    /// Adds a step to this place, at this distance from the start.
    pub(super) fn add(&mut self, place: [f64; 3], distance: f64) {
        self.steps += 1;
        if self.steps.is_multiple_of(self.every) {
            self.put(place, distance);
        }
        self.reach(place, distance);
    }

    /// Records a stop at this place, at this distance from the start.
    pub(super) fn stop(&mut self, place: [f64; 3], distance: f64) {
        if self.stops.len() < MOST_STOPS && self.stops.last() != Some(&(place, distance)) {
            self.stops.push((place, distance));
        }
    }

    /// Ends the track at this place, which is always kept.
    pub(super) fn end(&mut self, place: [f64; 3], distance: f64) {
        if !self.steps.is_multiple_of(self.every) {
            self.put(place, distance);
        }
    }

    fn put(&mut self, place: [f64; 3], distance: f64) {
        self.places.push(place);
        self.distances.push(distance);
        if self.places.len() > MOST {
            self.every *= 2;
            halve(&mut self.places);
            halve(&mut self.distances);
        }
    }

    /// Records the points of the route that are reached here.
    fn reach(&mut self, [x, y, z]: [f64; 3], distance: f64) {
        while self.targets.get(self.reached.len()) == Some(&[x, y]) {
            self.reached.push([distance, z]);
        }
    }
}

/// Removes every second item.
fn halve<T>(items: &mut Vec<T>) {
    let mut is_kept = false;
    items.retain(|_| {
        is_kept = !is_kept;
        is_kept
    });
}

#[cfg(test)]
mod tests {
    use nearmiss::slices::Up;

    use super::*;

    fn track(points: &[[f64; 2]]) -> Track {
        let grid = Grid { up: Up::Z, origin: [0.0; 3], pixel: 1.0, slice_height: 1.0, counts: [1; 3] };
        Track::new(&Route { start: [0.0; 3], points: points.to_vec() }, &grid, [0.0, 0.0, 2.0])
    }

    #[test]
    fn long_ways_are_kept_coarsely_from_end_to_end() {
        let steps = 5 * MOST + 3;
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let place = |i: usize| [i as f64, 0.0, 2.0];
        let mut track = track(&[[0.0; 2], place(7)[..2].try_into().unwrap(), [1e9, 0.0]]);
        for i in 1..=steps {
            track.add(place(i), place(i)[0]);
            assert!(track.places.len() <= MOST && track.places.len() == track.distances.len());
        }
        track.end(place(steps), place(steps)[0]);
        assert!(track.places.len() > MOST / 2, "{} places", track.places.len());
        let last = track.places.len() - 1;
        assert!((0..last).all(|i| track.places[i] == place(8 * i)), "evenly");
        assert_eq!(track.places[last], place(steps));
        assert!((0..=last).all(|i| track.distances[i] == track.places[i][0]));
        assert_eq!(track.reached, [[0.0, 2.0], [7.0, 2.0]], "whatever was left out");
    }

    #[test]
    fn points_have_the_number_of_the_first_one_there() {
        let track = track(&[[0.0, 1.0], [2.0, 3.0], [-0.0, 1.0], [1.0, 0.0], [2.0, 3.0]]);
        assert_eq!(track.numbers, [1, 2, 1, 4, 2]);
    }
}
