//! Depths of clashes of two meshes, and of a scan and a mesh, against known ones.

use nearmiss_geometry::{Pose, TriangleMesh};
use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
use nearmiss_query::{
    Budget, CollideOptions, Contact, ContactGroup, Contacts, Interior, MeshItself, MeshPair, MeshScanPair,
    MeshScanPlan, MeshScratch, MeshSolid, Penetration, Placed, PlacedMesh, Scratch, default_link,
};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
use nearmiss_testdata::shapes::{Form, cuboid, patch, sphere};

use crate::clashes::scene;

/// The spacing of points and the length of edges.
const SPACING: f64 = 0.03;

type Scene = [(Form, Pose)];

/// The forms at their poses as one mesh.
fn mesh(forms: &Scene) -> (MeshHierarchy, MeshSolid) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (form, pose) in forms {
        let own = form.clone().tessellated(2.0 * SPACING);
        let first = u32::try_from(vertices.len()).unwrap();
        // Corners on both sides of a seam are the same but for rounding.
        vertices
            .extend(own.vertices().iter().map(|&p| pose.apply(p).map(|x| (x * 1e9).round() * 1e-9 + 0.0)));
        triangles.extend(own.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    let prepared = MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap();
    let solid = MeshSolid::new(&prepared);
    (prepared, solid)
}

/// Balls of this radius in a row along x, `apart` from each other, sunk to these depths below z = `top`.
fn row(radius: f64, apart: f64, top: f64, depths: &[f64]) -> Vec<(Form, Pose)> {
    let middle = 0.5 * (depths.len() as f64 - 1.0);
    let x = (0_u32..).map(|i| apart * (f64::from(i) - middle));
    let place = |(x, depth): (f64, &f64)| Pose::from_translation([x, 0.0, top + radius - depth]);
    x.zip(depths).map(place).map(|pose| (sphere(radius), pose)).collect()
}

/// The clashes of a pair, in the order of their centres along x.
fn in_order(contacts: &[Contact], link: f64) -> Vec<ContactGroup> {
    sorted(ContactGroup::all(contacts, link))
}

/// The groups in the order of their centres along x.
fn sorted(mut groups: Vec<ContactGroup>) -> Vec<ContactGroup> {
    groups.sort_by(|p, q| p.centre()[0].total_cmp(&q.centre()[0]));
    groups
}

/// The clashes of two meshes and their depths.
fn of_meshes(pair: &MeshPair<'_>, solids: [&MeshSolid; 2]) -> (Vec<ContactGroup>, Vec<Penetration>) {
    let (mut contacts, scratch) = (Vec::new(), &mut MeshScratch::default());
    let (_, complete) = pair.contacts(&mut contacts, scratch);
    assert!(complete, "{} contacts", contacts.len());
    let groups = sorted(ContactGroup::of_meshes(&contacts));
    let whole = pair.penetration(solids, scratch);
    let (asked, mut told) = (groups.iter().collect::<Vec<_>>(), Vec::new());
    let found = pair.depths((&contacts, &asked), solids, &whole, &mut |share| told.push(share));
    assert!(told.is_sorted() && told.last() == Some(&1.0), "{told:?}");
    assert!(found.iter().all(|depth| depth.lower <= depth.upper && depth.upper <= whole.upper), "{whole:?}");
    (groups, found)
}

/// Balls in a floor, which is open, and in the top of a block, which is solid.
#[test]
fn each_clash_of_meshes_has_the_depth_of_its_own_place() {
    let depths = [0.02, 0.05, 0.1, 0.15, 0.25, 0.3];
    for (turn, scale) in [(0.0, 1.0), (0.7, 20.0)] {
        let pose = Pose::from_axis_angle([0.0, 0.0, turn], turn).with_scale(scale);
        for (below, top, apart) in [
            ((patch(14.0, 2.0), Pose::IDENTITY), 0.0, 2.0),
            ((patch(14.0, 2.0), Pose::IDENTITY), 0.0, 0.85),
            ((cuboid([14.0, 2.0, 1.0]), Pose::from_translation([0.0, 0.0, -0.5])), 0.0, 2.0),
        ] {
            let (a, solid_a) = mesh(&[below]);
            let (b, solid_b) = mesh(&row(0.3, apart, top, &depths));
            let (a, b) = (PlacedMesh::new(&a, &pose), PlacedMesh::new(&b, &pose));
            let pair = MeshPair::new(a, b);
            let solids = [&solid_a, &solid_b];
            let (groups, found) = of_meshes(&pair, solids);
            assert_eq!(found.len(), depths.len());
            for ((found, exact), group) in found.iter().zip(depths).zip(&groups) {
                // Balls of flat triangles are a little less deep.
                assert!((found.upper / scale - exact).abs() < 0.006, "{exact}: {found:?}");
                assert!(found.direction[2] > 0.9 || scale > 1.0, "{exact}: {found:?}");
                let is_solid = solid_a.is_closed();
                assert!(!is_solid || found.lower > 0.9 * found.upper, "{exact}: {found:?}");
                // After the shift nothing meets there.
                let [x, y, z] = pose.translation();
                let by = found.direction.map(|u| u * found.upper * (1.0 + 1e-9));
                let moved = pose.with_translation([x + by[0], y + by[1], z + by[2]]);
                let mut left = Vec::new();
                let shifted = MeshPair::new(a, PlacedMesh::new(b.mesh(), &moved));
                shifted.contacts(&mut left, &mut MeshScratch::default());
                let near = group.bounds.grown(0.5 * exact * scale);
                assert!(left.iter().all(|contact| !near.contains(contact.point)), "{exact}: {found:?}");
            }
        }
    }
}

/// The way out of one surface of a solid leads out of the solid, and the way of a pipe out of the wall that
/// it passes through; triangles may be much larger than the clash.
#[test]
fn clashes_of_meshes_with_cavities_pipes_and_large_triangles() {
    // A ball in a cavity of a block.
    let (block, solid) = mesh(&[(cuboid([3.0; 3]), Pose::IDENTITY), (sphere(0.5), Pose::IDENTITY)]);
    let (ball, own) = mesh(&[(sphere(0.45), Pose::IDENTITY)]);
    let at = Pose::from_translation([0.1, 0.0, 0.0]);
    let pair = MeshPair::new(PlacedMesh::new(&block, &Pose::IDENTITY), PlacedMesh::new(&ball, &at));
    let (_, found) = of_meshes(&pair, [&solid, &own]);
    for depth in &found {
        assert!((depth.upper - 0.05).abs() < 0.005, "back into the cavity: {depth:?}");
    }
    let (large, own) = mesh(&[(sphere(0.6), Pose::IDENTITY)]);
    let pair = MeshPair::new(PlacedMesh::new(&block, &Pose::IDENTITY), PlacedMesh::new(&large, &at));
    let whole = pair.penetration([&solid, &own], &mut MeshScratch::default());
    assert!(whole.upper > 1.9, "out of the block: {whole:?}");

    // A ball in the wall of a box, off its middle, meets the inner faces only. The outer ones are in the way.
    let (shell, solid) = mesh(&[(cuboid([12.0; 3]), Pose::IDENTITY), (cuboid([10.0; 3]), Pose::IDENTITY)]);
    let (ball, own) = mesh(&[(sphere(0.9), Pose::IDENTITY)]);
    for turn in 0..4_u8 {
        let at = Pose::from_axis_angle([0.0, 0.0, 1.0], f64::from(turn)).with_translation([5.05, 0.0, 0.0]);
        let pair = MeshPair::new(PlacedMesh::new(&shell, &Pose::IDENTITY), PlacedMesh::new(&ball, &at));
        let (_, found) = of_meshes(&pair, [&solid, &own]);
        let [depth] = found[..] else { panic!("{found:?}") };
        assert!((depth.upper - 0.95).abs() < 0.005 && depth.direction[0] < -0.99, "{turn}: {depth:?}");
    }

    // The same with fins that share corners with the inner faces.
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for size in [6.0, 5.0] {
        let own = cuboid([2.0 * size; 3]).tessellated(1.0);
        let first = u32::try_from(vertices.len()).unwrap();
        vertices.extend(own.vertices().iter().copied());
        triangles.extend(own.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    let first = u32::try_from(vertices.len()).unwrap();
    for (i, corner) in
        (0..8_u8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 5.0 } else { -5.0 })).enumerate()
    {
        let at = first + 3 * u32::try_from(i).unwrap();
        vertices.extend([corner, corner.map(|c| 0.98 * c), [0.98 * corner[0], corner[1], 0.97 * corner[2]]]);
        triangles.push([at, at + 1, at + 2]);
    }
    let finned = TriangleMesh::new(vertices, triangles).unwrap();
    let finned = MeshHierarchy::build(&finned, &MeshBuildOptions::default()).unwrap();
    let with_fins = MeshSolid::new(&finned);
    assert!(with_fins.is_closed(), "the faces are");
    for turn in 0..6_u8 {
        let at = Pose::from_axis_angle([0.2, 0.5, 1.0], f64::from(turn)).with_translation([5.05, 0.1, 0.07]);
        let pair = MeshPair::new(PlacedMesh::new(&finned, &Pose::IDENTITY), PlacedMesh::new(&ball, &at));
        let (_, found) = of_meshes(&pair, [&with_fins, &own]);
        let [depth] = found[..] else { panic!("{found:?}") };
        assert!((depth.upper - 0.95).abs() < 0.005 && depth.direction[0] < -0.99, "{turn}: {depth:?}");
    }

    // A pipe through a wall leaves it sideways; one that ends in it leaves it along its axis.
    let wall = TriangleMesh::new(
        vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
        vec![[0, 1, 2], [0, 2, 3]],
    )
    .unwrap();
    let wall = MeshHierarchy::build(&wall, &MeshBuildOptions::default()).unwrap();
    let open = MeshSolid::new(&wall);
    let pipe = |x: f64, z: f64| (cuboid([0.2, 0.2, 1.6]), Pose::from_translation([x, 0.0, z]));
    let (pipes, own) = mesh(&[pipe(-0.5, 0.1), pipe(0.5, 0.75)]);
    let pair =
        MeshPair::new(PlacedMesh::new(&wall, &Pose::IDENTITY), PlacedMesh::new(&pipes, &Pose::IDENTITY));
    let (_, found) = of_meshes(&pair, [&open, &own]);
    let [through, ends] = found[..] else { panic!("{found:?}") };
    assert!((through.upper - 0.6).abs() < 0.01 && through.direction[0] < -0.99, "{through:?}");
    assert!((ends.upper - 0.05).abs() < 1e-3 && ends.direction[2] > 0.99, "{ends:?}");
}

/// Another body over a far corner of a large face does not count, whichever corner it is.
#[test]
fn other_bodies_do_not_deepen_a_clash() {
    let plate = [(cuboid([10.0, 10.0, 1.0]), Pose::from_translation([0.0, 0.0, -0.5]))];
    let (a, solid) = mesh(&plate);
    let of_scan = scene(&[(cuboid([3.0, 3.0, 1.0]), Pose::from_translation([0.0, 0.0, -0.5]))], 0.05);
    for corner in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
        let balls = |far: f64, spacing: f64| {
            let [x, y] = corner.map(|c| c * far);
            let balls = [
                (sphere(0.5), Pose::from_translation([0.0, 0.0, 0.48])),
                (sphere(0.7), Pose::from_translation([x, y, 0.0])),
            ];
            (mesh(&balls), scene(&balls, spacing))
        };
        let ((b, own), _) = balls(5.0, 0.2);
        let pair = MeshPair::new(PlacedMesh::new(&a, &Pose::IDENTITY), PlacedMesh::new(&b, &Pose::IDENTITY));
        let (groups, found) = of_meshes(&pair, [&solid, &own]);
        let middle = groups.iter().position(|group| group.centre()[0].abs() < 1.0).unwrap();
        let depth = found[middle];
        assert!((depth.upper - 0.02).abs() < 2e-3 && depth.lower > 0.015, "{corner:?}: {depth:?}");

        // The balls as a solid scan, and the block as one.
        let scratch = &mut Scratch::default();
        let (_, balls) = balls(5.0, 0.04);
        let ((small, own_small), _) = (mesh(&plate), ());
        for (points, other, own, exact) in [(&balls, &small, &own_small, 0.02), (&of_scan, &b, &own, 0.02)] {
            let scan = Placed::new(points, &Pose::IDENTITY);
            let pair = MeshScanPair::new(scan, PlacedMesh::new(other, &Pose::IDENTITY));
            let plan = MeshScanPlan::new(&CollideOptions::estimated(), points).unwrap();
            let mut contacts = Contacts::default();
            pair.contacts(&plan, &mut contacts, scratch);
            let groups = in_order(&contacts.contacts, default_link([&scan; 2]));
            let groups: Vec<&ContactGroup> =
                groups.iter().filter(|group| group.centre()[..2].iter().all(|c| c.abs() < 0.6)).collect();
            let whole = pair.penetration(&plan, (Interior::Solid, own), scratch);
            let asked = (contacts.contacts.as_slice(), groups.as_slice());
            let found = pair.depths(asked, (&plan, Interior::Solid, own), &whole, &mut |_| ());
            assert!(!found.is_empty(), "{corner:?}");
            for depth in found {
                assert!((depth.upper - exact).abs() < scan.sampling_radius(), "{corner:?}: {depth:?}");
            }
        }
    }
}

/// Fins, which are open, in a floor, close to each other: another one is no piece of a clash.
#[test]
fn clashes_of_open_meshes_count_linked_triangles() {
    let depths = [0.02, 0.1, 0.05, 0.14];
    let upright = Pose::from_axis_angle([0.0, 1.0, 0.0], std::f64::consts::FRAC_PI_2);
    let fin = |(i, depth): (u32, f64)| {
        (patch(0.3, 0.3), upright.with_translation([0.1 * f64::from(i), 0.0, 0.15 - depth]))
    };
    let (floor, open) = mesh(&[(patch(4.0, 4.0), Pose::IDENTITY)]);
    let (fins, own) = mesh(&(0..).zip(depths).map(fin).collect::<Vec<_>>());
    assert!(!own.is_closed() && own != open);
    let pair =
        MeshPair::new(PlacedMesh::new(&floor, &Pose::IDENTITY), PlacedMesh::new(&fins, &Pose::IDENTITY));
    let whole = pair.penetration([&open, &own], &mut MeshScratch::default());
    assert!((whole.upper - 0.14).abs() < 1e-3, "{whole:?}");
    let mut contacts = Vec::new();
    pair.contacts(&mut contacts, &mut MeshScratch::default());
    // One group for each fin, however long the segments are.
    let on_axis = |contact: Contact| Contact { point: [contact.point[0], 0.0, 0.0], ..contact };
    let places: Vec<Contact> = contacts.iter().map(|contact| on_axis(contact.into())).collect();
    let groups = in_order(&places, 0.05);
    let groups: Vec<&ContactGroup> = groups.iter().collect();
    let found = pair.depths((&contacts, &groups), [&open, &own], &whole, &mut |_| ());
    assert_eq!(found.len(), depths.len());
    for (found, exact) in found.iter().zip(depths) {
        assert!((found.upper - exact).abs() < 1e-3 && found.direction[2] > 0.99, "{exact}: {found:?}");
    }
    // Groups may be the caller's own.
    let strange = ContactGroup { contacts: vec![usize::MAX], ..groups[0].clone() };
    let odd = pair.depths((&contacts, &[&strange]), [&open, &own], &whole, &mut |_| ());
    assert!((odd[0].upper - whole.upper).abs() < 1e-9, "{odd:?}");
}

/// Curves are clashes, whatever the sizes of triangles; coplanar faces are one.
#[test]
fn clashes_of_meshes_are_connected_curves() {
    // A large floor of two triangles; small boxes close to each other, and one that lies on the floor.
    let corners = vec![[-50.0, -50.0, 0.0], [50.0, -50.0, 0.0], [50.0, 50.0, 0.0], [-50.0, 50.0, 0.0]];
    let floor = TriangleMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let floor = MeshHierarchy::build(&floor, &MeshBuildOptions::default()).unwrap();
    let at = |x: f64, z: f64| (cuboid([0.4, 0.4, 0.4]), Pose::from_translation([x, 0.03, z]));
    let (boxes, _) = mesh(&[at(0.0, 0.1), at(0.5, 0.0), at(1.0, 0.1), at(2.0, 0.2), at(9.0, 5.0)]);
    for pose in
        [Pose::IDENTITY, Pose::from_axis_angle([0.3, 0.2, 0.9], 1.0).with_translation([700.0, 3.0, -20.0])]
    {
        let pair = MeshPair::new(PlacedMesh::new(&floor, &pose), PlacedMesh::new(&boxes, &pose));
        let mut contacts = Vec::new();
        pair.contacts(&mut contacts, &mut MeshScratch::default());
        let groups = ContactGroup::of_meshes(&contacts);
        // A turned box that lies on the floor may be off by rounding.
        let expected = if pose == Pose::IDENTITY { 4 } else { groups.len().clamp(3, 4) };
        assert_eq!(groups.len(), expected, "{groups:?}");
        let count: usize = groups.iter().map(|group| group.contacts.len()).sum();
        assert_eq!(count, contacts.len());
        assert!(groups.iter().all(|group| group.diagonal() < 0.9), "{groups:?}");
        assert!(groups.iter().map(|group| group.contacts[0]).is_sorted(), "{groups:?}");
    }
    assert!(ContactGroup::of_meshes(&[]).is_empty());
}

/// A scan against a mesh, each of which has the balls.
#[test]
fn each_clash_of_a_scan_and_a_mesh_has_the_depth_of_its_own_place() {
    let depths = [0.03, 0.1, 0.2, 0.3];
    let scratch = &mut Scratch::default();
    let floor = [(patch(9.0, 2.0), Pose::IDENTITY)];
    let block = [(cuboid([9.0, 2.0, 1.0]), Pose::from_translation([0.0, 0.0, -0.5]))];
    let balls = row(0.3, 2.0, 0.0, &depths);
    let (hollow, solid) = (Interior::Hollow, Interior::Solid);
    for (of_scan, of_mesh, interior, up) in [
        (&floor[..], &balls[..], hollow, 1.0),
        (&block[..], &balls[..], solid, 1.0),
        (&balls[..], &floor[..], solid, -1.0),
        (&balls[..], &block[..], hollow, -1.0),
    ] {
        let (a, (b, own)) = (scene(of_scan, SPACING), mesh(of_mesh));
        for scale in [1.0, 20.0] {
            let pose = Pose::IDENTITY.with_scale(scale);
            let (a, b) = (Placed::new(&a, &pose), PlacedMesh::new(&b, &pose));
            let radius = a.sampling_radius() / scale;
            let pair = MeshScanPair::new(a, b);
            let plan = MeshScanPlan::new(&CollideOptions::estimated(), a.scan()).unwrap();
            let mut contacts = Contacts::default();
            pair.contacts(&plan, &mut contacts, scratch);
            let groups = in_order(&contacts.contacts, default_link([&a; 2]));
            let groups: Vec<&ContactGroup> = groups.iter().collect();
            let whole = pair.penetration(&plan, (interior, &own), scratch);
            let asked = (contacts.contacts.as_slice(), groups.as_slice());
            let of = (&plan, interior, &own);
            let found = pair.depths(asked, of, &whole, &mut |_| ());
            assert_eq!(found.len(), depths.len(), "{found:?}");
            for (found, exact) in found.iter().zip(depths) {
                assert!((found.upper / scale - exact).abs() < radius, "{exact}: {found:?}");
                assert!(found.direction[2] * up > 0.9, "{exact}: {found:?}");
                assert!(found.lower <= found.upper, "{found:?}");
                if interior == solid && own.is_closed() {
                    assert!(found.lower / scale > exact - 1.5 * radius, "{exact}: {found:?}");
                }
            }
            // A budget may end the search; what is told holds.
            for work in [1, 300, 3000] {
                let hasty = pair.within(&Budget::UNLIMITED.with_work(work));
                let whole = hasty.penetration(&plan, (interior, &own), scratch);
                for (found, exact) in hasty.depths(asked, of, &whole, &mut |_| ()).iter().zip(depths) {
                    assert!(found.lower / scale < exact + radius, "{work}: {found:?}");
                    assert!(found.upper / scale > exact - radius, "{work}: {found:?}");
                }
            }
        }
    }
}

/// Two spheres far from the origin of their input, placed near that of the world: rounding of the input's
/// coordinates does not split their curve.
#[test]
fn large_coordinates_do_not_split_a_curve() {
    let far = [4.5e6, 5.3e5, 120.0];
    let ball = |x: f64| {
        let own = sphere(1.0).tessellated(2.0 * SPACING);
        let vertices = own.vertices().iter().map(|p| [p[0] + x + far[0], p[1] + far[1], p[2] + far[2]]);
        let mesh = TriangleMesh::new(vertices.collect(), own.triangles().to_vec()).unwrap();
        MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap()
    };
    let (a, b) = (ball(0.0), ball(1.1));
    let place = Pose::from_translation(far.map(|c| -c));
    let pair = MeshPair::new(PlacedMesh::new(&a, &place), PlacedMesh::new(&b, &place));
    let mut contacts = Vec::new();
    pair.contacts(&mut contacts, &mut MeshScratch::default());
    let groups = ContactGroup::of_meshes(&contacts);
    assert!(contacts.len() > 100 && groups.len() == 1, "{} groups", groups.len());
}

/// Triangles of a mesh that only touch meet in every pose, as they do in the input.
#[test]
fn a_mesh_touches_itself_in_every_pose() {
    let vertices = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.25, 0.25, 0.0],
        [0.25, 0.5, 1.0],
        [0.5, 0.25, 1.0],
    ];
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
    let mesh = MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap();
    let rng = &mut rng(31);
    for round in 0..200 {
        let pose = rotation(rng).with_translation(point_in(rng, 10.0));
        let (mut contacts, scratch) = (Vec::new(), &mut MeshScratch::default());
        MeshItself::new(PlacedMesh::new(&mesh, &pose)).contacts(&mut contacts, scratch);
        assert_eq!(contacts.len(), 1, "round {round}");
    }
}

/// Dense parallel plates: all pairs of triangles of many leaves are compared, and the distance is exact.
#[test]
fn distances_of_parallel_plates_are_complete() {
    let grid = |z: f64, off: f64| {
        let count = 120_u32;
        let at = |i: u32, j: u32| [0.01 * f64::from(i) + off, 0.01 * f64::from(j) + off, z];
        let vertices = (0..count * count).map(|k| at(k / count, k % count)).collect();
        let quads = (0..(count - 1) * (count - 1)).map(|k| (k / (count - 1)) * count + k % (count - 1));
        let triangles =
            quads.flat_map(|p| [[p, p + 1, p + count], [p + 1, p + count + 1, p + count]]).collect();
        let mesh = TriangleMesh::new(vertices, triangles).unwrap();
        MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap()
    };
    let (a, b) = (grid(0.0, 0.0), grid(1.0, 0.003));
    let turned = Pose::from_axis_angle([0.3, 0.2, 1.0], 0.7);
    let pair = MeshPair::new(PlacedMesh::new(&a, &turned), PlacedMesh::new(&b, &turned));
    let found = pair.distance(&mut MeshScratch::default());
    assert!(found.complete && found.lower > 1.0 - 1e-9 && (found.upper - 1.0).abs() < 1e-9, "{found:?}");
}
