//! Parts of scans around clashes.

use nearmiss_geometry::Aabb;
use nearmiss_hierarchy::PointHierarchy;
use nearmiss_lanes::id32;

use crate::clash::LINK;
use crate::clash::components::components;
use crate::clash::depths::MOST_ITEMS;
use crate::clash::group::ContactGroup;
use crate::pair::placed::Placed;
use crate::penetration::answer::Interior;

/// A scan of which parts are taken.
pub(super) struct PartedScan<'a> {
    pub(super) scan: &'a Placed<'a>,
    pub(super) interior: Interior,
    /// The stored point of each contact.
    pub(super) stored: Vec<usize>,
}

/// A part of a scan.
pub(super) enum ScanPart {
    /// The scan itself.
    Whole,
    Own(Box<PointHierarchy>),
    /// Too few points for a scan.
    None,
}

impl ScanPart {
    /// The part, placed as its scan is.
    pub(super) fn of<'p>(&'p self, scan: &Placed<'p>) -> Option<Placed<'p>> {
        match self {
            Self::Whole => Some(*scan),
            Self::Own(part) => Some(scan.with_part(part)),
            Self::None => None,
        }
    }
}

impl PartedScan<'_> {
    /// The part within `bounds`, a box in the world: all of a solid, otherwise what is linked to the contacts
    /// of a group.
    pub(super) fn part(&self, group: &ContactGroup, bounds: &Aabb) -> ScanPart {
        let (stored, frame) = (self.scan.scan(), self.scan.stored_to_world());
        let radius = bounds.half_extents().into_iter().fold(0.0, f64::hypot) / frame.scale();
        let centre = frame.apply_inverse(bounds.centre());
        let Some(mut points) = stored.points_in_ball(centre, radius, MOST_ITEMS) else {
            return ScanPart::Whole;
        };
        points.retain(|&i| bounds.contains(self.scan.point(i as usize)));
        if self.interior == Interior::Hollow {
            self.keep_linked(group, &mut points);
        }
        stored.part(&points).map_or(ScanPart::None, |part| ScanPart::Own(Box::new(part)))
    }

    /// Keeps the points, in ascending order, that are linked to the contacts.
    fn keep_linked(&self, group: &ContactGroup, points: &mut Vec<u32>) {
        let places: Vec<[f64; 3]> = points.iter().map(|&i| self.scan.point(i as usize)).collect();
        let numbers = components(&places, LINK * self.scan.sampling_radius());
        let mut is_linked = vec![false; points.len()];
        for &stored in group.contacts.iter().filter_map(|&i| self.stored.get(i)) {
            if let Ok(at) = points.binary_search(&id32(stored)) {
                is_linked[numbers[at]] = true;
            }
        }
        let mut numbers = numbers.into_iter();
        points.retain(|_| numbers.next().is_some_and(|number| is_linked[number]));
    }
}
