//! Responses of an avatar to an obstacle.

/// A choice of places to try instead of a place that is blocked, in the map's horizontal
/// coordinates.
pub trait Response: Sync {
    /// Returns the places to try in turn instead of `wanted`. If all are blocked, the avatar stays
    /// at `from`.
    fn elsewhere(&self, from: [f64; 2], wanted: [f64; 2]) -> [Option<[f64; 2]>; 2];
}

/// Stays at the last valid place (Anjos et al. 2012, §3.1).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Back;

impl Response for Back {
    fn elsewhere(&self, _from: [f64; 2], _wanted: [f64; 2]) -> [Option<[f64; 2]>; 2] {
        [None; 2]
    }
}

/// Slides along a wall: tries the part of the step along one axis of the map, then the other, the
/// longer part first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Slide;

impl Response for Slide {
    fn elsewhere(&self, from: [f64; 2], wanted: [f64; 2]) -> [Option<[f64; 2]>; 2] {
        let way = [wanted[0] - from[0], wanted[1] - from[1]];
        let along = [[wanted[0], from[1]], [from[0], wanted[1]]];
        let order = if way[0].abs() >= way[1].abs() { [0, 1] } else { [1, 0] };
        order.map(|k| Some(along[k]).filter(|_| way[k] != 0.0))
    }
}
