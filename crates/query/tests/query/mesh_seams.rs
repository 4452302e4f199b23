//! Solids whose triangles meet at walls, at zero-area triangles, or occur more than once.

use nearmiss_geometry::{Pose, TriangleMesh};
use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
use nearmiss_query::{AsShape, Budget, MeshSolid, PlacedMesh, Scratch, Shape, ShapeMeshPair};

type Parts = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// A box of edge length 1 about `centre`, wound counterclockwise from outside.
fn cube(centre: [f64; 3]) -> Parts {
    let half = |bit: bool| if bit { 0.5 } else { -0.5 };
    let vertices = (0..8_u8).map(|i| [0, 1, 2].map(|k| centre[k] + half(i >> k & 1 == 1))).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (vertices, faces.iter().flat_map(|[p, q, r, s]| [[*p, *q, *r], [*p, *r, *s]]).collect())
}

fn both((mut vertices, mut triangles): Parts, (more, others): Parts) -> Parts {
    let first = u32::try_from(vertices.len()).unwrap();
    vertices.extend(more);
    triangles.extend(others.iter().map(|t| t.map(|v| v + first)));
    (vertices, triangles)
}

/// Bounds of the penetration of a ball of radius 0.1 at `centre`. `None` if the mesh has no closed part.
fn depth((vertices, triangles): &Parts, centre: [f64; 3]) -> Option<[f64; 2]> {
    let mesh = TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap();
    let mesh = MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap();
    let solid = MeshSolid::new(&mesh);
    let ball = Shape::Sphere { centre, radius: 0.1 };
    let pair = ShapeMeshPair::new(PlacedMesh::new(&mesh, &Pose::IDENTITY), ball.at(&Pose::IDENTITY));
    let found = pair.penetration(&solid, &Budget::UNLIMITED, &mut Scratch::default());
    solid.is_closed().then_some([found.lower, found.upper])
}

fn is_near(found: Option<[f64; 2]>, expected: f64) -> bool {
    found.is_some_and(|[lower, upper]| lower > 0.3 * expected && (upper - expected).abs() < 1e-5)
}

#[test]
fn boxes_with_a_common_wall_are_solid() {
    let two = both(cube([-0.5, 0.0, 0.0]), cube([0.5, 0.0, 0.0]));
    for x in [-0.6, -0.05, 0.0, 0.45] {
        assert!(is_near(depth(&two, [x, 0.1, 0.0]), 0.5), "at {x}: {:?}", depth(&two, [x, 0.1, 0.0]));
    }
    assert_eq!(depth(&two, [1.7, 0.0, 0.0]), Some([0.0, 0.0]));
    // Eight boxes about a corner.
    let corners = (0..8_u8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 0.5 } else { -0.5 }));
    let eight = corners.map(cube).reduce(both).unwrap();
    assert!(is_near(depth(&eight, [0.0; 3]), 1.1), "{:?}", depth(&eight, [0.0; 3]));
    // A box that is listed twice is a box, not nothing.
    let twice = both(cube([0.0; 3]), cube([0.0; 3]));
    assert!(is_near(depth(&twice, [0.0; 3]), 0.6), "{:?}", depth(&twice, [0.0; 3]));
}

#[test]
fn triangles_without_area_close_a_solid() {
    let (mut vertices, mut triangles) = cube([0.0; 3]);
    // A vertex in the middle of an edge of the first face splits its two triangles, and the face beyond the
    // edge only through a triangle without area.
    let [p, q] = [0, 2];
    vertices.push([0, 1, 2].map(|k| 0.5 * (vertices[p][k] + vertices[q][k])));
    let middle = 8;
    let has = |t: &[u32; 3]| t.contains(&0) && t.contains(&2);
    let split = triangles.iter().position(has).unwrap();
    let t = triangles[split];
    triangles[split] = t.map(|v| if v == 2 { middle } else { v });
    triangles.push(t.map(|v| if v == 0 { middle } else { v }));
    let open = (vertices.clone(), triangles.clone());
    assert_eq!(depth(&open, [0.0; 3]), None);
    triangles.push([0, 2, middle]);
    let closed = (vertices, triangles);
    assert!(is_near(depth(&closed, [0.0; 3]), 0.6), "{:?}", depth(&closed, [0.0; 3]));
    // Three such triangles, about a vertex on the edge that no other one has.
    let (mut vertices, mut triangles) = closed;
    triangles.pop();
    vertices.push([0, 1, 2].map(|k| 0.75 * vertices[0][k] + 0.25 * vertices[2][k]));
    triangles.extend([[0, 2, 9], [0, 9, middle], [9, 2, middle]]);
    let closed = (vertices, triangles);
    assert!(is_near(depth(&closed, [0.0; 3]), 0.6), "{:?}", depth(&closed, [0.0; 3]));
}

#[test]
fn a_sheet_with_two_sides_is_no_solid() {
    let square: Parts = (
        vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]],
    );
    assert_eq!(depth(&square, [0.5, 0.5, 0.0]), None);
    let (vertices, triangles) = cube([0.0; 3]);
    let turned = triangles.iter().map(|[p, q, r]| [*r, *q, *p]).collect();
    // A box in both orientations is closed without a second look.
    let both_ways = both((vertices.clone(), triangles), (vertices, turned));
    assert!(is_near(depth(&both_ways, [0.0; 3]), 0.6), "{:?}", depth(&both_ways, [0.0; 3]));
}
