//! Poses of the sweep and near first touch. They are drawn from a fixed seed before anything is
//! timed.

use nearmiss::Pose;
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};

use crate::Failure;
use crate::object::Object;
use crate::rivals::Method;
use crate::rivals::kiddo::PointScan;
use crate::rivals::parry::MeshTree;

/// Distances of the sweep: 0 to 3 in steps of a quarter (Zachmann 2002).
pub const DISTANCES: usize = 13;

/// Farthest shift from first touch, in r.
const FARTHEST: f64 = 10.0;

/// Halvings of the interval in which first touch lies: from r/4 to well below rounding of `f32`.
const HALVINGS: u32 = 24;

/// The `i`-th distance of the sweep.
#[must_use]
pub fn distance(i: usize) -> f64 {
    0.25 * crate::sample::count(i)
}

/// `count` poses of the second copy for each distance of the sweep, with the first copy at rest.
/// Each `pass` has new poses. Rotations and directions are uniform.
#[must_use]
pub fn sweep(count: usize, seed: u64, pass: u64) -> [Vec<Pose>; DISTANCES] {
    std::array::from_fn(|i| {
        let stream = (pass << 8) | i as u64;
        let rng = &mut rng(seed ^ stream.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        (0..count)
            .map(|_| {
                let direction = unit_vector(rng);
                rotation(rng).with_translation(direction.map(|x| x * distance(i)))
            })
            .collect()
    })
}

/// A pose near first touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearPose {
    /// Pose of the second copy.
    pub pose: Pose,
    /// Shift from first touch along the approach, in r; positive if the copies are apart.
    pub offset: f64,
}

/// `count` poses of a scaled object, shifted by up to 10 r from its first touch with the resting
/// copy on an approach from outside. Every other pose is apart.
///
/// First touch is that of the meshes or, without a mesh, of points within r/2. The search takes
/// steps of r/4, so it may miss a graze shorter than that.
///
/// # Errors
/// When the points cannot be searched.
pub fn near(object: &Object, count: usize, seed: u64) -> Result<Vec<NearPose>, Failure> {
    let mut touching: Box<dyn Method> = match &object.mesh {
        Some(mesh) => Box::new(MeshTree::new(mesh)),
        None => Box::new(PointScan::new(&object.cloud, 0.5 * object.r)?),
    };
    let rng = &mut rng(seed);
    let mut poses = Vec::with_capacity(count);
    while poses.len() < count {
        let (turn, direction) = (rotation(rng), unit_vector(rng));
        let at = |t: f64| turn.with_translation(direction.map(|x| x * t));
        let Some(touch) = first_touch(object, touching.as_mut(), &at) else {
            continue;
        };
        let shift = FARTHEST * unit_vector(rng)[0].abs();
        let offset = if poses.len() % 2 == 0 { shift } else { -shift };
        poses.push(NearPose { pose: at(touch + offset * object.r), offset });
    }
    Ok(poses)
}

/// The greatest distance at which `touching` reports a hit, approached from outside.
fn first_touch(object: &Object, touching: &mut dyn Method, at: &impl Fn(f64) -> Pose) -> Option<f64> {
    let half = object.cloud.bounds().half_extents();
    let mut apart = 2.0 * half.iter().map(|x| x * x).sum::<f64>().sqrt();
    let step = 0.25 * object.r;
    let mut hits = |t: f64| touching.ask(&Pose::IDENTITY, &at(t)).hit;
    let mut within = apart - step;
    while !hits(within) {
        apart = within;
        within -= step;
        if within < 0.0 {
            return None;
        }
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (apart + within);
        if hits(middle) {
            within = middle;
        } else {
            apart = middle;
        }
    }
    Some(apart)
}
