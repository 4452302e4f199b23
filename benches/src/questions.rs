//! Poses with answers: two copies of an object, or an object in a room, and whether they meet.

use nearmiss::{CollideOptions, Detail, Pose, Scan};
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
use rand::RngExt;

use crate::Failure;
use crate::object::Object;
use crate::poses;
use crate::rivals::Method;
use crate::rivals::ours::Ours;
use crate::rivals::parry::MeshTree;

/// A pose of the second object, with the first one at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// The pose.
    pub pose: Pose,
    /// `true` if the two meet, by the meshes or, without a mesh, by the unlimited search.
    pub meets: bool,
}

/// `near` poses of a scaled object within 10 r of first touch, and `swept` poses at each distance
/// of the sweep.
///
/// # Errors
/// When the object cannot be searched.
pub fn asked(
    object: &Object,
    scan: &Scan,
    near: usize,
    swept: usize,
    seed: u64,
) -> Result<Vec<Asked>, Failure> {
    let mut poses: Vec<Pose> = poses::near(object, near, seed)?.iter().map(|near| near.pose).collect();
    poses.extend(poses::sweep(swept, seed, 0).into_iter().flatten());
    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let mut judge: Box<dyn Method + '_> = match &object.mesh {
        Some(mesh) => Box::new(MeshTree::new(mesh)),
        None => Box::new(Ours::new(scan, &options)?),
    };
    let judged = |pose| Asked { pose, meets: judge.ask(&Pose::IDENTITY, &pose).hit };
    Ok(poses.into_iter().map(judged).collect())
}

/// `near` poses of a body near contact with a room, and as many random poses within its bounds.
///
/// Near contact, a random point of the randomly rotated body lies up to ten local radii away from a
/// random point of the room. The unlimited search decides whether they meet.
///
/// # Errors
/// When the scans cannot be searched.
pub fn in_room([room, body]: [&Scan; 2], scale: f64, near: usize, seed: u64) -> Result<Vec<Asked>, Failure> {
    let rng = &mut rng(seed);
    let centre = body.bounds().centre();
    let (frame_a, frame_b) = (room.frame(), body.frame());
    let mut poses = Vec::with_capacity(2 * near);
    for _ in 0..near {
        let (i, j) = (rng.random_range(0..room.len()), rng.random_range(0..body.len()));
        let turned = rotation(rng).with_scale(scale);
        let radius = f64::from(room.radii()[i]) * frame_a.scale;
        let away: f64 = rng.random_range(0.0..10.0);
        let (to, way) = (frame_a.to_world(room.positions()[i]), unit_vector(rng));
        let from = turned.apply(frame_b.to_world(body.positions()[j]));
        poses.push(turned.with_translation([0, 1, 2].map(|k| to[k] + away * radius * way[k] - from[k])));
        let bounds = room.bounds();
        let to =
            [0, 1, 2].map(|k| bounds.min[k] + (bounds.max[k] - bounds.min[k]) * rng.random_range(0.0..1.0));
        let turned = rotation(rng).with_scale(scale);
        let from = turned.apply(centre);
        poses.push(turned.with_translation([0, 1, 2].map(|k| to[k] - from[k])));
    }
    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let mut judge = Ours::of([room, body], &options)?;
    let judged = |pose| Asked { pose, meets: judge.ask(&Pose::IDENTITY, &pose).hit };
    Ok(poses.into_iter().map(judged).collect())
}

/// The 95 % confidence interval of a share, given `wrong` of `all` in a sample (Wilson, "Probable
/// inference, the law of succession, and statistical inference", JASA 22, 1927).
#[must_use]
pub fn interval(wrong: usize, all: usize) -> [f64; 2] {
    const Z: f64 = 1.959_964;
    let n = crate::sample::count(all.max(1));
    let p = crate::sample::count(wrong) / n;
    let middle = p + Z * Z / (2.0 * n);
    let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    [middle - half, middle + half].map(|x| (x / (1.0 + Z * Z / n)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_tables() {
        let close = |[a, b]: [f64; 2], [c, d]: [f64; 2]| (a - c).abs() < 5e-4 && (b - d).abs() < 5e-4;
        assert!(close(interval(0, 10), [0.0, 0.2775]));
        assert!(close(interval(5, 10), [0.2366, 0.7634]));
        assert!(close(interval(10, 1000), [0.0054, 0.0183]));
    }
}
