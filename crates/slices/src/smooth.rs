//! Smoothing of a path: shortcuts that the walker confirms.

use crate::map::{SliceMap, Unloaded};
use crate::steps::straight;
use crate::walk::Walker;

/// The greatest number of passes, and the least gain of a pass, as a share of the length, that lets
/// another one follow.
const MOST_PASSES: usize = 12;
const LEAST_GAIN: f64 = 1e-3;

/// Replaces parts of a path by straight lines. `path` and the result are the states of a walker at
/// the corners of a path. The walker gets from each corner to the next one by walking straight.
///
/// A shortcut is taken if the walker arrives in the very same state, so the rest stays walkable.
/// Each pass searches for the farthest shortcut from a corner, first doubling the distance along
/// the path, then bisecting. Passes end when they gain little.
pub(crate) fn smoothed(map: &SliceMap, path: Vec<Walker>, falls: bool) -> Result<Vec<Walker>, Unloaded> {
    let mut path = path;
    for _ in 0..MOST_PASSES {
        let before = length(&path);
        path = pulled(map, &path, falls)?;
        if before - length(&path) <= LEAST_GAIN * before {
            break;
        }
    }
    Ok(path)
}

/// Returns the horizontal length of a path.
pub(crate) fn length(path: &[Walker]) -> f64 {
    path.windows(2).map(|pair| away(&pair[0], &pair[1])).sum()
}

fn away(a: &Walker, b: &Walker) -> f64 {
    let ([x, y, _], [u, v, _]) = (a.place(), b.place());
    (u - x).hypot(v - y)
}

fn pulled(map: &SliceMap, path: &[Walker], falls: bool) -> Result<Vec<Walker>, Unloaded> {
    let (trail, corners) = trail(map, path, falls)?;
    let Some((&first, last)) = trail.first().zip(trail.len().checked_sub(1)) else { return Ok(Vec::new()) };
    let is_straight = |from: usize, to: usize| {
        let [x, y, _] = trail[to].place();
        Ok::<bool, Unloaded>(straight(map, &trail[from], [x, y], falls, |_| ())? == Some(trail[to]))
    };
    let (mut here, mut pulled) = (0, vec![first]);
    while here < last {
        // The line to the next corner is part of the path, so it is walkable.
        let next = corners[corners.partition_point(|corner| *corner <= here)];
        let (mut near, mut far) = (next, last + 1);
        let mut ahead = 2 * (next - here);
        while near < last {
            let to = (here + ahead).min(last);
            if !is_straight(here, to)? {
                far = to;
                break;
            }
            near = to;
            ahead *= 2;
        }
        while far - near > 1 && far <= last {
            let middle = near + (far - near) / 2;
            if is_straight(here, middle)? { near = middle } else { far = middle }
        }
        here = near;
        pulled.push(trail[here]);
    }
    Ok(pulled)
}

/// Returns the states of a walker along a path, and the indices of the corners among them. There is
/// a state for every step, unless the walker is falling.
fn trail(map: &SliceMap, path: &[Walker], falls: bool) -> Result<(Vec<Walker>, Vec<usize>), Unloaded> {
    let mut trail: Vec<Walker> = path.first().copied().into_iter().collect();
    let mut corners = Vec::new();
    for pair in path.windows(2) {
        let [x, y, _] = pair[1].place();
        straight(map, &pair[0], [x, y], falls, |walker| {
            if !walker.is_falling() {
                trail.push(*walker);
            }
        })?;
        corners.push(trail.len() - 1);
    }
    Ok((trail, corners))
}
