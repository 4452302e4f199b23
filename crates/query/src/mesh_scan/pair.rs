//! A placed scan, a placed mesh, and the questions about them.

use crate::ask::answer::{Answer, Contacts};
use crate::ask::budget::Budget;
use crate::distance::{Distance, DistancePlan};
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::MeshSolid;
use crate::mesh_scan::collide::{AskedOfMesh, collide};
use crate::mesh_scan::distance::distance;
use crate::mesh_scan::hint::MeshScanHint;
use crate::mesh_scan::penetration::penetration;
use crate::mesh_scan::plan::MeshScanPlan;
use crate::pair::placed::Placed;
use crate::penetration::answer::{Interior, Penetration};
use crate::question::Scratch;

/// A placed scan, a placed mesh, and the budget of each question about them.
///
/// The mesh is exact, and the scan has the meaning that it has against another scan
/// (`docs/theory/obstacle.md`). In contacts and distances the scan comes first: the first normal,
/// source or point is that of the scan, the second that of the mesh. The second source is the number
/// of the triangle in the caller's mesh.
///
/// ```
/// use nearmiss_geometry::{PointCloud, Pose, TriangleMesh};
/// use nearmiss_hierarchy::{BuildOptions, MeshBuildOptions, MeshHierarchy, PointHierarchy};
/// use nearmiss_query::{
///     CollideOptions, DistanceOptions, DistancePlan, Evidence, MeshScanPair, MeshScanPlan, PlacedMesh,
///     Prepared, Scratch, Verdict,
/// };
///
/// // A scanned floor, and a triangle that stands on its tip.
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let corners = vec![[0.0, 0.0, 0.0], [0.2, 0.0, 0.5], [-0.2, 0.0, 0.5]];
/// let tip = TriangleMesh::new(corners, vec![[0, 1, 2]])?;
/// let tip = MeshHierarchy::build(&tip, &MeshBuildOptions::default())?;
///
/// let mut scratch = Scratch::default();
/// let at = |height| {
///     let pose = Pose::from_translation([0.5, 0.5, height]);
///     MeshScanPair::new(floor.at(&Pose::IDENTITY), PlacedMesh::new(&tip, &pose))
/// };
/// let options = CollideOptions::default();
/// let plan = MeshScanPlan::new(&options, &floor)?;
/// let Verdict::Intersecting { contact, evidence } = at(-0.1).collide(&plan, &mut scratch).verdict else {
///     panic!("the tip is below the floor");
/// };
/// assert!(evidence == Evidence::Certified && contact.point[2].abs() < 1e-6);
/// let Verdict::Separated { gap, evidence } = at(0.3).collide(&plan, &mut scratch).verdict else {
///     panic!("the tip is above the floor");
/// };
/// assert!(evidence == Evidence::Certified && (0.25..=0.3).contains(&gap));
///
/// let plan = DistancePlan::against_mesh(&DistanceOptions::default(), &floor)?;
/// let distance = at(0.3).distance(&plan, &mut scratch);
/// assert!(distance.lower <= 0.3 && (0.3 - 1e-6..0.301).contains(&distance.upper));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct MeshScanPair<'a> {
    scan: Placed<'a>,
    mesh: PlacedMesh<'a>,
    budget: Budget,
}

impl<'a> MeshScanPair<'a> {
    /// A pair with an unlimited budget.
    #[inline]
    #[must_use]
    pub fn new(scan: Placed<'a>, mesh: PlacedMesh<'a>) -> Self {
        Self { scan, mesh, budget: Budget::UNLIMITED }
    }

    /// The same pair with this budget for each question. A resolution is ignored.
    #[inline]
    #[must_use]
    pub fn within(self, budget: &Budget) -> Self {
        Self { budget: *budget, ..self }
    }

    /// The budget of each question.
    pub(crate) fn budget(&self) -> &Budget {
        &self.budget
    }

    /// The scan.
    #[must_use]
    pub fn scan(&self) -> &Placed<'a> {
        &self.scan
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &PlacedMesh<'a> {
        &self.mesh
    }

    /// Decides whether the mesh meets the scan, with the meaning of `plan`.
    ///
    /// A contact is certified if a point on a triangle and on the surface of the scan was verified,
    /// if a triangle meets the ball of a point, or if it is within the margin of a measured point. A
    /// separation is certified by enclosures and by the points of leaves
    /// (`docs/theory/obstacle.md`). The mesh is open or closed alike: a scan inside a closed mesh
    /// does not meet it.
    ///
    /// Does not allocate once `scratch` is warm. Deterministic: a question without a deadline
    /// always has the same answer.
    pub fn collide(&self, plan: &MeshScanPlan, scratch: &mut Scratch) -> Answer {
        collide(self.asked(plan), &mut scratch.contact, (None, None))
    }

    /// Like [`Self::collide`], but starts from what `hint` knows, and updates it; see
    /// [`MeshScanHint`].
    pub fn collide_hinted(
        &self,
        plan: &MeshScanPlan,
        hint: &mut MeshScanHint,
        scratch: &mut Scratch,
    ) -> Answer {
        collide(self.asked(plan), &mut scratch.contact, (Some(hint), None))
    }

    /// Like [`Self::collide`], but continues after the first contact and writes one contact per pair
    /// of a leaf of the scan and a leaf of the mesh that meet to `contacts`, as far as the budget
    /// lasts. The contacts are accurate to first order; that of the answer is the first of a few
    /// that is certified, or else the first.
    pub fn contacts(&self, plan: &MeshScanPlan, contacts: &mut Contacts, scratch: &mut Scratch) -> Answer {
        collide(self.asked(plan), &mut scratch.contact, (None, Some(contacts)))
    }

    /// Bounds the distance of the scan and the mesh: lower ≤ distance ≤ upper. Both bounds are valid
    /// whenever the budget ends the search.
    ///
    /// `upper` is the distance of a measured point, of a ball about one, or of a verified point of
    /// the surface from a triangle. It is 0 if they [meet](Self::collide). `lower` is proven by
    /// enclosures and points; it ends within a tenth of `upper`
    /// ([`DistanceOptions::relative`](crate::DistanceOptions)) or at the last leaf pair. With
    /// [`Semantics::Thickened`](crate::Semantics::Thickened) it is the distance of the nearest point
    /// less the radius, and both bounds equal it once the search is complete.
    ///
    /// Does not allocate once `scratch` is warm.
    pub fn distance(&self, plan: &DistancePlan, scratch: &mut Scratch) -> Distance {
        let Scratch { contact, distance: open, .. } = scratch;
        distance((&self.scan, &self.mesh), plan, &self.budget, (open, contact), None)
    }

    /// Like [`Self::distance`], but starts from the nearest point and triangle of the last query, and
    /// updates them. Of several nearest ones, others may be found.
    pub fn distance_hinted(
        &self,
        plan: &DistancePlan,
        hint: &mut MeshScanHint,
        scratch: &mut Scratch,
    ) -> Distance {
        let Scratch { contact, distance: open, .. } = scratch;
        distance((&self.scan, &self.mesh), plan, &self.budget, (open, contact), Some(hint))
    }

    /// Bounds the penetration of the scan and the mesh: how far the mesh must at least be shifted, in any
    /// direction, to be separate from the scan. Separate means that [`collide`](Self::collide) separates
    /// them, and that no part of one is inside the other one if that is solid: the scan by `interior`, the
    /// mesh by its closed parts in `solid`, which must be those of this mesh.
    ///
    /// Has the bounds, their validity and the cost that [`Pair::penetration`](crate::Pair::penetration)
    /// has. The lower bound is 0 if the scan is hollow and the mesh has no closed part.
    ///
    /// ```
    /// use nearmiss_geometry::{PointCloud, Pose, TriangleMesh};
    /// use nearmiss_hierarchy::{BuildOptions, MeshBuildOptions, MeshHierarchy, PointHierarchy};
    /// use nearmiss_query::{
    ///     CollideOptions, Interior, MeshScanPair, MeshScanPlan, MeshSolid, PlacedMesh, Prepared, Scratch,
    /// };
    ///
    /// // A tetrahedron whose tip is 0.1 below a scanned floor.
    /// let points: Vec<[f32; 3]> =
    ///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
    /// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
    /// let corners = vec![[0.5, 0.5, -0.1], [0.8, 0.5, 0.6], [0.3, 0.8, 0.6], [0.3, 0.2, 0.6]];
    /// let tip = TriangleMesh::new(corners, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])?;
    /// let tip = MeshHierarchy::build(&tip, &MeshBuildOptions::default())?;
    ///
    /// let plan = MeshScanPlan::new(&CollideOptions::default(), &floor)?;
    /// let pair = MeshScanPair::new(floor.at(&Pose::IDENTITY), PlacedMesh::new(&tip, &Pose::IDENTITY));
    /// let solid = MeshSolid::new(&tip);
    /// let found = pair.penetration(&plan, (Interior::Hollow, &solid), &mut Scratch::default());
    /// assert!(found.lower > 0.0 && (found.upper - 0.1).abs() < 0.01, "{found:?}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn penetration(
        &self,
        plan: &MeshScanPlan,
        (interior, solid): (Interior, &MeshSolid),
        scratch: &mut Scratch,
    ) -> Penetration {
        let Scratch { contact, solid: shapes, penetration: own, .. } = scratch;
        let working = (contact, &mut shapes.crossings);
        penetration((self.scan, self.mesh), (interior, solid), (plan, &self.budget), working, own)
    }

    fn asked<'q>(&'q self, plan: &'q MeshScanPlan) -> AskedOfMesh<'q> {
        AskedOfMesh { scan: &self.scan, mesh: &self.mesh, plan, budget: &self.budget }
    }
}
