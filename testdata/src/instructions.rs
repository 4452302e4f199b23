//! Instruction sets for code in lanes.

use fearless_simd::Level;

/// Returns every instruction set of this processor, the greatest first. Results depend on none.
#[must_use]
pub fn levels() -> Vec<Level> {
    #[cfg_attr(not(target_arch = "x86_64"), expect(unused_mut, reason = "there are more on x86"))]
    let mut levels = vec![Level::new(), Level::baseline()];
    #[cfg(target_arch = "x86_64")]
    {
        levels.extend(Level::new().as_avx2().map(Level::Avx2));
        levels.extend(Level::new().as_sse4_2().map(Level::Sse4_2));
        levels.extend(Level::new().as_sse2().map(Level::Sse2));
    }
    levels
}
