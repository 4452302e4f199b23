//! Graphs of known shapes: borders, slits, outliers, density.
use nearmiss_graph::{Adjacency, GraphOptions, PointGraph, Prune};
use nearmiss_testdata::shapes::{self, Form, Order, Sampling};

type Point = [f32; 3];

/// Samples of a form, sorted along its longest axis, so that consecutive points are near each
/// other.
#[expect(clippy::cast_possible_truncation, reason = "points are stored in single precision")]
fn samples(form: Form, order: Order, noise: f64, spacing: f64) -> Vec<Point> {
    let shape = form.sample(Sampling { spacing, noise, order, seed: 5 });
    let mut points: Vec<Point> = shape.points.iter().map(|p| p.map(|x| x as f32)).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    points
}

fn build(points: &[Point]) -> PointGraph {
    PointGraph::build(points, &GraphOptions::default()).unwrap()
}

#[test]
fn closed_shapes_have_no_border() {
    let forms = [
        shapes::sphere(1.0),
        shapes::torus(1.0, 0.3),
        shapes::cuboid([1.0; 3]),
        shapes::avatar(1.8, 0.3),
        shapes::field([2, 2, 1], 3.0, 1.0),
    ];
    for form in forms {
        let (name, spacing) = (form.name, form.spacing_for(6000));
        for (order, noise) in [(Order::Regular, 0.0), (Order::Random, 0.0), (Order::Random, 0.2)] {
            let points = samples(form.clone(), order, noise, spacing);
            let counts = build(&points).counts();
            assert_eq!(counts.border, 0, "{name}, {order:?}, noise {noise}: of {}", counts.points);
            let parts = if form.connected { 1 } else { form.parts.len() };
            assert_eq!(counts.components, parts, "{name}, {order:?}, noise {noise}");
        }
    }
}

/// Checks that at least the fraction `share` of the points nearer to a border than `near` are
/// found, and no point further than `far`.
fn check_border(graph: &PointGraph, depths: &[f64], (near, share, far): (f64, f64, f64), what: &str) {
    let (mut outermost, mut found) = (0_u32, 0_u32);
    for (i, &depth) in depths.iter().enumerate() {
        if depth < near {
            outermost += 1;
            found += u32::from(graph.is_border(i));
        }
        assert!(depth < far || !graph.is_border(i), "{what}: point {i}, {depth} inside");
    }
    assert!(f64::from(found) >= share * f64::from(outermost), "{what}: {found} of {outermost}");
    assert!(outermost > 10, "{what}: {outermost} points are no border");
}

#[test]
fn borders_are_where_the_samples_end() {
    let side = 60.0;
    for (order, noise) in [(Order::Regular, 0.0), (Order::Random, 0.0), (Order::Random, 0.2)] {
        let mut points = samples(shapes::patch(side, side), order, noise, 1.0);
        let edge = |p: &Point| 0.5 * side - f64::from(p[0].abs().max(p[1].abs()));
        let depths: Vec<f64> = points.iter().map(edge).collect();
        check_border(&build(&points), &depths, (0.2, 1.0, 2.0), &format!("patch, {order:?}, {noise}"));

        let hole = 10.0;
        let inside = |p: &Point| f64::from(p[0].hypot(p[1])) - hole;
        points.retain(|p| inside(p) >= 0.0 && edge(p) > 0.2);
        let depths: Vec<f64> = points.iter().map(|p| inside(p).min(edge(p) - 0.2)).collect();
        check_border(&build(&points), &depths, (0.3, 0.9, 2.5), &format!("hole, {order:?}, {noise}"));
    }
}

fn across(adjacency: &Adjacency, points: &[Point]) -> usize {
    adjacency.edges().filter(|&[a, b]| points[a as usize][0] * points[b as usize][0] < 0.0).count()
}

/// Klein & Zachmann 2005, fig. 5: the surface ends at the slit, but a search may cross it.
#[test]
fn a_slit_is_bridged_by_virtual_edges_alone() {
    let mut points = samples(shapes::patch(60.0, 60.0), Order::Random, 0.1, 1.0);
    points.retain(|p| p[0].abs() > 1.5);
    let graph = build(&points);
    assert_eq!(across(graph.edges(), &points), 0, "edges across");
    assert!(across(graph.virtual_edges(), &points) > 0, "no virtual edge across");
    assert_eq!(graph.counts().components, 2);
    let sides = |i: usize| points[i][0] < 0.0;
    let first = points.iter().position(|p| p[0] > 0.0).unwrap();
    assert!((0..points.len()).all(|i| graph.components()[i] as usize == if sides(i) { 0 } else { first }));
    // Without pruning there is one component.
    let all = PointGraph::build(&points, &GraphOptions::default().with_prune(Prune::Never)).unwrap();
    assert_eq!(all.counts().components, 1);
}

#[test]
fn what_lies_off_the_surface_is_mostly_cut_off_it() {
    let mut points = samples(shapes::patch(60.0, 60.0), Order::Random, 0.1, 1.0);
    let surface = points.len();
    points.extend((50..surface).step_by(100).map(|i| [points[i][0], points[i][1], 3.0]).collect::<Vec<_>>());
    let graph = build(&points);
    let off = |adjacency: &Adjacency| adjacency.edges().filter(|e| e[1] as usize >= surface).count();
    let (kept, cut) = (off(graph.edges()), off(graph.virtual_edges()));
    assert!(cut > 8 * kept, "{cut} virtual, {kept} on the surface");
}

#[test]
fn density_is_that_of_the_samples() {
    for spacing in [0.5, 2.0] {
        let points = samples(shapes::patch(60.0, 60.0), Order::Random, 0.0, spacing);
        let graph = build(&points);
        let mut densities: Vec<f64> = (0..points.len()).map(|i| graph.density(i)).collect();
        densities.sort_by(f64::total_cmp);
        let median = densities[densities.len() / 2] * spacing * spacing;
        assert!((0.8..1.2).contains(&median), "{median} points a unit of spacing²");
        let reaches = graph.reaches();
        assert!(reaches.iter().all(|&r| f64::from(r) < 5.0 * spacing), "edges are short");
    }
}
