//! Contacts on the surface instead of on tangent discs, by evaluations of the implicit function.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::THICKNESS;
use nearmiss_surface::Status;

use crate::leaf::disc_triangle::FlatDisc;
use crate::pair::placed::ViewScratch;
use crate::solid::answer::ShapeContact;
use crate::solid::core::Solid;
use crate::solid::elements::Elements;
use crate::solid::place::{Place, over_disc};

type Vector = Vector3<f64>;

/// Moves a contact from the tangent disc of point `i` onto the surface, with one evaluation. The deepest
/// contact of the disc also moves over the surface to where that is nearest to the shape, with up to
/// `slides` more. Leaves the contact on its disc where the surface turns away from the disc by more than
/// 60°, or `inside` is on another side of it: in noise, or beside another sheet.
pub(crate) fn refine(
    elements: &Elements<'_>,
    (solid, inside): (&Solid<'_>, &Vector),
    (i, slides): (usize, u32),
    contact: &mut ShapeContact,
    scratch: &mut ViewScratch,
) {
    /// A contact that moves by less than this is near enough, in disc radii.
    const NEAR: f64 = 0.05;
    /// A place of the surface, as a disc, in disc radii.
    const PLACE: f64 = 0.01;
    /// The cosine of the greatest angle between the surface and the disc.
    const TURN: f64 = 0.5;
    let (placed, band) = (&elements.placed, elements.band(i));
    let frame = placed.stored_to_world();
    let radius = f64::from(elements.arrays.discs.get(i));
    let deepest = |disc: FlatDisc| over_disc(solid, &disc, disc.normal, (f64::INFINITY, elements.margin));
    let (mut x, own) = (contact.point, Vector::from(contact.normal));
    let is_before =
        own.dot(&(Vector::from(placed.stored_to_world().apply((*inside).into())) - Vector::from(x))) >= 0.0;
    let mut slides = slides;
    loop {
        let at = placed.evaluate_near(i, x, scratch);
        if at.status != Status::Ok || at.f.abs() > band {
            return;
        }
        let upright = Vector::from(at.normal);
        // f is positive below the surface.
        let foot = Vector::from(x) + upright * at.f;
        let disc = FlatDisc {
            centre: frame.apply_inverse(foot.into()).into(),
            normal: frame.rotate_inverse((upright * 1.0_f64.copysign(upright.dot(&own))).into()).into(),
            radius,
        };
        let stays = disc.normal.dot(&(inside - disc.centre)) >= 0.0;
        if upright.dot(&own).abs() < TURN || stays != is_before {
            return;
        }
        if slides > 0
            && let Some(Place { point, .. }) = deepest(disc)
            && (point - disc.centre).norm() > NEAR * radius
        {
            slides -= 1;
            x = elements.in_world(&point);
            continue;
        }
        // A shape that is beside this place has no depth there. What touches does not depend on the margin.
        let thick = f64::from(THICKNESS) * radius;
        let touches = contact.depth >= -thick * elements.scale();
        let least = if touches { -thick } else { -elements.margin.max(thick) };
        // The shape may be behind this place, and beside the disc.
        let most = (contact.depth + band) / elements.scale();
        if let Some(Place { normal, depth, .. }) = deepest(FlatDisc { radius: PLACE * radius, ..disc })
            .filter(|found| (least..=most).contains(&found.depth))
        {
            contact.point = foot.into();
            contact.depth = depth * elements.scale();
            contact.normal = elements.turned(&normal);
        }
        return;
    }
}
