//! Small versions of everything that a program does with the graph of a scan.

use nearmiss::graph::{GeodesicScratch, KernelScratch, LevelScratch};
use nearmiss::{Pose, Scan};

/// The answers of a graph; lengths are stored as bits.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct GraphAnswers {
    counts: Vec<usize>,
    lengths: Vec<Option<u32>>,
    paths: Vec<Vec<u32>>,
    values: Vec<u64>,
}

/// Runs all queries on the graph of `scan`, if it has one.
///
/// # Panics
/// Panics if an evaluation is NaN, or if a path does not lead to its end.
pub(crate) fn exercise_graph(scan: &Scan) -> Option<GraphAnswers> {
    let graph = scan.graph()?;
    let mut answers = GraphAnswers::default();
    let counts = graph.counts();
    answers.counts = vec![counts.edges, counts.virtual_edges, counts.components, counts.border];
    answers.counts.extend(graph.byte_lens());
    answers.counts.extend(graph.parts().map(|part| part.points as usize + usize::from(part.orientable)));
    answers.counts.extend(graph.confidence().iter().map(|&c| usize::from(c)));
    let (points, positions) = (graph.points(), scan.positions());
    answers.counts.push(points.edges().edges().chain(points.virtual_edges().edges()).count());
    answers.values.extend((0..scan.len()).map(|i| points.density(i).to_bits()));
    let network = graph.network(positions);
    let n = u32::try_from(scan.len()).unwrap();
    let ends = || (0..n).step_by(scan.len() / 9 + 1).map(|i| [i, (i + 1 + n / 3) % n]);
    let (mut search, mut far, mut path) = (GeodesicScratch::default(), LevelScratch::default(), Vec::new());
    for [i, j] in ends() {
        let mut keep = |length: Option<f32>, path: &Vec<u32>| {
            assert_eq!(length.is_some(), !path.is_empty(), "a length has a path");
            assert!(length.is_none() || path.first() == Some(&i), "{path:?} from {i}");
            answers.lengths.push(length.map(f32::to_bits));
            answers.paths.push(path.clone());
        };
        keep(search.path(network, i, j, &mut path), &path);
        keep(graph.levels(positions, scan.radii()).path(network, [i, j], &mut far, &mut path), &path);
        answers.counts.push(search.within(network, i, scan.radii()[i as usize]).len());
        let Some(pairs) = graph.close_pairs() else { continue };
        for close in pairs.of(i as usize).take(20) {
            let length = pairs.path(network, [i, close.point], &mut search, &mut path);
            assert_eq!(length.is_some(), !path.is_empty(), "a length has a path");
            answers.lengths.push(length.map(f32::to_bits));
            answers.paths.push(path.clone());
        }
    }
    for cells in graph.levels(positions, scan.radii()).cells() {
        let network = cells.network();
        let goal = u32::try_from(cells.len()).unwrap() - 1;
        let length = search.path(network, 0, goal, &mut path);
        let mut fine = Vec::new();
        cells.expand(&path, &mut fine);
        answers.lengths.push(length.map(f32::to_bits));
        answers.paths.push(fine);
    }
    if let Some(kernel) = scan.geodesic_kernel() {
        let (view, mut scratch) = (scan.at(&Pose::IDENTITY), KernelScratch::default());
        let off = 0.3 * scan.sampling_radius();
        let near = (0..scan.len()).step_by(scan.len() / 40 + 1).map(|i| view.point(i).map(|x| x + off));
        for x in near.chain([[0.0; 3], [1e30; 3], [-1e300; 3], [f64::MAX; 3]]) {
            let at = view.evaluate_by(&kernel, x, &mut scratch);
            assert!(at.f.is_finite() && at.bandwidth.is_finite(), "{at:?} at {x:?}");
            answers.values.push(at.f.to_bits());
        }
    }
    Some(answers)
}
