//! What an avatar does where something is in its way.

/// Where an avatar may go instead of a place where there is no room; places across in the map's coordinates.
pub trait Response: Sync {
    /// Places to try in turn, coming from `from` and wanting to `wanted`; if none serves, the avatar stays at
    /// `from`.
    fn elsewhere(&self, from: [f64; 2], wanted: [f64; 2]) -> [Option<[f64; 2]>; 2];
}

/// Back to the last valid place, and no further (S4, §3.1).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Back;

impl Response for Back {
    fn elsewhere(&self, _from: [f64; 2], _wanted: [f64; 2]) -> [Option<[f64; 2]>; 2] {
        [None; 2]
    }
}

/// Along the wall: that part of the step along one axis of the map, the longer first.
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
