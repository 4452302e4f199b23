//! Small versions of everything that a program does with a prepared mesh: queries in a few poses,
//! checks, and saving.

use nearmiss::{Budget, Mesh, MeshAnswer, MeshDistance, MeshHint, MeshPair, MeshScratch, Pose};

/// The answers of a mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct MeshAnswers {
    /// Answers to queries about the mesh and another one, and itself.
    pub(crate) collide: Vec<MeshAnswer>,
    /// The triangles that meet, for each of these queries, in ascending order.
    pub(crate) contacts: Vec<Vec<[u32; 2]>>,
    /// The distances.
    pub(crate) distances: Vec<MeshDistance>,
}

impl MeshAnswers {
    /// Returns what depends on the shape of the meshes alone: which queries find a contact, how
    /// many triangles meet, and the distances.
    pub(crate) fn of_shape(&self) -> Vec<(bool, bool, usize, [f64; 2])> {
        let contacts = self.contacts.iter().map(Vec::len);
        let distances = self.distances.iter().map(|found| [found.lower, found.upper]);
        let verdicts = self.collide.iter().map(|a| (a.verdict.is_intersecting(), a.verdict.is_separated()));
        verdicts.zip(contacts).zip(distances).map(|(((hit, miss), n), d)| (hit, miss, n, d)).collect()
    }
}

/// Poses of the other mesh: coincident, slightly off, across the rim, and far away.
fn poses(size: f64) -> [Pose; 4] {
    let turn = Pose::from_axis_angle([1.0, 2.0, 3.0], 0.7);
    [
        Pose::IDENTITY,
        turn.with_translation([0.01 * size, 0.0, 0.02 * size]),
        turn.with_translation([0.6 * size, 0.2 * size, 0.1 * size]),
        Pose::from_translation([9.0 * size, 0.0, 0.0]),
    ]
}

/// Runs all queries on `mesh`, with `other` as the second mesh.
///
/// # Panics
/// Panics if a hint changes a verdict about a valid mesh, if a query costs more than comparing all
/// pairs of nodes several times, if a small budget is exceeded, or if the mesh cannot be written.
#[must_use]
pub(crate) fn exercise_mesh(mesh: &Mesh, other: &Mesh) -> MeshAnswers {
    let is_sound = mesh.check_contents().is_ok();
    let size = other.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let nodes = mesh.topology().len().max(other.topology().len()) as u64;
    let everything = 4 * nodes * nodes + 64;
    let mut answers = MeshAnswers::default();
    let (mut scratch, mut hint) = (MeshScratch::default(), MeshHint::default());
    for pose in poses(size) {
        for (a, b) in [(mesh, other), (other, mesh), (mesh, mesh)] {
            let pair = MeshPair::new(a.at(&Pose::IDENTITY), b.at(&pose));
            let answer = pair.collide(&mut scratch);
            let hinted = pair.collide_hinted(&mut hint, &mut scratch);
            // Among damaged boxes a search may miss the triangles that a hint names.
            assert!(
                !is_sound || answer.verdict.is_intersecting() == hinted.verdict.is_intersecting(),
                "a hint changes no verdict: {answer:?}, {hinted:?}"
            );
            let mut contacts = Vec::new();
            let (all, _complete) = pair.contacts(&mut contacts, &mut scratch);
            let distance = pair.distance(&mut scratch);
            let again = pair.distance_hinted(&mut hint, &mut scratch);
            for cost in [answer.statistics, all.statistics, distance.statistics, again.statistics] {
                assert!(cost.node_pairs <= everything && cost.leaf_pairs <= everything, "{cost:?}");
            }
            let short = pair.within(&Budget::UNLIMITED.with_work(40)).collide(&mut scratch);
            assert!(short.statistics.node_pairs <= 100, "{short:?}");
            let mut met: Vec<[u32; 2]> = contacts.iter().map(|contact| contact.triangles).collect();
            met.sort_unstable();
            answers.collide.push(answer);
            answers.contacts.push(met);
            answers.distances.push(distance);
        }
    }
    let mut sink = std::io::sink();
    assert!(mesh.write_to(&mut sink).is_ok(), "what was loaded can be saved");
    answers
}
