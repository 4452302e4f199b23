//! The side of a surface on which a shape is.

use nearmiss_geometry::nalgebra::Vector3;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::core::Solid;
use crate::solid::elements::{Element, Elements};
use crate::solid::hint::{MOST, ShapeHint};

type Vector = Vector3<f64>;

/// A contact of the last frame within this distance may decide the side, in local radii.
const REACH: f64 = 4.0;

/// The least cosine of the normals of a disc and of a contact of the last frame that decides about it. A
/// contact with a wall tells nothing about the floor.
const SAME: f64 = 0.7;

/// The greatest distance of the disc from the plane of that contact, in local radii. A contact with the floor
/// tells nothing about the ceiling.
const LEVEL: f64 = 1.0;

/// The rules for the direction in which a shape moves out of a disc: the scan if it is oriented, then a
/// contact of the last frame, then a point of the shape. In the stored frame.
#[derive(Debug)]
pub(crate) struct Sides {
    pub(crate) is_oriented: bool,
    /// The point whose side of a surface is that of the shape.
    pub(crate) inside: Vector,
    /// `true` if that point is outside of the shape, which is a part of a greater body then.
    is_part: bool,
    /// The points and normals of the contacts of the last frame.
    known: [(Vector, Vector); MOST],
    count: usize,
}

impl Sides {
    pub(crate) fn new(elements: &Elements<'_>, solid: &Solid<'_>, hint: Option<&ShapeHint>) -> Self {
        let frame = elements.placed.stored_to_world();
        let given = hint.and_then(|hint| hint.centre).map(|given| frame.apply_inverse(given).into());
        let is_part = given.is_some_and(|given| solid.distance_bound(&given) > solid.radius);
        let inside = given.unwrap_or(solid.inside);
        let is_oriented = elements.placed.scan().is_oriented();
        let (mut known, mut count) = ([(Vector::zeros(), Vector::zeros()); MOST], 0);
        for contact in hint.into_iter().flat_map(ShapeHint::contacts) {
            known[count] =
                (frame.apply_inverse(contact.point).into(), frame.rotate_inverse(contact.normal).into());
            count += 1;
        }
        Self { is_oriented, inside, is_part, known, count }
    }

    /// Returns `true` if contacts of the last frame decide about discs near them.
    pub(crate) fn has_contacts(&self) -> bool {
        !self.is_oriented && self.count > 0
    }

    /// Returns `true` if neither the scan, nor a contact of the last frame, nor a greater body decides about
    /// point `i`.
    pub(crate) fn are_open(&self, elements: &Elements<'_>, i: usize) -> bool {
        if self.is_oriented || self.is_part {
            return false;
        }
        let disc = || match elements.element(i) {
            Element::Disc(disc) => Some(disc),
            Element::Ball(..) => None,
        };
        self.count == 0
            || disc().is_none_or(|disc| self.known(&disc, f64::from(elements.arrays.radii[i])).is_none())
    }

    /// The sign of the normal of a disc in the direction in which the shape moves out, and `true` if the
    /// shape is behind the disc. `band` is the local radius.
    pub(crate) fn of(&self, disc: &FlatDisc, band: f64) -> (f64, bool) {
        let height = disc.normal.dot(&(self.inside - disc.centre));
        if self.is_oriented {
            return (1.0, height < 0.0);
        }
        // A contact keeps the shape on its side, so the disc still is before it.
        (1.0_f64.copysign(self.known(disc, band).unwrap_or(height)), false)
    }

    /// The cosine of the normals of a disc and of the nearest contact of the last frame with a similar
    /// plane, if that is near.
    fn known(&self, disc: &FlatDisc, band: f64) -> Option<f64> {
        let cosine = |known: &(Vector, Vector)| known.1.dot(&disc.normal);
        let away = |known: &(Vector, Vector)| (known.0 - disc.centre).norm_squared();
        let is_similar = |known: &&(Vector, Vector)| {
            let off = known.1.dot(&(known.0 - disc.centre)).abs();
            cosine(known).abs() >= SAME && off <= LEVEL * band
        };
        let similar = self.known[..self.count].iter().filter(is_similar);
        let nearest = similar.min_by(|a, b| away(a).total_cmp(&away(b)))?;
        (away(nearest) <= (REACH * band).powi(2)).then(|| cosine(nearest))
    }
}
