//! Contact manifolds of parry, which keep the data of a solver from step to step.

use std::collections::BTreeMap;

use parry3d::math::{Pose, Vector};
use parry3d::query::details::{ContactManifoldsWorkspace, TypedWorkspaceData, WorkspaceData};
use parry3d::query::{ContactManifold, TrackedContact};
use parry3d::shape::PackedFeatureId;

use nearmiss::{ManifoldPoint, PairHint, ShapeContact, ShapeHint};

use crate::convert::{from_pose, to_real, to_vector};

/// The state that the contacts of one step pass on to the next, for a pair of shapes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kept {
    /// By the part of the other shape, with the number of the last step in which it was near.
    parts: BTreeMap<u32, (u64, ShapeHint)>,
    /// For two scans.
    pub(crate) pair: PairHint,
    step: u64,
}

impl Kept {
    /// The state of the pair, which is made if `workspace` holds none.
    pub(crate) fn of(workspace: &mut Option<ContactManifoldsWorkspace>) -> Option<&mut Self> {
        if workspace.as_ref().is_none_or(|it| it.0.downcast_ref::<Self>().is_none()) {
            *workspace = Some(Self::default().into());
        }
        workspace.as_mut().and_then(|it| it.0.downcast_mut::<Self>())
    }

    pub(crate) fn begin(&mut self) {
        self.step += 1;
    }

    /// The hint of a part of a shape whose centre is at `centre`, in the frame of the scan.
    pub(crate) fn hint(&mut self, part: u32, centre: Option<[f64; 3]>) -> &mut ShapeHint {
        let (step, hint) = self.parts.entry(part).or_default();
        *step = self.step;
        hint.set_centre(centre);
        hint
    }

    /// Forgets the parts that were not asked for in this step.
    pub(crate) fn end(&mut self) {
        let now = self.step;
        self.parts.retain(|_, (step, _)| *step == now);
    }
}

impl WorkspaceData for Kept {
    fn as_typed_workspace_data(&self) -> TypedWorkspaceData<'_> {
        TypedWorkspaceData::Custom
    }

    fn clone_dyn(&self) -> Box<dyn WorkspaceData> {
        Box::new(self.clone())
    }
}

/// A contact of a scan with the other shape, in the frame of the scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Touch {
    /// The place on the scan, and on the other shape.
    pub(crate) points: [[f64; 3]; 2],
    /// Away from the scan.
    pub(crate) normal: [f64; 3],
    pub(crate) gap: f64,
    /// The id, which the contact keeps from step to step.
    id: u32,
}

impl From<&ShapeContact> for Touch {
    fn from(it: &ShapeContact) -> Self {
        let deepest = [0, 1, 2].map(|k| it.point[k] - it.depth * it.normal[k]);
        Self { points: [it.point, deepest], normal: it.normal, gap: -it.depth, id: folded(it.id) }
    }
}

impl From<&ManifoldPoint> for Touch {
    /// The scan is the first of the pair.
    fn from(it: &ManifoldPoint) -> Self {
        let along = |t: f64| [0, 1, 2].map(|k| it.point[k] + t * it.normal[k]);
        let points = [along(0.5 * it.gap), along(-0.5 * it.gap)];
        Self { points, normal: it.normal.map(|c| -c), gap: it.gap, id: it.sources[0].0 }
    }
}

/// The low bits of an id, in which ids that are given one after the other differ.
#[expect(clippy::cast_possible_truncation, reason = "the low bits are meant")]
const fn folded(id: u64) -> u32 {
    id as u32
}

/// The manifolds of a pair, of which the first `used` are those of this step. Each has one point, so
/// that each contact has its own normal.
pub(crate) struct Manifolds<'a, M, C> {
    list: &'a mut Vec<ContactManifold<M, C>>,
    used: usize,
    /// Maps the other shape to the frame of the scan.
    pose: Pose,
    /// `true` if the scan is the second shape.
    flipped: bool,
}

impl<'a, M: Default, C: Default + Copy> Manifolds<'a, M, C> {
    pub(crate) fn new(list: &'a mut Vec<ContactManifold<M, C>>, pose: &Pose, flipped: bool) -> Self {
        Self { list, used: 0, pose: *pose, flipped }
    }

    /// Adds a contact with a part of the other shape. It keeps the data of the contact that it
    /// continues.
    pub(crate) fn push(&mut self, part: u32, part_pose: Option<Pose>, touch: &Touch) {
        let fid = PackedFeatureId::face(touch.id & 0x3fff_ffff);
        let continues = |it: &ContactManifold<M, C>| {
            let subshape = if self.flipped { it.subshape1 } else { it.subshape2 };
            let known = it.points.first().map(|p| if self.flipped { p.fid2 } else { p.fid1 });
            subshape == part && known == Some(fid)
        };
        let found = self.list.iter().skip(self.used).position(continues);
        let at = found.map_or(self.list.len(), |i| self.used + i);
        if at == self.list.len() {
            self.list.push(ContactManifold::new());
        }
        self.list.swap(self.used, at);
        let flipped = self.flipped;
        let manifold = &mut self.list[self.used];
        self.used += 1;

        let placed = part_pose.map_or(self.pose, |inner| self.pose * inner);
        let inverse = placed.inverse();
        let normal = to_vector(touch.normal);
        let other = from_pose(&placed).apply_inverse(touch.points[1]);
        let [p1, p2] = [to_vector(touch.points[0]), to_vector(other)];
        let none = PackedFeatureId::face(0);
        let contact = TrackedContact::flipped(p1, p2, fid, none, to_real(touch.gap), flipped);
        match manifold.points.first_mut() {
            Some(known) => known.copy_geometry_from(contact),
            None => manifold.points.push(contact),
        }
        set_frames(manifold, (normal, inverse.rotation * -normal), (part, part_pose), flipped);
    }

    /// Removes the manifolds of earlier steps.
    pub(crate) fn finish(self) {
        self.list.truncate(self.used);
    }
}

fn set_frames<M, C: Default + Copy>(
    manifold: &mut ContactManifold<M, C>,
    (of_scan, of_other): (Vector, Vector),
    (part, part_pose): (u32, Option<Pose>),
    flipped: bool,
) {
    if flipped {
        (manifold.local_n1, manifold.local_n2) = (of_other, of_scan);
        (manifold.subshape1, manifold.subshape2) = (part, 0);
        manifold.set_subshape_pos1(part_pose);
    } else {
        (manifold.local_n1, manifold.local_n2) = (of_scan, of_other);
        (manifold.subshape1, manifold.subshape2) = (0, part);
        manifold.set_subshape_pos2(part_pose);
    }
}
