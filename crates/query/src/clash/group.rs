//! Groups of linked contacts.

use std::cmp::Ordering;

use nearmiss_geometry::Aabb;

use crate::ask::answer::Contact;
use crate::clash::components::components;
use crate::clash::curves::curves;
use crate::mesh::answer::MeshContact;

/// A connected component of contacts. Each contact is at most a link length from another one of the
/// group, unless it is the only one.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactGroup {
    /// The contacts, as indices into the list that was grouped, in ascending order. Never empty.
    pub contacts: Vec<usize>,
    /// The bounding box of the places of the contacts, in world units.
    pub bounds: Aabb,
    /// The index of the contact with the least residual; the first of equal ones.
    pub nearest: usize,
}

impl ContactGroup {
    /// Groups contacts whose places are linked, directly or through others, by distances of at most
    /// `link`. The groups are in the order of their first contacts. Costs as much as
    /// [`components`].
    #[must_use]
    pub fn all(contacts: &[Contact], link: f64) -> Vec<Self> {
        let places: Vec<[f64; 3]> = contacts.iter().map(|contact| contact.point).collect();
        Self::numbered(contacts, components(&places, link))
    }

    /// Groups contacts of meshes that lie on connected curves: each curve on which the surfaces intersect is
    /// a group, however long its segments are. Contacts of triangles in one plane are grouped by the
    /// distances of their middles. The groups are in the order of their first contacts. n log n steps.
    #[must_use]
    pub fn of_meshes(contacts: &[MeshContact]) -> Vec<Self> {
        let places: Vec<Contact> = contacts.iter().map(Contact::from).collect();
        Self::numbered(&places, curves(contacts))
    }

    /// Groups contacts by their numbers, which are counted from 0 in the order of first contacts.
    fn numbered(contacts: &[Contact], numbers: Vec<usize>) -> Vec<Self> {
        let mut groups: Vec<Self> = Vec::new();
        for (i, number) in numbers.into_iter().enumerate() {
            let place = contacts[i].point;
            if number == groups.len() {
                groups.push(Self { contacts: Vec::new(), bounds: Aabb::EMPTY, nearest: i });
            }
            let group = &mut groups[number];
            group.contacts.push(i);
            group.bounds.grow(place);
            if contacts[i].residual < contacts[group.nearest].residual {
                group.nearest = i;
            }
        }
        groups
    }

    /// The centre of the bounding box.
    #[must_use]
    pub fn centre(&self) -> [f64; 3] {
        self.bounds.centre()
    }

    /// The edge lengths of the bounding box.
    #[must_use]
    pub fn size(&self) -> [f64; 3] {
        self.bounds.half_extents().map(|half| 2.0 * half)
    }

    /// The length of the diagonal of the bounding box.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.size().into_iter().fold(0.0, f64::hypot)
    }

    /// Compares two groups in the order of clash lists: by greatest box diagonal, then by most
    /// contacts, then in the order in which they were found.
    #[must_use]
    pub fn by_size(&self, other: &Self) -> Ordering {
        (other.diagonal().total_cmp(&self.diagonal()))
            .then(other.contacts.len().cmp(&self.contacts.len()))
            .then(self.contacts.cmp(&other.contacts))
    }
}
