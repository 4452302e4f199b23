//! Contacts that belong together.

use std::cmp::Ordering;

use nearmiss_geometry::Aabb;

use crate::ask::answer::Contact;
use crate::clash::components::components;

/// A connected component of contacts: each is at most a link length from another one of the group, unless it
/// is the only one.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactGroup {
    /// The contacts, as indices into the list that was grouped, in ascending order. Never empty.
    pub contacts: Vec<usize>,
    /// The box about their places, in the world.
    pub bounds: Aabb,
    /// The contact with the least residual; of equal ones the first.
    pub nearest: usize,
}

impl ContactGroup {
    /// Groups contacts whose places are linked, directly or by others, by distances of at most `link`. Groups
    /// come in the order of their first contacts. Costs what [`components`] costs.
    #[must_use]
    pub fn all(contacts: &[Contact], link: f64) -> Vec<Self> {
        let places: Vec<[f64; 3]> = contacts.iter().map(|contact| contact.point).collect();
        let mut groups: Vec<Self> = Vec::new();
        for (i, number) in components(&places, link).into_iter().enumerate() {
            // A component's number first appears at its first place.
            if number == groups.len() {
                groups.push(Self { contacts: Vec::new(), bounds: Aabb::EMPTY, nearest: i });
            }
            let group = &mut groups[number];
            group.contacts.push(i);
            group.bounds.grow(places[i]);
            if contacts[i].residual < contacts[group.nearest].residual {
                group.nearest = i;
            }
        }
        groups
    }

    /// The middle of the box about the places.
    #[must_use]
    pub fn centre(&self) -> [f64; 3] {
        self.bounds.centre()
    }

    /// The edge lengths of the box about the places.
    #[must_use]
    pub fn size(&self) -> [f64; 3] {
        self.bounds.half_extents().map(|half| 2.0 * half)
    }

    /// The length of the diagonal of that box.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.size().into_iter().fold(0.0, f64::hypot)
    }

    /// The order of clash lists: the greater box diagonal first, then more contacts, then the group that was
    /// found first.
    #[must_use]
    pub fn by_size(&self, other: &Self) -> Ordering {
        (other.diagonal().total_cmp(&self.diagonal()))
            .then(other.contacts.len().cmp(&self.contacts.len()))
            .then(self.contacts.cmp(&other.contacts))
    }
}
