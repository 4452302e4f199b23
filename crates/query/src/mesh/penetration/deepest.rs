//! A lower bound of the penetration: two balls inside the solids.
//!
//! If a place c has distance ρ from the surface of a and σ from that of b, and is inside both solids,
//! then any shift of b by up to ρ + σ leaves the ball of radius σ about c in contact with that of
//! radius ρ (docs/theory/meshes.md).

use std::ops::ControlFlow;

use crate::mesh::penetration::probe::{Probe, Vector};

/// Steps of a search from one place at most.
const STEPS: usize = 24;

/// Searches for a deep place by steps of up to `step`, from `start` on, and raises `lower` to the sum
/// of its distances from both surfaces. Stops at `enough`. Breaks if the budget is spent, or if no
/// place can be inside both solids.
pub(crate) fn deepen(
    probe: &mut Probe<'_>,
    start: Vector,
    mut step: f64,
    enough: f64,
    lower: &mut f64,
) -> ControlFlow<()> {
    let rounding = probe.rounding();
    let depth =
        |place: Vector, feet: &[Vector; 2]| feet.iter().map(|foot| (place - foot).norm()).sum::<f64>();
    let Some(mut feet) = probe.feet(start)? else { return ControlFlow::Continue(()) };
    let (mut place, mut best) = (start, depth(start, &feet));
    let finest = step / 64.0;
    for _ in 0..STEPS {
        *lower = lower.max(best - rounding);
        if *lower >= enough || step < finest {
            break;
        }
        // Away from both surfaces first.
        let uphill: Vector = feet.iter().filter_map(|foot| (place - foot).try_normalize(0.0)).sum();
        let uphill = uphill.try_normalize(1e-3);
        let axes = [Vector::x(), -Vector::x(), Vector::y(), -Vector::y(), Vector::z(), -Vector::z()];
        let mut moved = false;
        for way in uphill.into_iter().chain(axes) {
            let next = place + way * step;
            if let Some(found) = probe.feet(next)?
                && depth(next, &found) > best * (1.0 + 1e-6)
            {
                (place, best, feet, moved) = (next, depth(next, &found), found, true);
                break;
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    ControlFlow::Continue(())
}
