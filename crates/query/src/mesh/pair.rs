//! A pair of placed meshes and the questions about it.

use fearless_simd::Level;
use nearmiss_hierarchy::{Heap, Open, Stack};

use crate::ask::answer::Statistics;
use crate::ask::budget::Budget;
use crate::distance::Frontier;
use crate::mesh::answer::{MeshAnswer, MeshContact, MeshVerdict};
use crate::mesh::collide::collide;
use crate::mesh::distance::{MeshDistance, distance};
use crate::mesh::hint::MeshHint;
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::penetration::penetration;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::quality::MeshQuality;
use crate::mesh::solid::MeshSolid;
use crate::mesh::time_critical;
use crate::pair::cell_table::{CellTable, MOST_SHARED};
use crate::penetration::answer::Penetration;
use crate::penetration::search::SearchScratch;

/// Working memory of queries about meshes, one per thread. Reuse it: a query does not allocate once
/// its scratch is warm. It holds no answers and never changes one.
#[derive(Debug, Clone)]
pub struct MeshScratch {
    level: Level,
    stack: Stack,
    open: Frontier,
    heap: Heap,
    /// The pairs that are open when a time-critical search stops.
    left: Vec<Open>,
    table: Option<CellTable>,
    penetration: SearchScratch,
}

impl Default for MeshScratch {
    fn default() -> Self {
        Self::by_level(Level::new())
    }
}

impl MeshScratch {
    /// A scratch whose queries run with the SIMD instructions of `level` instead of the best
    /// available ones, for comparisons. Answers do not depend on it.
    #[must_use]
    pub fn by_level(level: Level) -> Self {
        Self {
            level,
            stack: Stack::default(),
            open: Frontier::default(),
            heap: Heap::default(),
            left: Vec::new(),
            table: None,
            penetration: SearchScratch::default(),
        }
    }

    /// The instructions to use, and an empty stack.
    pub(crate) fn stack(&mut self) -> (Level, &mut Stack) {
        (self.level, &mut self.stack)
    }

    /// The memory of a penetration.
    pub(crate) fn of_penetration(&mut self) -> (Level, &mut Stack, &mut SearchScratch) {
        (self.level, &mut self.stack, &mut self.penetration)
    }
}

/// Two placed meshes and the budget of each question about them.
///
/// ```
/// use nearmiss_geometry::{Pose, TriangleMesh};
/// use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
/// use nearmiss_query::{MeshPair, MeshScratch, MeshVerdict, PlacedMesh};
///
/// let corners = vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
/// let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]])?;
/// let prepared = MeshHierarchy::build(&mesh, &MeshBuildOptions::default())?;
///
/// let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2);
/// let at = |height| {
///     let pose = upright.with_translation([0.5, 1.0, height]);
///     MeshPair::new(PlacedMesh::new(&prepared, &Pose::IDENTITY), PlacedMesh::new(&prepared, &pose))
/// };
/// let mut scratch = MeshScratch::default();
/// let MeshVerdict::Intersecting(contact) = at(-1.0).collide(&mut scratch).verdict else {
///     panic!("the upright triangle passes through the lying one");
/// };
/// assert!((contact.point[1] - 1.0).abs() < 1e-12 && contact.point[2].abs() < 1e-12);
/// assert!(at(0.5).collide(&mut scratch).verdict.is_separated());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct MeshPair<'a> {
    meshes: [PlacedMesh<'a>; 2],
    budget: Budget,
}

impl<'a> MeshPair<'a> {
    /// A pair with an unlimited budget.
    #[inline]
    #[must_use]
    pub fn new(a: PlacedMesh<'a>, b: PlacedMesh<'a>) -> Self {
        Self { meshes: [a, b], budget: Budget::UNLIMITED }
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

    /// Both meshes.
    #[must_use]
    pub fn meshes(&self) -> &[PlacedMesh<'a>; 2] {
        &self.meshes
    }

    /// Decides whether a triangle of a and a triangle of b share a point. Exact without a budget;
    /// touching counts. With a budget of work or time, the most probable pairs of nodes come first.
    /// Does not allocate once `scratch` is warm.
    pub fn collide(&self, scratch: &mut MeshScratch) -> MeshAnswer {
        if self.budget.may_end() {
            return self.collide_likely(&MeshQuality::default(), scratch);
        }
        let MeshScratch { level, stack, .. } = scratch;
        self.ask(*level, |pair| collide(pair, stack, None, None)).unwrap_or(INVALID)
    }

    /// Decides whether the meshes meet as well as `quality` asks for, and as the budget allows: the
    /// most probable pair of nodes first, until enough of them are probable enough.
    ///
    /// A separation is exact, and so is a contact of two triangles. Otherwise the verdict is
    /// [`MeshVerdict::Undecided`], with the likelihood of a contact and where it is likeliest.
    pub fn collide_likely(&self, quality: &MeshQuality, scratch: &mut MeshScratch) -> MeshAnswer {
        if scratch.table.as_ref().is_none_or(|table| table.shared() != quality.shared) {
            scratch.table = Some(CellTable::new(quality.shared.clamp(1, MOST_SHARED)));
        }
        let MeshScratch { level, heap, stack, left, table, .. } = scratch;
        let Some(table) = table else { return INVALID };
        let (may_end, memory) = (self.budget.may_end(), (heap, stack, left));
        let ask = |pair: &mut MeshPairing<'_>| time_critical::collide(pair, quality, table, may_end, memory);
        self.ask(*level, ask).unwrap_or(INVALID)
    }

    /// Like [`Self::collide`], but starts from `hint`, and updates it. Takes no search if the triangles
    /// of the last contact still meet, or while separated meshes have moved by less than the distance
    /// that the last search or [`Self::distance_hinted`] proved.
    pub fn collide_hinted(&self, hint: &mut MeshHint, scratch: &mut MeshScratch) -> MeshAnswer {
        let MeshScratch { level, stack, .. } = scratch;
        self.ask(*level, |pair| collide(pair, stack, Some(hint), None)).unwrap_or(INVALID)
    }

    /// Finds every pair of triangles that meet and writes their contacts to `contacts`, as far as
    /// the budget lasts. Returns the answer, and `true` if the list is complete.
    ///
    /// Costs a descent to all intersecting leaves, and about 1.5 µs for each contact.
    pub fn contacts(&self, contacts: &mut Vec<MeshContact>, scratch: &mut MeshScratch) -> (MeshAnswer, bool) {
        contacts.clear();
        let mut complete = false;
        let MeshScratch { level, stack, .. } = scratch;
        let all = (contacts, &mut complete);
        let answer = self.ask(*level, |pair| collide(pair, stack, None, Some(all))).unwrap_or(INVALID);
        (answer, complete)
    }

    /// Bounds the distance of the meshes: lower ≤ distance ≤ upper. Both bounds are valid whenever
    /// the budget ends the search, and equal without one. Meshes that meet have distance 0.
    ///
    /// Does not allocate once `scratch` is warm.
    pub fn distance(&self, scratch: &mut MeshScratch) -> MeshDistance {
        let MeshScratch { level, open, .. } = scratch;
        self.ask(*level, |pair| distance(pair, open, None)).unwrap_or(UNKNOWN)
    }

    /// Like [`Self::distance`], but starts from the triangles of `hint`, which are those of the last
    /// query, and updates it. Much faster if the poses changed little.
    pub fn distance_hinted(&self, hint: &mut MeshHint, scratch: &mut MeshScratch) -> MeshDistance {
        let MeshScratch { level, open, .. } = scratch;
        self.ask(*level, |pair| distance(pair, open, Some(hint))).unwrap_or(UNKNOWN)
    }

    /// Bounds the penetration of the meshes: how far b must at least be shifted, in any direction, to be
    /// separate from a. `solids` tells which parts of the meshes are closed; within these, meshes overlap
    /// even if no triangles meet.
    ///
    /// Both bounds are valid whenever the budget ends the search. The upper one comes from a shift that
    /// was tested exactly, as by [`Self::collide`], and is a local minimum: a shorter shift may exist
    /// in a direction that was not tried. The lower one is proven; it is close to the upper one where
    /// faces or round parts overlap a little, and further below at corners, edges and deep overlaps.
    ///
    /// Costs 300 to 1000 boolean queries without a budget, and up to 1600 searches for the point of a mesh
    /// nearest to a place if both are closed. Does not allocate once `scratch` is warm.
    pub fn penetration(&self, solids: [&MeshSolid; 2], scratch: &mut MeshScratch) -> Penetration {
        let (level, stack, own) = scratch.of_penetration();
        penetration(self.meshes, solids, &self.budget, (level, stack), own)
    }

    /// Calls `ask` with the pair under its relative pose; `None` if a pose is invalid.
    #[inline]
    fn ask<R>(&self, level: Level, ask: impl FnOnce(&mut MeshPairing<'_>) -> R) -> Option<R> {
        // An array by `map` would be copied.
        let views = [self.meshes[0].mesh().arrays(), self.meshes[1].mesh().arrays()];
        let mut pair = MeshPairing::new(&self.meshes, views.each_ref(), &self.budget, level)?;
        Some(ask(&mut pair))
    }
}

/// The answer for an invalid pose.
pub(crate) const INVALID: MeshAnswer =
    MeshAnswer { verdict: MeshVerdict::Pose, likelihood: 0.5, statistics: NOTHING };

/// The distance for an invalid pose.
const UNKNOWN: MeshDistance = MeshDistance {
    lower: 0.0,
    upper: f64::INFINITY,
    points: [[0.0; 3]; 2],
    triangles: [0; 2],
    complete: false,
    statistics: NOTHING,
};

/// No cost.
const NOTHING: Statistics = Statistics { evaluations: 0, node_pairs: 0, leaf_pairs: 0, neighbour_steps: 0 };
