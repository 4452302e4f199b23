//! Random numbers that are the same on every machine.

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::NodePair;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// The key of the random stream that belongs to no pair of leaves.
pub(crate) const FLAT: NodePair = NodePair { a: NodeId(u32::MAX), b: NodeId(u32::MAX) };

/// Returns the random numbers of a pair of leaves, independent of earlier queries.
pub(crate) fn stream(seed: u64, pair: NodePair) -> Xoshiro256PlusPlus {
    let pair = u64::from(pair.a.0) << 32 | u64::from(pair.b.0);
    Xoshiro256PlusPlus::seed_from_u64(seed ^ pair.wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// Uniform in [0, 1).
#[expect(clippy::cast_precision_loss, reason = "24 bits are exact")]
fn uniform(rng: &mut impl Rng) -> f32 {
    (rng.next_u64() >> 40) as f32 / (1_u64 << 24) as f32
}

/// The same in double precision.
#[expect(clippy::cast_precision_loss, reason = "53 bits are exact")]
pub(crate) fn uniform_f64(rng: &mut impl Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A point drawn uniformly from the ball of `radius` about `centre`.
pub(crate) fn place_in(rng: &mut impl Rng, centre: [f32; 3], radius: f32) -> [f32; 3] {
    let mut offset = [0.0_f32; 3];
    // The ball fills half of its cube, so 64 draws suffice for any working generator.
    for _ in 0..64 {
        offset = [0; 3].map(|_| 2.0 * uniform(rng) - 1.0);
        if offset.iter().map(|x| x * x).sum::<f32>() <= 1.0 {
            break;
        }
    }
    [0, 1, 2].map(|k| centre[k] + radius * offset[k])
}

/// Uniform below `count`, which must be positive.
pub(crate) fn below(rng: &mut impl Rng, count: usize) -> usize {
    // The bias of 2⁻³² is negligible.
    let share = ((rng.next_u64() >> 32) * count as u64) >> 32;
    usize::try_from(share).unwrap_or(0)
}
