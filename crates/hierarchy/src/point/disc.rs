//! The radii of tangent discs, and the byte of a point that they follow from.

use bytemuck::{Pod, Zeroable};

use crate::point::kind::{PointKind, ball, ball_share};

/// Disc radius over local sampling radius in the interior. The sixth neighbour is √2 spacings away on a
/// square lattice, whose covering radius is 1/√2 spacings, 0.5; on a triangular one 1 and 1/√3, 0.58.
const DISC: f32 = 0.65;

/// Disc radius over local sampling radius at a border. Local radii grow there, to some 1.3 times those
/// inside, and two discs must not bridge a sampling radius.
const DISC_AT_BORDER: f32 = 0.35;

/// So many empty sectors side by side occur in the interior, even of random samples.
const INTERIOR_GAP: u32 = 6;

/// So many mean a border: about 135 degrees. A straight one leaves 180, a right-angled notch 90.
const BORDER_GAP: u32 = 9;

/// Bits of a [`PointCode`] below those of the border.
const KIND_BITS: u32 = 3;

/// A point's kind, and how near to a border it lies, in a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct PointCode(pub(crate) u8);

impl PointCode {
    /// The code of a point about which so many sectors of the tangent plane are empty side by side.
    pub(crate) fn new(kind: PointKind, gap: u32) -> Self {
        let border = gap.clamp(INTERIOR_GAP, BORDER_GAP) - INTERIOR_GAP;
        #[expect(clippy::cast_possible_truncation, reason = "at most 3")]
        let border = border as u8;
        Self(kind.code() | border << KIND_BITS)
    }

    /// The point's kind.
    #[inline]
    pub(crate) const fn kind(self) -> PointKind {
        PointKind::from_code(self.0 & ((1 << KIND_BITS) - 1))
    }

    /// Returns `true` if [`Self::new`] may have made this code.
    #[inline]
    pub(crate) const fn is_sound(self) -> bool {
        self.0 & ((1 << KIND_BITS) - 1) <= PointKind::LAST && self.0 >> KIND_BITS <= LAST_BORDER
    }

    /// The radius of the disc of a point with this local radius, in a scan with this reach and this sampling
    /// radius.
    #[inline]
    pub(crate) fn disc(self, radius: f32, reach: f32, sampling_radius: f32) -> f32 {
        let (kind, disc) = (self.kind(), self.disc_of_sheet(radius, reach));
        if kind.is_sparse() { disc.min(ball(kind, radius, sampling_radius)) } else { disc }
    }

    /// [`Self::disc`] of a point that is not sparse.
    #[inline]
    pub(crate) fn disc_of_sheet(self, radius: f32, reach: f32) -> f32 {
        // What is further than half the reach from all points is a hole.
        (radius * SHARES[usize::from(self.0)]).min(0.5 * reach)
    }
}

/// The code of a point at a border.
#[expect(clippy::cast_possible_truncation, reason = "3")]
const LAST_BORDER: u8 = (BORDER_GAP - INTERIOR_GAP) as u8;

/// The radius of a disc over the local sampling radius, by the code of its point.
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

/// The ball of a point before [`crate::Slices::dense`] by its code, in its local radius.
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

/// The radii of the discs of all points, computed as they are read.
#[derive(Debug, Clone, Copy)]
pub struct DiscRadii<'a> {
    pub(crate) codes: &'a [PointCode],
    pub(crate) radii: &'a [f32],
    pub(crate) reach: f32,
    pub(crate) sampling_radius: f32,
}

impl DiscRadii<'_> {
    /// The radius of the `i`-th point's disc.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline]
    #[must_use]
    pub fn get(&self, i: usize) -> f32 {
        self.codes[i].disc(self.radii[i], self.reach, self.sampling_radius)
    }

    /// The radii of all discs, in the order of the points.
    pub fn iter(&self) -> impl Iterator<Item = f32> + '_ {
        (0..self.codes.len()).map(|i| self.get(i))
    }
}
