//! Limits of stored numbers.

/// The upper limit of stored lengths, so that their squares do not overflow. Frames keep
/// coordinates below 2³⁴.
pub(super) const FARTHEST: f32 = (1_u64 << 40) as f32;
