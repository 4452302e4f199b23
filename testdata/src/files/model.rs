//! The model in all files.

/// Returns the points: a bumpy sheet of 5 by 4, exact in single precision.
#[must_use]
pub fn points() -> Vec<[f32; 3]> {
    let bump = |i: u8| f32::from(i * 7 % 5) / 8.0 - 0.25;
    (0..20).map(|i| [f32::from(i % 5), f32::from(i / 5) * 0.5, bump(i)]).collect()
}

/// Returns a normal for each point, exact in text with three digits.
#[must_use]
pub fn normals() -> Vec<[f32; 3]> {
    (0..20).map(|i: u8| [0.125, f32::from(i) / 32.0, -0.5]).collect()
}

/// Returns a colour for each point.
#[must_use]
pub fn colours() -> Vec<[u8; 3]> {
    (0..20).map(|i: u8| [200 + i, 255 - i, i]).collect()
}

/// Returns twelve quads between the points.
#[must_use]
pub fn quads() -> Vec<[u32; 4]> {
    let corner = |i: u32| i % 4 + 5 * (i / 4);
    (0..12).map(corner).map(|c| [c, c + 1, c + 6, c + 5]).collect()
}

/// Returns the triangles into which readers split the quads.
#[must_use]
pub fn triangles() -> Vec<[u32; 3]> {
    quads().iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}
