//! A lower bound of the penetration: two balls inside the solids.
//!
//! If a place c has distance ρ from the surface of a and σ from that of b, and is inside both solids,
//! then any shift of b by up to ρ + σ leaves the ball of radius σ about c in contact with that of
//! radius ρ (docs/theory/meshes.md). A point of a surface without inside is such a place with ρ = 0.

use std::ops::ControlFlow;

use crate::penetration::probe::{Deep, Probe, Vector};

/// Steps of a search from one place at most.
const STEPS: usize = 24;

/// Searches for a deeper place than `best` without a shift, by steps of up to `step`, and raises `lower` to
/// its depth. Stops at `enough`. Breaks if the budget is spent.
pub(crate) fn climb<P: Probe>(
    probe: &mut P,
    mut best: Deep,
    mut step: f64,
    enough: f64,
    lower: &mut f64,
) -> ControlFlow<(), Deep> {
    let rounding = probe.rounding();
    let finest = step / 64.0;
    for _ in 0..STEPS {
        *lower = lower.max(best.depth - rounding);
        if *lower >= enough || step < finest {
            break;
        }
        let uphill = best.uphill.try_normalize(1e-3);
        let axes = [Vector::x(), -Vector::x(), Vector::y(), -Vector::y(), Vector::z(), -Vector::z()];
        let mut moved = false;
        for way in uphill.into_iter().chain(axes) {
            let deeper = |found: &Deep| found.depth > best.depth * (1.0 + 1e-6);
            if let Some(found) =
                probe.deep_at(best.place + way * step, Vector::zeros(), best.at)?.filter(deeper)
            {
                (best, moved) = (found, true);
                break;
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    *lower = lower.max(best.depth - rounding);
    ControlFlow::Continue(best)
}
