//! Contacts in brief: how many there are, where, and between which normals.

use nearmiss_geometry::nalgebra::Vector3;

use crate::ask::answer::{Contact, Contacts};

type Vector = Vector3<f64>;

/// A contact in brief.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surveyed {
    pub(crate) point: Vector,
    /// The unit normals of both surfaces; 0 if they are not known.
    pub(crate) normals: [Vector; 2],
    /// The shifts along the first normal and against it that end the contact; 0 if they are not known.
    pub(crate) depths: [f64; 2],
}

/// The contacts of two things in brief.
#[derive(Debug, Clone, Default)]
pub(crate) struct ContactSurvey {
    pub(crate) count: u32,
    /// Sums of the coordinates, and of their products xx xy xz yy yz zz, about the first point.
    first: Vector,
    sum: Vector,
    products: [f64; 6],
    /// Some contacts, the first one and others evenly spread over all.
    pub(crate) some: Vec<Surveyed>,
    /// One of this many contacts is kept.
    stride: u32,
    /// The greatest shift under which a contact surely stays.
    pub(crate) least: f64,
}

/// The number of contacts that are kept at most.
pub(crate) const KEPT: usize = 8;

/// The unit normals of both surfaces; 0 if they are not known.
fn normals(contact: &Contact) -> [Vector; 2] {
    contact.normals.unwrap_or([[0.0; 3]; 2]).map(Vector::from)
}

/// The direction, of those of both normals and their opposites, that is nearest to a shift.
pub(crate) fn way_out(contact: &Contact, t: Vector) -> Vector {
    let [a, b] = normals(contact).map(|normal| normal * 1.0_f64.copysign(normal.dot(&t)));
    if a.dot(&t) >= b.dot(&t) { a } else { b }
}

impl ContactSurvey {
    /// Forgets all contacts, and keeps the memory.
    pub(crate) fn clear(&mut self) {
        let mut some = std::mem::take(&mut self.some);
        some.clear();
        *self = Self { some, stride: 1, ..Self::default() };
    }

    /// Adds a contact that stays under all shifts shorter than `least`.
    pub(crate) fn add(&mut self, contact: Surveyed, least: f64) {
        let point = contact.point;
        if self.count == 0 {
            self.first = point;
        }
        let d = point - self.first;
        self.sum += d;
        let products = [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z];
        self.products = [0, 1, 2, 3, 4, 5].map(|k| self.products[k] + products[k]);
        if self.count.is_multiple_of(self.stride) {
            if self.some.len() == KEPT {
                // Every other one.
                let mut i = 0;
                self.some.retain(|_| {
                    i += 1;
                    i % 2 == 1
                });
                self.stride *= 2;
            }
            if self.count.is_multiple_of(self.stride) {
                self.some.push(contact);
            }
        }
        self.count += 1;
        self.least = self.least.max(least);
    }

    /// Adds contacts; `depth` returns the greatest shift under which one stays, from its residual.
    pub(crate) fn add_all(&mut self, contacts: &Contacts, depth: impl Fn(f64) -> f64) {
        for contact in &contacts.contacts {
            let own = Surveyed { point: contact.point.into(), normals: normals(contact), depths: [0.0; 2] };
            self.add(own, depth(contact.residual));
        }
    }

    /// Returns the mean of the points.
    pub(crate) fn centre(&self) -> Vector {
        self.first + self.sum / f64::from(self.count.max(1))
    }

    /// Returns the principal axes of the points, the one of least extent first.
    pub(crate) fn axes(&self) -> [Vector; 3] {
        let n = f64::from(self.count.max(1));
        let m = self.sum / n;
        let of_mean = [m.x * m.x, m.x * m.y, m.x * m.z, m.y * m.y, m.y * m.z, m.z * m.z];
        let covariance = [0, 1, 2, 3, 4, 5].map(|k| self.products[k] / n - of_mean[k]);
        nearmiss_surface::symmetric_eigen(covariance).vectors.map(Vector::from)
    }
}
