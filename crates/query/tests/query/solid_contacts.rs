//! Contacts, distances and rays on scans of known surfaces, and contacts from frame to frame.

use std::collections::BTreeSet;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy, PointKind};
use nearmiss_query::{
    CollideOptions, Detail, Evidence, Placed, Ray, Scratch, Shape, ShapeContact, ShapeHint, ShapePlan, Target,
};
use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use nearmiss_testdata::shapes::{self, Form, Order, Sampling};
use rand::RngExt;

type Vector = Vector3<f64>;

fn scanned(form: Form, spacing: f64, noise: f64) -> PointHierarchy {
    let sampled = form.sample(Sampling { spacing, noise, order: Order::Random, seed: 7 });
    PointHierarchy::build(&PointCloud::from_positions(&sampled.points).unwrap(), &BuildOptions::default())
        .unwrap()
}

fn target<'s>(scan: &'s PointHierarchy, options: &CollideOptions) -> Target<'s> {
    Target::new(Placed::new(scan, &Pose::IDENTITY), &ShapePlan::new(options, scan).unwrap())
}

fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    Vector::from(a).dot(&Vector::from(b)).clamp(-1.0, 1.0).acos().to_degrees()
}

fn off(a: [f64; 3], b: [f64; 3]) -> f64 {
    (Vector::from(a) - Vector::from(b)).norm()
}

#[test]
fn contacts_on_a_ball_are_where_they_are() {
    for noise in [0.0, 0.1] {
        let scan = scanned(shapes::sphere(1.0), 0.04, noise);
        let r = scan.sampling_radius();
        let (target, mut scratch) = (target(&scan, &CollideOptions::default()), Scratch::default());
        let (rng, mut contacts) = (&mut rng(3), Vec::new());
        for _ in 0..60 {
            let out = Vector::from(unit_vector(rng));
            let (radius, depth) = (rng.random_range(0.1..0.5), rng.random_range(0.3..1.0) * r);
            let centre: [f64; 3] = (out * (1.0 + radius - depth)).into();
            let sphere = Shape::Sphere { centre, radius };
            target.contacts(&sphere, &mut contacts, &mut scratch);
            let deepest = contacts.first().unwrap_or_else(|| panic!("no contact of {sphere:?}"));
            assert!(angle(deepest.normal, out.into()) < 5.0, "noise {noise}: {deepest:?} for {out:?}");
            assert!((deepest.depth - depth).abs() < 0.2 * r, "noise {noise}: {deepest:?} for {depth}, r {r}");
            assert!((Vector::from(deepest.point).norm() - 1.0).abs() < 0.1 * r, "noise {noise}: {deepest:?}");
            // Noise tilts the normals by some degrees, and with them the way from the centre.
            let tilt = if noise > 0.0 { 0.06 } else { 0.0 };
            let from_point = off(deepest.point, out.into());
            assert!(
                from_point < 0.1 * r + tilt * radius,
                "noise {noise}: {from_point} from the truth, r {r}"
            );
            for contact in &contacts {
                assert!(
                    (Vector::from(contact.point).norm() - 1.0).abs() < (0.15 + 2.0 * noise) * r,
                    "{contact:?}"
                );
                assert!(
                    angle(contact.normal, contact.point) < 8.0 + 40.0 * noise,
                    "noise {noise}: {contact:?}"
                );
            }
        }
    }
}

#[test]
fn a_box_on_a_floor_has_contacts_of_equal_depth_near_its_corners() {
    let scan = scanned(shapes::patch(2.0, 2.0), 0.05, 0.0);
    let r = scan.sampling_radius();
    let (target, mut scratch) = (target(&scan, &CollideOptions::default()), Scratch::default());
    let mut contacts = Vec::new();
    for turn in [0.0, 0.3, 0.7] {
        let pose = Pose::from_axis_angle([0.0, 0.0, 1.0], turn).with_translation([0.05, -0.02, 0.299]);
        let solids = [
            Shape::Box { pose, half: [0.4, 0.3, 0.3], radius: 0.0 },
            Shape::Box { pose, half: [0.38, 0.28, 0.28], radius: 0.02 },
        ];
        for shape in solids {
            target.contacts(&shape, &mut contacts, &mut scratch);
            assert!((4..=8).contains(&contacts.len()), "{contacts:?}");
            assert!((contacts[0].depth - 0.001).abs() < 1e-4, "{shape:?}: {contacts:?}");
            for contact in &contacts {
                // The rounded edge is higher than the face.
                let least = if shape.rounding() > 0.0 { -1e-4 } else { 0.0009 };
                assert!((least..0.0011).contains(&contact.depth), "{shape:?}: {contact:?}");
                assert!(contact.normal[2] > 0.999 && contact.point[2].abs() < 1e-4, "{shape:?}: {contact:?}");
            }
            let spread = |k: usize| {
                let all = || contacts.iter().map(|contact| pose.apply_inverse(contact.point)[k]);
                all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min)
            };
            assert!(spread(0) > 0.8 - 3.0 * r && spread(1) > 0.6 - 3.0 * r, "{shape:?}: {contacts:?}, r {r}");
        }
    }
    // A box that stands on its corner.
    let tilted = Pose::from_axis_angle([1.0, 0.3, 0.0], 0.8);
    let half = [0.2, 0.2, 0.2];
    let low = [-1.0, 1.0]
        .iter()
        .flat_map(|x| [-1.0, 1.0].map(|y| [*x, y]))
        .flat_map(|[x, y]| [-1.0, 1.0].map(|z| [x, y, z]));
    let corner = low
        .map(|s| tilted.apply([0, 1, 2].map(|k| s[k] * half[k])))
        .min_by(|a, b| a[2].total_cmp(&b[2]))
        .unwrap();
    let pose = tilted.with_translation([0.01, 0.02, -corner[2] - 0.01]);
    target.contacts(&Shape::Box { pose, half, radius: 0.0 }, &mut contacts, &mut scratch);
    let at = [corner[0] + 0.01, corner[1] + 0.02, 0.0];
    assert!(!contacts.is_empty(), "the corner is in the floor");
    assert!(
        (contacts[0].depth - 0.01).abs() < 1e-3 && off(contacts[0].point, at) < 0.3 * r,
        "{contacts:?} at {at:?}"
    );
}

#[test]
fn every_shape_on_a_floor_has_its_depth() {
    let scan = scanned(shapes::patch(2.0, 2.0), 0.05, 0.0);
    let (target, mut scratch) = (target(&scan, &CollideOptions::default()), Scratch::default());
    let mut contacts = Vec::new();
    let depth = 0.013;
    let up = |h: f64| Pose::from_translation([0.02, 0.01, h - depth]);
    // The y axis of the pose points up.
    let stands = |h: f64| {
        Pose::from_axis_angle([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2).with_translation([
            0.02,
            0.01,
            h - depth,
        ])
    };
    let hull = [[0.0, 0.0, -depth], [0.3, 0.0, 0.4], [-0.3, 0.1, 0.4], [0.0, -0.3, 0.5]];
    let cases = [
        Shape::Sphere { centre: [0.0, 0.0, 0.1 - depth], radius: 0.1 },
        Shape::Capsule { ends: [[-0.2, 0.0, 0.1 - depth], [0.2, 0.1, 0.1 - depth]], radius: 0.1 },
        Shape::Box { pose: up(0.2), half: [0.3, 0.2, 0.2], radius: 0.0 },
        Shape::Cylinder { pose: stands(0.2), half_height: 0.2, radius: 0.15, rounding: 0.0 },
        Shape::Cylinder { pose: up(0.15), half_height: 0.2, radius: 0.15, rounding: 0.0 },
        Shape::Cone { pose: stands(0.2), half_height: 0.2, radius: 0.15, rounding: 0.0 },
        Shape::Hull { points: &hull, radius: 0.0 },
        Shape::Triangle { points: [[0.0, 0.0, -depth], [0.3, 0.0, 0.4], [-0.3, 0.1, 0.4]], radius: 0.0 },
        Shape::Triangle {
            points: [[0.0, 0.0, 0.05 - depth], [0.3, 0.0, 0.4], [-0.3, 0.1, 0.4]],
            radius: 0.05,
        },
    ];
    for shape in &cases {
        target.contacts(shape, &mut contacts, &mut scratch);
        let deepest = contacts.first().unwrap_or_else(|| panic!("no contact of {shape:?}"));
        assert!((deepest.depth - depth).abs() < 1e-3, "{shape:?}: {deepest:?}");
        assert!(deepest.normal[2] > 0.999, "{shape:?}: {deepest:?}");
    }
}

#[test]
fn contacts_keep_their_ids_and_their_side_from_frame_to_frame() {
    let scan = scanned(shapes::patch(3.0, 3.0), 0.05, 0.05);
    let r = scan.sampling_radius();
    let (target, mut scratch) = (target(&scan, &CollideOptions::default()), Scratch::default());
    let (mut kept, mut steps) = (0, 0);
    for kind in 0..3 {
        let (mut hint, mut contacts) = (ShapeHint::default(), Vec::new());
        let mut last: Vec<ShapeContact> = Vec::new();
        for step in 0..100_u32 {
            let x = -0.5 + 0.1 * r * f64::from(step);
            let shape = match kind {
                0 => Shape::Sphere { centre: [x, 0.02, 0.19], radius: 0.2 },
                1 => Shape::Capsule { ends: [[x, 0.0, 0.095], [x, 0.3, 0.095]], radius: 0.1 },
                _ => {
                    let pose = Pose::from_translation([x, 0.0, 0.095]);
                    Shape::Box { pose, half: [0.3, 0.2, 0.1], radius: 0.0 }
                }
            };
            target.contacts_hinted(&shape, &mut hint, &mut contacts, &mut scratch);
            let mut ids: Vec<u64> = contacts.iter().map(|contact| contact.id).collect();
            ids.sort_unstable();
            ids.dedup();
            assert_eq!(ids.len(), contacts.len(), "ids differ: {contacts:?}");
            if step > 0 {
                steps += 1;
                let known = last.iter().filter(|known| ids.contains(&known.id)).count();
                kept += usize::from(2 * known >= last.len().min(contacts.len()) && known > 0);
            }
            last.clone_from(&contacts);
        }
    }
    assert!(kept * 100 >= steps * 99, "{kept} of {steps} steps keep most ids");
    // A ball sinks through the floor; its side stays with the hint, and changes without.
    let (mut hint, mut contacts) = (ShapeHint::default(), Vec::new());
    for step in 0..20_u32 {
        let height = 0.1 - 0.009 * f64::from(step);
        let ball = Shape::Sphere { centre: [0.1, 0.1, height], radius: 0.11 };
        target.contacts_hinted(&ball, &mut hint, &mut contacts, &mut scratch);
        assert!(contacts.iter().all(|contact| contact.normal[2] > 0.9), "step {step}: {contacts:?}");
        assert!((contacts[0].depth - (0.11 - height)).abs() < 0.2 * r, "step {step}: {contacts:?}");
        if height < -0.01 {
            target.contacts(&ball, &mut contacts, &mut scratch);
            assert!(contacts.iter().all(|contact| contact.normal[2] < -0.9), "step {step}: {contacts:?}");
        }
    }
}

#[test]
fn distances_bracket_the_truth() {
    let rng = &mut rng(21);
    for (form, noise) in
        [(shapes::sphere(1.0), 0.0), (shapes::torus(1.0, 0.4), 0.1), (shapes::plates(2.0, 2.0, 0.5), 0.05)]
    {
        let name = form.name;
        let scan = scanned(form.clone(), 0.05, noise);
        let (r, target) = (scan.sampling_radius(), target(&scan, &CollideOptions::default()));
        let mut scratch = Scratch::default();
        let (mut certified, mut clear) = (0, 0);
        for _ in 0..150 {
            let centre = unit_vector(rng).map(|c| c * rng.random_range(0.0..2.0));
            let truth = form.distance(centre);
            let radius = rng.random_range(0.0..1.0) * truth;
            let sphere = Shape::Sphere { centre, radius };
            let found = target.distance(&sphere, f64::INFINITY, &mut scratch).unwrap();
            let truth = truth - radius;
            // The discs are within a fifth of the spacing of the true surface, plus the noise.
            // At a border they reach beyond it.
            let beyond = if name == "plates" { 0.3 * r } else { 0.0 };
            let band = 0.2 * r + beyond + 3.0 * noise * 0.05;
            assert!(
                found.lower <= truth + band && truth <= found.upper + band,
                "{name}: {found:?} for {truth}"
            );
            assert!(found.upper <= truth + 0.1 * r + band, "{name}: {found:?} for {truth}, r {r}");
            assert!(found.lower >= 0.9 * truth - 0.7 * r - beyond, "{name}: {found:?} for {truth}, r {r}");
            if truth > r {
                clear += 1;
                let verdict = target.touch(&sphere, &mut scratch).verdict;
                assert!(verdict.is_separated(), "{name}: {verdict:?} for {truth}");
                certified += usize::from(format!("{verdict:?}").contains("Certified"));
            }
        }
        assert!(certified == clear && clear > 30, "{name}: {certified} of {clear} certified");
    }
}

#[test]
fn rays_hit_closed_surfaces_where_they_are() {
    for (noise, detail) in [(0.0, Detail::Verdict), (0.0, Detail::Witness), (0.1, Detail::Witness)] {
        let scan = scanned(shapes::sphere(1.0), 0.05, noise);
        let (r, options) = (scan.sampling_radius(), CollideOptions::default().with_detail(detail));
        let (target, mut scratch) = (target(&scan, &options), Scratch::default());
        let (rng, mut all, mut certified, mut exact) = (&mut rng(4), Vec::new(), 0, 0);
        for _ in 0..1500 {
            let (way, start) = (unit_vector(rng), unit_vector(rng).map(|c| 0.3 * c));
            let ray = Ray::new(start, way.map(|c| 7.0 * c));
            let (o, d) = (Vector::from(start), Vector::from(way));
            let truth = -o.dot(&d) + (o.dot(&d).powi(2) - o.norm_squared() + 1.0).sqrt();
            let hit = target.cast(&ray, &mut scratch).hit;
            let hit = hit.unwrap_or_else(|| panic!("noise {noise}: {ray:?} passes a closed surface"));
            // Along the ray, errors grow by the inverse cosine.
            let cosine = Vector::from(hit.point).normalize().dot(&d);
            let (error, is_certified) = ((hit.t - truth).abs() * cosine, hit.evidence == Evidence::Certified);
            certified += usize::from(is_certified);
            exact += usize::from(error < 0.1 * r);
            let most = if is_certified { 0.1 + 0.5 * noise } else { 0.1 + 3.0 * noise };
            assert!(error < most * r, "noise {noise}, {detail:?}: {hit:?} for {truth}, r {r}");
            assert!(angle(hit.normal, hit.point) > 168.0, "towards the start: {hit:?}");
            assert!(target.is_hit(&ray, &mut scratch), "{ray:?}");
            assert!(!target.is_hit(&ray.with_max(0.5 * truth), &mut scratch), "{ray:?} ends before");
            // From outside, through both sides.
            let far = Ray::new((o - d * 5.0).into(), way);
            target.cast_all(&far, &mut all, &mut scratch);
            assert!(all.len() >= 2, "noise {noise}: {far:?} hits {all:?}");
            let first = target.cast(&far, &mut scratch).hit.map(|hit| hit.t);
            assert_eq!(first, Some(all[0].t), "noise {noise}: {all:?}");
            assert!(all.windows(2).all(|pair| pair[0].t <= pair[1].t), "in order: {all:?}");
            assert!((all[all.len() - 1].t - 5.0 - truth).abs() * cosine < 0.2 * r, "{all:?} for {truth}");
            // A ball stops its radius before.
            let thick = target.cast(&ray.with_radius(0.1), &mut scratch).hit.map(|hit| hit.t);
            let inner = -o.dot(&d) + (o.dot(&d).powi(2) - o.norm_squared() + 0.81).sqrt();
            let thick = thick.unwrap_or_else(|| panic!("{ray:?} with a radius passes"));
            assert!((thick - inner).abs() * cosine < 0.2 * r, "noise {noise}: {thick} for {inner}, r {r}");
        }
        assert!(exact > 1490, "noise {noise}, {detail:?}: {exact} of 1500 within a tenth of r");
        assert!(detail == Detail::Verdict || certified > 1450, "noise {noise}: {certified} certified");
        let beside = Ray::new([-3.0, 1.5, 0.0], [1.0, 0.0, 0.0]);
        let answer = target.cast(&beside, &mut scratch);
        assert!(answer.hit.is_none() && format!("{answer:?}").contains("Certified"), "{answer:?}");
    }
}

#[test]
fn no_ball_is_pushed_through_a_rough_surface() {
    let mut random = rng(8);
    let mut deep = 0;
    for noise in [0.2, 0.6] {
        let scan = scanned(shapes::torus(1.0, 0.35), 0.04, noise);
        let target = target(&scan, &CollideOptions::default());
        let is_sheet = |i: usize| matches!(scan.kind(i), PointKind::Sheet | PointKind::Edge);
        let balls: BTreeSet<u64> =
            (0..scan.len()).filter(|&i| !is_sheet(i)).map(|i| u64::from(scan.id(i).0)).collect();
        let (mut contacts, mut scratch) = (Vec::new(), Scratch::default());
        for _ in 0..1500 {
            let centre = point_in(&mut random, 1.4);
            let radius = random.random_range(0.05..0.3);
            target.contacts(&Shape::Sphere { centre, radius }, &mut contacts, &mut scratch);
            for contact in &contacts {
                // The place on a ball may be beyond the centre of a shape that contains it.
                let is_ball = balls.contains(&contact.id);
                let to_centre: [f64; 3] = [0, 1, 2].map(|k| centre[k] - contact.point[k]);
                let height: f64 = (0..3).map(|k| to_centre[k] * contact.normal[k]).sum();
                assert!(
                    is_ball || height > -1e-6,
                    "the normal {:?} of {contact:?} leaves the centre behind",
                    contact.normal
                );
                // It adds its own radius.
                let most = radius + if is_ball { 0.15 } else { 1e-6 };
                assert!(contact.depth <= most, "{} deep, of a ball of radius {radius}", contact.depth);
                deep += u32::from(contact.depth > 0.01);
            }
        }
    }
    assert!(deep > 1000, "{deep} deep contacts");
}

#[test]
fn what_touches_has_contacts_no_further_than_the_margin() {
    let mesh = dragon_mesh(Dragon::Points5k).unwrap();
    let cloud = PointCloud::from_positions(mesh.vertices()).unwrap();
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    let (bounds, r) = (scan.bounds(), scan.sampling_radius());
    let (rng, scratch, mut contacts) = (&mut rng(11), &mut Scratch::default(), Vec::new());
    let mut touching = 0;
    for margin in [0.0, 0.3 * r] {
        let target = target(&scan, &CollideOptions::default().with_margin(margin));
        for _ in 0..2000 {
            let at = [0, 1, 2].map(|k| rng.random_range(bounds.min[k]..bounds.max[k]));
            let to = [0, 1, 2].map(|k| rng.random_range(bounds.min[k]..bounds.max[k]));
            let shapes = [
                Shape::Sphere { centre: at, radius: 0.5 * r },
                Shape::Capsule { ends: [at, to], radius: 0.0 },
                Shape::Capsule {
                    ends: [at, [0, 1, 2].map(|k| at[k] + 0.1 * (to[k] - at[k]))],
                    radius: 0.2 * r,
                },
            ];
            for shape in shapes {
                target.contacts(&shape, &mut contacts, scratch);
                if target.touch(&shape, scratch).verdict.is_touching() {
                    assert!(!contacts.is_empty(), "a contact of {shape:?} with the margin {margin}");
                    touching += 1;
                }
                // A disc is thick by a twentieth of its radius.
                let least = -(margin.max(0.05 * scan.reach())) * (1.0 + 1e-3);
                let deep = contacts.iter().all(|contact| contact.depth >= least);
                assert!(deep, "{contacts:?} of {shape:?} with the margin {margin}");
            }
        }
    }
    assert!(touching > 1000, "many shapes touch: {touching}");
}
