//! Clean meshes against their definition.

use std::collections::BTreeSet;

use nearmiss_geometry::TriangleMesh;
use nearmiss_mesh::{CleanError, CleanMesh, CleanOptions, Corners};
use rand::RngExt;

use super::cases::{on_lattice, random, sorted};

/// A soup of random triangles on a lattice, some degenerate or repeated, with shared vertices.
fn soup(seed: u64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let rng = &mut random(seed);
    let mut vertices: Vec<[f64; 3]> = (0..60).flat_map(|_| on_lattice(rng, 3)).collect();
    let triangles = (0..200).map(|_| [(); 3].map(|()| rng.random_range(0..180))).collect();
    // Not used.
    vertices.push([9.0; 3]);
    (vertices, triangles)
}

/// Exactly zero for small integers.
fn area(t: &Corners) -> f64 {
    let [e, f] = [1, 2].map(|i| [0, 1, 2].map(|k| t[i][k] - t[0][k]));
    (0..3).map(|k| (e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3]).abs()).sum()
}

fn check(vertices: &[[f64; 3]], triangles: &[[u32; 3]], mesh: &CleanMesh, weld: f64) {
    let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let used: BTreeSet<u32> = mesh.triangles().iter().flatten().copied().collect();
    assert_eq!(used.len(), mesh.vertices().len(), "all vertices are used");
    for (i, a) in mesh.vertices().iter().enumerate() {
        for b in &mesh.vertices()[..i] {
            assert!(distance(a, b) > weld, "{a:?} {b:?} are not welded");
        }
    }
    let mut seen = BTreeSet::new();
    assert!(mesh.sources().is_sorted_by(|a, b| a < b), "sources ascend");
    for (i, (&source, &t)) in mesh.sources().iter().zip(mesh.triangles()).enumerate() {
        let mut corners = t;
        corners.sort_unstable();
        assert!(seen.insert(corners), "{t:?} is there twice");
        let corners = mesh.corners(i);
        assert!(area(&corners) > 0.0, "{corners:?} has no area");
        for (corner, v) in corners.iter().zip(triangles[source as usize]) {
            assert!(distance(corner, &vertices[v as usize]) <= weld, "{corner:?} moved");
        }
    }
    let report = mesh.report();
    let removed = report.welded_vertices + report.unused_vertices;
    assert_eq!(report.vertices, mesh.vertices().len() + removed, "{report:?}");
    let removed = report.degenerate_triangles + report.duplicate_triangles;
    assert_eq!(report.triangles, mesh.triangles().len() + removed, "{report:?}");
}

#[test]
fn clean_meshes_are_clean() {
    for seed in 0..40 {
        let (vertices, triangles) = soup(seed);
        for weld in [0.0, 0.9, 1.0, 1.8] {
            let options = CleanOptions::default().with_weld(weld);
            let mesh = CleanMesh::from_parts(&vertices, &triangles, &options).unwrap();
            check(&vertices, &triangles, &mesh, weld);
            let report = *mesh.report();
            assert!(report.degenerate_triangles > 0 && report.welded_vertices > 100, "{report:?}");
            if weld == 0.0 {
                assert!(report.unused_vertices > 0 && !mesh.triangles().is_empty(), "{report:?}");
                let dropped = |i: &u32| mesh.sources().binary_search(i).is_err();
                let key = |i: u32| sorted(triangles[i as usize].map(|v| vertices[v as usize]));
                // Every dropped triangle has no area or is one that was kept before.
                for i in (0..200).filter(dropped) {
                    let mut kept = mesh.sources().iter().take_while(|&&s| s < i);
                    assert!(area(&key(i)) == 0.0 || kept.any(|&s| key(s) == key(i)), "{i} of {seed}");
                }
            }
            // Clean meshes stay as they are.
            let again = CleanMesh::from_parts(mesh.vertices(), mesh.triangles(), &options).unwrap();
            assert_eq!((again.vertices(), again.triangles()), (mesh.vertices(), mesh.triangles()));
        }
    }
}

#[test]
fn the_nearest_kept_vertex_is_welded_to() {
    let vertices: Vec<[f64; 3]> = [0.0, 1.0, 0.45, 0.55, 3.0, 3.0, 1.5]
        .map(|x| [x, 0.0, 0.0])
        .into_iter()
        .chain([[0.0, 5.0, 0.0]])
        .collect();
    let fan: Vec<[u32; 3]> = [[0, 1], [2, 4], [3, 4], [5, 6]].map(|[v, w]| [v, w, 7]).into();
    let options = CleanOptions::default().with_weld(0.5);
    let mesh = CleanMesh::from_parts(&vertices, &fan, &options).unwrap();
    // 0.45 becomes 0, 0.55 and 1.5 become 1.
    let expected = [0.0, 1.0, 3.0].map(|x| [x, 0.0, 0.0]);
    assert_eq!(mesh.vertices()[..3], expected);
    assert_eq!(mesh.triangles(), [[0, 1, 3], [0, 2, 3], [1, 2, 3]]);
    assert_eq!(mesh.sources(), [0, 1, 2]);
    assert_eq!(mesh.report().duplicate_triangles, 1);
}

#[test]
fn zeros_of_both_signs_are_equal() {
    let vertices = [[0.0, 1.0, 0.0], [-0.0, 1.0, -0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let mesh = CleanMesh::from_parts(&vertices, &[[0, 2, 3], [3, 1, 2]], &CleanOptions::default()).unwrap();
    assert_eq!((mesh.vertices().len(), mesh.sources()), (3, &[0][..]));
}

#[test]
fn weld_distances_of_all_sizes_work() {
    let rng = &mut random(9);
    let vertices: Vec<[f64; 3]> = (0..600).map(|_| [(); 3].map(|()| 1e6 + rng.random::<f64>())).collect();
    let triangles: Vec<[u32; 3]> = (0..200).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    for weld in [1e-300, 1e-9, 1e-3, 0.1, 10.0, 1e300] {
        let options = CleanOptions::default().with_weld(weld);
        let mesh = CleanMesh::new(&TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap(), &options);
        check(&vertices, &triangles, &mesh.unwrap(), weld);
    }
}

#[test]
fn broken_meshes_are_rejected() {
    let vertices = [[0.0; 3], [1.0, f64::NAN, 0.0], [0.0, 1.0, 0.0]];
    let refused = CleanMesh::from_parts(&vertices, &[], &CleanOptions::default()).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "expected finite coordinates, got [1.0, NaN, 0.0] (vertex 1); correct or remove the vertex"
    );
    let refused = CleanMesh::from_parts(&[[0.0; 3]], &[[0, 0, 0], [0, 7, 0]], &CleanOptions::default());
    assert_eq!(
        refused.unwrap_err().to_string(),
        "expected a vertex index below 1, got 7 (triangle 1); correct the triangle or add the vertex"
    );
    for weld in [-1.0, f64::NAN, f64::INFINITY] {
        let options = CleanOptions::default().with_weld(weld);
        let refused = CleanMesh::from_parts(&[], &[], &options).unwrap_err();
        assert!(matches!(refused, CleanError::Weld { .. }), "{refused}");
    }
    assert!(CleanMesh::from_parts(&[], &[], &CleanOptions::default()).unwrap().triangles().is_empty());
}
