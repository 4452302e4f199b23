//! A scan and another shape, in either order.

use std::any::Any;
use std::cell::RefCell;

use parry3d::math::{Pose, Real, Vector};
use parry3d::query::Unsupported;
use parry3d::shape::Shape;

use nearmiss::{DistanceOptions, DistancePlan, ManifoldPoint, Pair, ShapeContact};

use crate::convert::{from_pose, to_vector};
use crate::manifolds::{Kept, Touch};
use crate::parts::for_parts;
use crate::scan_shape::{ScanShape, with_scratch};

/// Points of contact on which a body stands.
const STABLE: usize = 3;

thread_local! {
    static CONTACTS: RefCell<Vec<ShapeContact>> = RefCell::default();
    static POINTS: RefCell<Vec<ManifoldPoint>> = RefCell::default();
}

/// A distance, and the nearest points of the scan and of the other shape, in the frame of the scan.
pub(crate) type Nearest = (f64, [[f64; 3]; 2]);

/// A scan and another shape.
pub(crate) struct Question<'a> {
    pub(crate) scan: &'a ScanShape,
    pub(crate) other: &'a dyn Shape,
    /// Maps the other shape to the frame of the scan.
    pub(crate) pose: Pose,
    /// `true` if the scan is the second shape.
    pub(crate) flipped: bool,
}

fn scan_of(shape: &dyn Shape) -> Option<&ScanShape> {
    let any: &dyn Any = shape;
    any.downcast_ref()
}

impl<'a> Question<'a> {
    /// `None` if neither shape is a scan. Of two scans, the first is the scan of the question.
    fn new(pos12: &Pose, g1: &'a dyn Shape, g2: &'a dyn Shape) -> Option<Self> {
        if let Some(scan) = scan_of(g1) {
            return Some(Self { scan, other: g2, pose: *pos12, flipped: false });
        }
        let scan = scan_of(g2)?;
        Some(Self { scan, other: g1, pose: pos12.inverse(), flipped: true })
    }

    pub(crate) fn asked(pos12: &Pose, g1: &'a dyn Shape, g2: &'a dyn Shape) -> Result<Self, Unsupported> {
        Self::new(pos12, g1, g2).ok_or(Unsupported)
    }

    /// The other shape, if that is a scan as well.
    pub(crate) fn other_scan(&self) -> Option<&'a ScanShape> {
        scan_of(self.other)
    }

    /// Both scans, the second in the frame of the first.
    fn pair(&self) -> Option<(&'a ScanShape, Pair<'a>)> {
        let other = self.other_scan()?;
        let placed = from_pose(&self.pose).after(other.pose());
        let pair = Pair::new(self.scan.scan().at(self.scan.pose()), other.scan().at(&placed));
        Some((other, pair))
    }

    /// A place on the other shape, in its frame.
    pub(crate) fn on_other(&self, place: [f64; 3]) -> Vector {
        to_vector(from_pose(&self.pose).apply_inverse(place))
    }

    /// Puts what belongs to the scan and to the other shape into the order of the caller.
    pub(crate) fn ordered<T>(&self, of_scan: T, of_other: T) -> (T, T) {
        if self.flipped { (of_other, of_scan) } else { (of_scan, of_other) }
    }

    pub(crate) fn touches(&self) -> Result<bool, Unsupported> {
        if let Some((other, pair)) = self.pair() {
            let plan = self.scan.pair_plan(other, 0.0).ok_or(Unsupported)?;
            return Ok(with_scratch(|scratch| pair.collide(&plan, scratch)).verdict.is_intersecting());
        }
        let target = self.scan.target();
        let mut found = false;
        for_parts(self.scan, self.other, &self.pose, Some(0.0), &mut |part| {
            found = found || with_scratch(|scratch| target.touch(part.shape, scratch)).verdict.is_touching();
        })?;
        Ok(found)
    }

    /// The distance and the nearest points, if they are nearer than `within`.
    pub(crate) fn nearest(&self, within: Real) -> Result<Option<Nearest>, Unsupported> {
        if let Some((other, pair)) = self.pair() {
            let options = DistanceOptions::default().with_semantics(self.scan.semantics());
            let plan = DistancePlan::new(&options, self.scan.scan(), other.scan());
            let plan = plan.or(Err(Unsupported))?;
            let found = with_scratch(|scratch| pair.distance(&plan, scratch));
            return Ok((found.upper <= f64::from(within)).then_some((found.upper, found.points)));
        }
        let target = self.scan.target();
        let mut best = None;
        let mut within = f64::from(within);
        for_parts(self.scan, self.other, &self.pose, None, &mut |part| {
            if let Some(found) = with_scratch(|scratch| target.distance(part.shape, within, scratch)) {
                within = found.upper;
                best = Some((found.upper, found.points));
            }
        })?;
        Ok(best)
    }

    /// The deepest contact within `margin`.
    pub(crate) fn deepest(&self, margin: Real) -> Result<Option<Touch>, Unsupported> {
        let mut found: Option<Touch> = None;
        self.contacts(margin, None, &mut |_, _, touch| {
            if touch.gap <= f64::from(margin) && found.is_none_or(|found| touch.gap < found.gap) {
                found = Some(*touch);
            }
        })?;
        Ok(found)
    }

    /// Calls `visit` with all contacts within `margin`: the part of the other shape, its pose there,
    /// and the contact.
    pub(crate) fn contacts(
        &self,
        margin: Real,
        mut kept: Option<&mut Kept>,
        visit: &mut dyn FnMut(u32, Option<Pose>, &Touch),
    ) -> Result<(), Unsupported> {
        if let Some((other, pair)) = self.pair() {
            let mut points = POINTS.take();
            points.clear();
            // A manifold is spread over all that is within the margin. Only if little touches may places
            // with a gap take the room of those that carry.
            for margin in [0.0, margin] {
                if points.len() >= STABLE {
                    break;
                }
                points.clear();
                let plan = self.scan.pair_plan(other, margin).ok_or(Unsupported)?;
                let question = pair.manifold(&mut points);
                with_scratch(|scratch| match &mut kept {
                    Some(kept) => question.hinted(&mut kept.pair).collide(&plan, scratch),
                    None => question.collide(&plan, scratch),
                });
            }
            points.iter().for_each(|point| visit(0, None, &point.into()));
            POINTS.set(points);
            return Ok(());
        }
        let target = self.scan.target_within(margin);
        let mut contacts = CONTACTS.take();
        let asked = for_parts(self.scan, self.other, &self.pose, Some(margin), &mut |part| {
            let mut fresh = Kept::default();
            let hint = kept.as_deref_mut().unwrap_or(&mut fresh).hint(part.id, part.centre);
            with_scratch(|scratch| target.contacts_hinted(part.shape, hint, &mut contacts, scratch));
            contacts.iter().for_each(|contact| visit(part.id, part.pose, &contact.into()));
        });
        CONTACTS.set(contacts);
        asked
    }
}
