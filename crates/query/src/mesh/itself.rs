//! Collisions of a mesh with itself.

use nearmiss_hierarchy::Stack;

use crate::ask::budget::Budget;
use crate::mesh::answer::{MeshAnswer, MeshContact};
use crate::mesh::collide::collide;
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::pair::{INVALID, MeshScratch};
use crate::mesh::placed::PlacedMesh;

/// A placed mesh, compared with itself: the pairs of its triangles that have no corner in common.
///
/// Triangles with a common corner, or with corners at the same place, always meet there. Whether
/// they meet elsewhere, too, as those of a sharp fold do, is not examined.
///
/// ```
/// use nearmiss_geometry::{Pose, TriangleMesh};
/// use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
/// use nearmiss_query::{MeshItself, MeshScratch, PlacedMesh};
///
/// // A triangle, and another that passes through it or is beside it.
/// let mut scratch = MeshScratch::default();
/// let mut meets = |x: f64| -> Result<bool, Box<dyn std::error::Error>> {
///     let lying = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
///     let upright = [[x, 1.0, -1.0], [x, 2.0, -1.0], [x, 1.0, 1.0]];
///     let mesh = TriangleMesh::new([lying, upright].concat(), vec![[0, 1, 2], [3, 4, 5]])?;
///     let mesh = MeshHierarchy::build(&mesh, &MeshBuildOptions::default())?;
///     let placed = PlacedMesh::new(&mesh, &Pose::IDENTITY);
///     Ok(MeshItself::new(placed).collide(&mut scratch).verdict.is_intersecting())
/// };
/// assert!(meets(1.0)? && !meets(5.0)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct MeshItself<'a> {
    mesh: PlacedMesh<'a>,
    budget: Budget,
}

impl<'a> MeshItself<'a> {
    /// A question without a limit.
    #[inline]
    #[must_use]
    pub fn new(mesh: PlacedMesh<'a>) -> Self {
        Self { mesh, budget: Budget::UNLIMITED }
    }

    /// The same question with this budget. A resolution is ignored.
    #[inline]
    #[must_use]
    pub fn within(self, budget: &Budget) -> Self {
        Self { budget: *budget, ..self }
    }

    /// Decides whether two triangles without a common corner share a point. Exact without a budget;
    /// touching counts. Does not allocate once `scratch` is warm.
    ///
    /// Costs a descent to all pairs of leaves whose boxes overlap, each leaf and its neighbours
    /// among them.
    pub fn collide(&self, scratch: &mut MeshScratch) -> MeshAnswer {
        self.ask(scratch, |pair, stack| collide(pair, stack, None, None)).unwrap_or(INVALID)
    }

    /// Finds every pair of triangles without a common corner that meet, each pair once, as far as
    /// the budget lasts. Returns the answer, and `true` if the list is complete.
    pub fn contacts(&self, contacts: &mut Vec<MeshContact>, scratch: &mut MeshScratch) -> (MeshAnswer, bool) {
        contacts.clear();
        let mut complete = false;
        let all = Some((contacts, &mut complete));
        let answer = self.ask(scratch, |pair, stack| collide(pair, stack, None, all));
        (answer.unwrap_or(INVALID), complete)
    }

    fn ask<R>(
        &self,
        scratch: &mut MeshScratch,
        ask: impl FnOnce(&mut MeshPairing<'_>, &mut Stack) -> R,
    ) -> Option<R> {
        let view = self.mesh.mesh().arrays();
        let (level, stack) = scratch.stack();
        let meshes = [self.mesh; 2];
        let mut pair = MeshPairing::new(&meshes, [&view; 2], &self.budget, level)?.of_itself();
        Some(ask(&mut pair, stack))
    }
}
