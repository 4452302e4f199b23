//! Coarser levels: guarantees about centres and cells, and paths compared with searches of the
//! whole graph.
use crate::clouds::{Cloud, single};
use nearmiss_graph::{Adjacency, GeodesicScratch, LevelCells, LevelScratch, Levels, Network};
use nearmiss_testdata::arbitrary::{CloudKind, cloud};
use nearmiss_testdata::shapes::{Form, bowl, plates, torus};

fn torus_cloud() -> Cloud {
    Cloud::of_form(torus(1.0, 0.4), 0.05, 0.1, 3)
}

/// Checks the guarantees of one level.
fn check(network: Network<'_>, radii: &[f32], cells: &LevelCells) {
    let mut scratch = GeodesicScratch::default();
    let n = u32::try_from(network.len()).unwrap();
    assert!(cells.centres().windows(2).all(|two| two[0] < two[1]), "centres ascend");
    // Each centre keeps its distance from earlier ones, and no centre can be added.
    let mut nearest = vec![(f32::INFINITY, u32::MAX); n as usize];
    let mut is_near = vec![false; n as usize];
    for (cell, &centre) in (0..).zip(cells.centres()) {
        assert!(!is_near[centre as usize], "centre {centre} is near another");
        let apart = 1.2 * radii[centre as usize];
        for found in scratch.within(network, centre, f32::MAX) {
            let point = found.point as usize;
            is_near[point] |= found.distance < apart;
            nearest[point] =
                if found.distance < nearest[point].0 { (found.distance, cell) } else { nearest[point] };
        }
    }
    assert!(is_near.iter().all(|&near| near), "a point is far from every centre");
    for point in 0..n as usize {
        // Equally near centres may own the point, and sums from either end differ in their last
        // bits.
        let (found, best) = (cells.distances()[point], nearest[point].0);
        assert!((found - best).abs() <= 1e-5 * best, "point {point}: {found} for {best}");
    }
    // Cells are adjacent if an edge joins them, and paths between centres have the stated length.
    let mut touching = vec![Vec::new(); cells.len()];
    for i in 0..n {
        let mine = cells.owners()[i as usize];
        let others = network.edges(i as usize).map(|(j, _)| cells.owners()[j as usize]);
        touching[mine as usize].extend(others.filter(|&other| other != mine));
    }
    let mut path = Vec::new();
    for (cell, touching) in touching.iter_mut().enumerate() {
        touching.sort_unstable();
        touching.dedup();
        let found: Vec<(u32, f32)> = cells.network().edges(cell).collect();
        assert_eq!(found.iter().map(|edge| edge.0).collect::<Vec<u32>>(), *touching, "about cell {cell}");
        for (other, length) in found {
            cells.expand(&[u32::try_from(cell).unwrap(), other], &mut path);
            assert_eq!(path[0], cells.centres()[cell], "it begins at the centre");
            assert_eq!(path[path.len() - 1], cells.centres()[other as usize], "and ends at the other");
            let along = along(network, &path);
            assert!((along - length).abs() <= 1e-5 * length, "{along} along a way of {length}");
            let direct = scratch.distance(network, path[0], path[path.len() - 1]).unwrap();
            assert!(direct <= length * 1.000_01, "{length} is no way where {direct} is the shortest");
            let back = cells.network().edges(other as usize).find(|edge| edge.0 as usize == cell).unwrap();
            assert_eq!(back.1.to_bits(), length.to_bits(), "the way back is another");
        }
    }
}

/// Returns the length of a path. Each step must be an edge.
fn along(network: Network<'_>, path: &[u32]) -> f32 {
    let step = |two: &[u32]| {
        let edge = network.edges(two[0] as usize).find(|edge| edge.0 == two[1]);
        edge.unwrap_or_else(|| panic!("{two:?} is no edge")).1
    };
    path.windows(2).map(step).sum()
}

#[test]
fn centres_are_apart_and_cells_are_nearest() {
    let kinds = [CloudKind::Random, CloudKind::Clustered, CloudKind::Rings, CloudKind::Lattice];
    let mut clouds: Vec<Cloud> = kinds.map(|kind| Cloud::new(single(&cloud(kind, 900, 2)))).into();
    clouds.push(Cloud::of_form(torus(1.0, 0.4), 0.1, 0.1, 3));
    for cloud in clouds {
        let mut network = Network::new(&cloud.graph, &cloud.lengths);
        let mut radii = &cloud.radii[..];
        let levels = Levels::build(network, radii);
        assert!(!levels.cells().is_empty());
        for cells in levels.cells() {
            check(network, radii, cells);
            (network, radii) = (cells.network(), cells.radii());
        }
    }
}

#[test]
fn a_level_keeps_about_a_quarter() {
    let cloud = torus_cloud();
    let levels = Levels::build(Network::new(&cloud.graph, &cloud.lengths), &cloud.radii);
    let mut finer = cloud.points.len();
    for cells in levels.cells() {
        let ratio = f64::from(u32::try_from(finer).unwrap()) / f64::from(u32::try_from(cells.len()).unwrap());
        assert!((3.0..6.0).contains(&ratio), "{finer} points, {} cells", cells.len());
        finer = cells.len();
    }
    assert!(finer <= 256);
}

/// Returns the mean and the greatest relative excess of paths over the shortest paths, and the
/// fraction of the graph that was searched.
fn excess(form: Form, spacing: f64) -> [f64; 3] {
    let cloud = Cloud::of_form(form, spacing, 0.1, 3);
    let network = Network::new(&cloud.graph, &cloud.lengths);
    let levels = Levels::build(network, &cloud.radii);
    let n = u32::try_from(cloud.points.len()).unwrap();
    let (mut scratch, mut exact, mut path) =
        (LevelScratch::default(), GeodesicScratch::default(), Vec::new());
    let [mut sum, mut worst, mut reached, mut whole] = [0.0; 4];
    let pairs = (0..300_u32).map(|k| [k * 7919 % n, (k * 104_729 + 31) % n]);
    for [a, b] in pairs {
        let found = levels.path(network, [a, b], &mut scratch, &mut path).unwrap();
        let shortest = exact.distance(network, a, b).unwrap();
        assert_eq!((path[0], path[path.len() - 1]), (a, b), "its ends");
        assert!((along(network, &path) - found).abs() <= 1e-5 * found, "{found} is not its length");
        let over = f64::from(found) / f64::from(shortest).max(1e-9) - 1.0;
        assert!(over >= -1e-6 || a == b, "{found} below {shortest}");
        sum += over.max(0.0);
        worst = f64::max(worst, over);
        #[expect(clippy::cast_precision_loss, reason = "some thousand")]
        {
            reached += scratch.reached() as f64;
            whole += exact.reached() as f64;
        }
    }
    [sum / 300.0, worst, reached / whole]
}

#[test]
fn paths_are_almost_the_shortest() {
    for (name, form) in [("torus", torus(1.0, 0.4)), ("bowl", bowl(1.0))] {
        let [mean, worst, share] = excess(form, 0.03);
        // The worst path on the torus goes round the tube on the wrong side.
        assert!(mean < 0.002 && worst < 0.2, "{name}: mean {mean}, worst {worst}");
        assert!(share < 0.5, "{name}: {share} of the points");
    }
}

#[test]
fn no_way_leads_from_part_to_part() {
    let cloud = Cloud::of_form(plates(1.0, 1.0, 0.5), 0.04, 0.0, 2);
    let network = Network::new(&cloud.graph, &cloud.lengths);
    let levels = Levels::build(network, &cloud.radii);
    let above = |up: bool| {
        let found = cloud.points.iter().position(|p| (p[2] > 0.0) == up);
        u32::try_from(found.unwrap()).unwrap()
    };
    let mut scratch = LevelScratch::default();
    assert_eq!(levels.distance(network, above(true), above(false), &mut scratch), None);
    assert_eq!(levels.distance(network, above(true), above(true), &mut scratch), Some(0.0));
    // Without edges no level is useful.
    let graph = Adjacency::from_edges(1000, &[]);
    let lone = Levels::build(Network::new(&graph, &[]), &[1.0; 1000]);
    assert!(lone.cells().is_empty());
    assert_eq!(lone.distance(Network::new(&graph, &[]), 3, 4, &mut scratch), None);
}
