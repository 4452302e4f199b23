//! Limits of stored numbers.

/// No stored length exceeds this, so that no square of one overflows. Frames keep coordinates below 2³⁴.
pub(super) const FARTHEST: f32 = (1_u64 << 40) as f32;
