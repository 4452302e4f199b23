//! The state that the contacts of one frame pass on to the next.

use nearmiss_geometry::nalgebra::Vector3;

use crate::solid::answer::ShapeContact;

/// The greatest number of contacts of a manifold.
pub(crate) const MOST: usize = 8;

/// A contact of the last frame is the same as one of this frame if they are no further apart, in local
/// radii.
const SAME: f64 = 0.75;

/// Ids from here on are counted; those below are numbers of measured points.
const COUNTED: u64 = 1 << 32;

/// The contacts of a shape and a scan in the last frame.
///
/// Contacts keep their ids while they move by less than three quarters of a local radius a frame, and
/// the shape stays on its side of a surface that is not oriented. Keep one hint for each pair of a shape
/// and a scan; without any, a deep shape changes sides once its centre does.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShapeHint {
    contacts: [Option<ShapeContact>; MOST],
    /// The indices of their points.
    points: [usize; MOST],
    /// The number of ids given so far.
    counted: u64,
    /// The point whose side of a surface counts instead of the shape's centre.
    pub(crate) centre: Option<[f64; 3]>,
}

impl ShapeHint {
    /// Forgets all contacts: the shape was moved elsewhere.
    pub fn clear(&mut self) {
        self.contacts = [None; MOST];
    }

    /// Sets the point of the world whose side of a surface counts instead of the shape's centre, for
    /// example the centre of a body of which the shape is a part. `None` is the shape's centre. A point
    /// outside of the shape decides alone: the shape may be all behind a surface that the body crosses.
    pub fn set_centre(&mut self, centre: Option<[f64; 3]>) {
        self.centre = centre;
    }

    /// The contacts of the last frame.
    pub(crate) fn contacts(&self) -> impl Iterator<Item = &ShapeContact> {
        self.contacts.iter().flatten()
    }

    /// The contacts of the last frame, with the indices of their points.
    pub(crate) fn contacts_of_points(&self) -> impl Iterator<Item = (&ShapeContact, usize)> {
        self.contacts.iter().zip(self.points).filter_map(|(contact, i)| Some((contact.as_ref()?, i)))
    }

    /// Returns `true` if a contact continues one of the last frame. `band` is its local radius.
    pub(crate) fn continues(known: &ShapeContact, contact: &ShapeContact, band: f64) -> bool {
        let away = Vector3::from(known.point) - Vector3::from(contact.point);
        let turned = Vector3::from(known.normal).dot(&Vector3::from(contact.normal));
        away.norm_squared() <= (SAME * band).powi(2) && turned > 0.0
    }

    /// Gives each contact the id of the one that it continues, or a new one, and remembers them.
    /// `points` are the indices of their points, and `bands` the local radii of these.
    pub(crate) fn number(
        &mut self,
        contacts: &mut [ShapeContact],
        (points, bands): (&[usize; MOST], &[f64; MOST]),
    ) {
        let mut taken = [false; MOST];
        for (n, contact) in contacts.iter_mut().enumerate().take(MOST) {
            let mut best: Option<(usize, f64)> = None;
            for (k, known) in self.contacts.iter().enumerate() {
                let Some(known) = known.as_ref().filter(|_| !taken[k]) else { continue };
                let away = (Vector3::from(known.point) - Vector3::from(contact.point)).norm();
                if Self::continues(known, contact, bands[n]) && best.is_none_or(|(_, least)| away < least) {
                    best = Some((k, away));
                }
            }
            contact.id = match best.and_then(|(k, _)| Some((k, self.contacts[k]?.id))) {
                Some((k, id)) => {
                    taken[k] = true;
                    id
                }
                None => {
                    self.counted += 1;
                    COUNTED + self.counted
                }
            };
        }
        (self.contacts, self.points) = ([None; MOST], *points);
        for (kept, contact) in self.contacts.iter_mut().zip(contacts) {
            *kept = Some(*contact);
        }
    }
}
