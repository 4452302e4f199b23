//! The radii of tangent discs, and the byte of a point that determines them.

use bytemuck::{Pod, Zeroable};

use crate::point::kind::{PointKind, ball, ball_share};

/// Disc radius over local radius in the interior. It exceeds the ratio of the covering radius to
/// the distance of the sixth neighbour: 0.5 on a square lattice (1/√2 and √2 spacings), 0.58 on a
/// triangular one (1/√3 and 1 spacing).
const DISC: f32 = 0.65;

/// Disc radius over local radius at a border. Local radii grow there, to about 1.3 times those
/// inside, and two discs must not bridge a sampling radius.
const DISC_AT_BORDER: f32 = 0.35;

/// This many adjacent empty sectors occur in the interior, even of random samples.
const INTERIOR_GAP: u32 = 6;

/// This many adjacent empty sectors, about 135°, mean a border. A straight border leaves 180°
/// empty, a right-angled notch 90°.
const BORDER_GAP: u32 = 9;

/// The number of bits of a [`PointCode`] below those of the border.
const KIND_BITS: u32 = 3;

/// A point's kind and its nearness to a border, in one byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct PointCode(pub(crate) u8);

impl PointCode {
    /// Returns the code of a point with `gap` adjacent empty sectors of the tangent plane.
    pub(crate) fn new(kind: PointKind, gap: u32) -> Self {
        let border = gap.clamp(INTERIOR_GAP, BORDER_GAP) - INTERIOR_GAP;
        #[expect(clippy::cast_possible_truncation, reason = "at most 3")]
        let border = border as u8;
        Self(kind.code() | border << KIND_BITS)
    }

    /// Returns the point's kind.
    #[inline]
    pub(crate) const fn kind(self) -> PointKind {
        PointKind::from_code(self.0 & ((1 << KIND_BITS) - 1))
    }

    /// Returns `true` if [`BORDER_GAP`] adjacent sectors or more are empty.
    #[inline]
    pub(crate) const fn is_at_border(self) -> bool {
        self.0 >> KIND_BITS >= LAST_BORDER
    }

    /// Returns `true` if all these points sample sheets.
    #[inline(always)]
    pub(crate) fn are_sheets(codes: &[Self]) -> bool {
        codes.iter().fold(0, |bits, code| bits | code.0) & NO_SHEET == 0
    }

    /// Returns `true` if [`Self::new`] can return this code.
    #[inline]
    pub(crate) const fn is_sound(self) -> bool {
        self.0 & ((1 << KIND_BITS) - 1) <= PointKind::LAST && self.0 >> KIND_BITS <= LAST_BORDER
    }

    /// Returns the disc radius of a point with this local radius, in a scan with this reach and
    /// this sampling radius.
    #[inline]
    pub(crate) fn disc(self, radius: f32, reach: f32, sampling_radius: f32) -> f32 {
        let (kind, disc) = (self.kind(), self.disc_of_sheet(radius, reach));
        if kind.is_sparse() { disc.min(ball(kind, radius, sampling_radius)) } else { disc }
    }

    /// Returns [`Self::disc`] for a point that is not sparse.
    #[inline]
    pub(crate) fn disc_of_sheet(self, radius: f32, reach: f32) -> f32 {
        // Anything further than half the reach from all points is a hole.
        (radius * SHARES[usize::from(self.0)]).min(0.5 * reach)
    }
}

/// The bits of a code of which at least one is set unless the point samples a sheet.
const NO_SHEET: u8 = ((1 << KIND_BITS) - 1) & !PointKind::Edge.code();

/// The greatest border value of a code: at a border.
#[expect(clippy::cast_possible_truncation, reason = "3")]
const LAST_BORDER: u8 = (BORDER_GAP - INTERIOR_GAP) as u8;

/// The disc radius over the local radius, by the code of the point.
const SHARES: [f32; 256] = {
    let mut shares = [DISC_AT_BORDER; 256];
    let mut code = 0;
    while code <= u8::MAX as usize {
        let border = code >> KIND_BITS;
        if border <= LAST_BORDER as usize {
            #[expect(clippy::cast_precision_loss, reason = "a small number")]
            let share = border as f32 / LAST_BORDER as f32;
            shares[code] = DISC - (DISC - DISC_AT_BORDER) * share;
        }
        code += 1;
    }
    shares
};

/// The ball radius of a point before [`crate::ScanArrays::dense`] in local radii, by its code.
pub(crate) const DENSE_SHARES: [f32; 256] = {
    let mut shares = [0.0; 256];
    let mut code = 0;
    while code <= u8::MAX as usize {
        #[expect(clippy::cast_possible_truncation, reason = "below 256")]
        let kind = PointCode(code as u8).kind();
        shares[code] = if kind.is_sheet() { 0.0 } else { ball_share(kind) };
        code += 1;
    }
    shares
};

/// The radii of the discs of all points, computed on access.
#[derive(Debug, Clone, Copy)]
pub struct DiscRadii<'a> {
    pub(crate) codes: &'a [PointCode],
    pub(crate) radii: &'a [f32],
    pub(crate) reach: f32,
    pub(crate) sampling_radius: f32,
}

impl DiscRadii<'_> {
    /// Returns the disc radius of the `i`-th point.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn get(&self, i: usize) -> f32 {
        self.codes[i].disc(self.radii[i], self.reach, self.sampling_radius)
    }

    /// Returns the radii of all discs, in the order of the points.
    pub fn iter(&self) -> impl Iterator<Item = f32> + '_ {
        (0..self.codes.len()).map(|i| self.get(i))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_tell_whether_all_points_sample_sheets() {
        for code in 0..=u8::MAX {
            let is_sheet = PointCode(code).kind().is_sheet();
            for place in 0..3 {
                let mut codes = [PointCode::new(PointKind::Edge, 9); 3];
                codes[place] = PointCode(code);
                assert_eq!(PointCode::are_sheets(&codes), is_sheet, "code {code} at {place}");
            }
        }
    }
}
