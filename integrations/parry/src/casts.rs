//! The first impact of a shape that moves past a scan, by [`Target::sweep`](nearmiss::Target::sweep), and
//! of another scan, by [`Sweep`].

use parry3d::math::{Real, Vector};
use parry3d::query::{NonlinearRigidMotion, ShapeCastHit, ShapeCastOptions, ShapeCastStatus, Unsupported};
use parry3d::shape::TypedShape;

use nearmiss::{
    Contact, Motion, Pose, Prepared as _, Ray, Shape, ShapeContact, ShapeSweepVerdict, Sweep, SweepOptions,
    SweepPlan, SweepVerdict,
};

use crate::convert::{from_pose, from_vector, to_real, to_vector};
use crate::manifolds::Touch;
use crate::parts::for_parts;
use crate::question::Question;
use crate::scan_shape::{ScanShape, with_scratch};

/// The angle of a piece of a motion, which is a screw, in radians. The path of the centre of mass, which
/// is straight, differs from it by about an eightieth of the way of a piece.
const TURN: f64 = 0.1;

/// The most pieces of a motion.
const PIECES: f64 = 1024.0;

/// The radius of the ball about the centre of mass that must not pass, as a share of the thickness.
const CORE: f64 = 0.25;

/// A motion of the other shape.
struct Course {
    /// Displacements in the frame of the scan, from the identity on.
    motion: Motion,
    /// The time of the caller per unit of time of `motion`, and at its start.
    rate: f64,
    start: f64,
    /// A bound on the way of any point of the shape.
    way: f64,
}

/// The first contact along a course.
struct Impact {
    /// By the clock of the motion.
    time: f64,
    part: u32,
    contact: ShapeContact,
}

/// The first impact of a translation. `velocity` is that of the other shape in the frame of the scan.
pub(crate) fn cast(
    asked: &Question<'_>,
    velocity: Vector,
    options: &ShapeCastOptions,
) -> Result<Option<ShapeCastHit>, Unsupported> {
    let speed = f64::from(velocity.length());
    let bounds = asked.scan.bounds();
    let sphere = asked.other.compute_local_bounding_sphere();
    let (centre, radius) = match asked.other.as_typed_shape() {
        TypedShape::HalfSpace(_) => (asked.pose.translation, 0.0),
        _ => (asked.pose * sphere.center, f64::from(sphere.radius)),
    };
    // Further on, it has passed the scan.
    let passed = f64::from((centre - bounds.center()).length())
        + 2.0 * f64::from(bounds.half_extents().length())
        + radius
        + f64::from(options.target_distance);
    let way = (f64::from(options.max_time_of_impact) * speed).min(passed);
    if let Some(ball) = asked.other.as_ball().filter(|_| speed > 0.0) {
        let ray = Ray::new(from_vector(asked.pose.translation), from_vector(velocity))
            .with_max(way)
            .with_radius(f64::from(ball.radius + options.target_distance));
        let hit = with_scratch(|scratch| asked.scan.target().cast(&ray, scratch).hit);
        // The way out of a contact at the start depends on the side of the centre.
        if hit.is_none_or(|hit| hit.t > 0.0) {
            return Ok(hit.map(|hit| {
                let depth = -f64::from(options.target_distance);
                let contact = ShapeContact { point: hit.point, normal: hit.normal, depth, id: 0 };
                let step = from_vector(velocity).map(|c| c / speed * hit.t);
                told(asked, (0, &contact), &Pose::from_translation(step), hit.t / speed, false)
            }));
        }
    }
    let motion = if speed > 0.0 {
        let step = from_vector(velocity).map(|c| c / speed * way);
        Motion::through(&[Pose::IDENTITY, Pose::from_translation(step)]).or(Err(Unsupported))?
    } else {
        Motion::still(Pose::IDENTITY)
    };
    let rate = if speed > 0.0 { way / speed } else { 0.0 };
    let course = Course { motion, rate, start: 0.0, way };
    let impact = first_impact(asked, &course, options.target_distance)?;
    Ok(impact.map(|impact| course.told(asked, &impact)))
}

/// The first impact of two rigid motions, that of the scan and that of the other shape, between two
/// times.
pub(crate) fn cast_turning(
    asked: &Question<'_>,
    motions: [&NonlinearRigidMotion; 2],
    times: [Real; 2],
    stop_at_penetration: bool,
) -> Result<Option<ShapeCastHit>, Unsupported> {
    let course = Course::new(asked, motions, times)?;
    let impact = first_impact(asked, &course, 0.0)?;
    let touches = impact.as_ref().is_some_and(|it| it.time <= 0.0);
    let impact = if touches && !stop_at_penetration { passes(asked, &course) } else { impact };
    Ok(impact.map(|impact| course.told(asked, &impact)))
}

/// The impact of a ball about the centre of mass, if it is apart from the scan at first.
fn passes(asked: &Question<'_>, course: &Course) -> Option<Impact> {
    let centre = asked.pose * asked.other.mass_properties(1.0).local_com;
    let radius = CORE * f64::from(asked.other.ccd_thickness());
    let core = Shape::Sphere { centre: from_vector(centre), radius };
    let target = asked.scan.target();
    let verdict = with_scratch(|scratch| target.sweep(&core, &course.motion, scratch)).verdict;
    match verdict {
        ShapeSweepVerdict::Impact { t_hit, contact, .. } if t_hit > 0.0 => {
            Some(Impact { time: t_hit, part: 0, contact })
        }
        _ => None,
    }
}

/// The first impact of any part of the other shape, or of the other scan.
fn first_impact(
    asked: &Question<'_>,
    course: &Course,
    target_distance: Real,
) -> Result<Option<Impact>, Unsupported> {
    if let Some(other) = asked.other_scan() {
        return first_impact_of_scans(asked, other, course, target_distance);
    }
    let target = asked.scan.target_within(target_distance);
    let mut first: Option<Impact> = None;
    let margin = to_real(course.way) + target_distance;
    for_parts(asked.scan, asked.other, &asked.pose, Some(margin), &mut |part| {
        let sweep = with_scratch(|scratch| target.sweep(part.shape, &course.motion, scratch));
        if let ShapeSweepVerdict::Impact { t_hit, contact, .. } = sweep.verdict
            && first.as_ref().is_none_or(|first| t_hit < first.time)
        {
            first = Some(Impact { time: t_hit, part: part.id, contact });
        }
    })?;
    Ok(first)
}

fn first_impact_of_scans(
    asked: &Question<'_>,
    other: &ScanShape,
    course: &Course,
    target_distance: Real,
) -> Result<Option<Impact>, Unsupported> {
    let options = SweepOptions::default()
        .with_semantics(asked.scan.semantics())
        .with_clearance(f64::from(target_distance).max(0.0));
    let plan = SweepPlan::new(&options, asked.scan.scan(), other.scan()).or(Err(Unsupported))?;
    let still = Motion::still(*asked.scan.pose());
    let moving = course.of(&from_pose(&asked.pose).after(other.pose()))?;
    let sweep = Sweep::new(asked.scan.scan().along(&still), other.scan().along(&moving));
    let answer = with_scratch(|scratch| sweep.first_impact(&plan, scratch));
    let SweepVerdict::Impact { t_hit: time, contact, .. } = answer.verdict else { return Ok(None) };
    // At first, the scans may be moving apart, so the side decides.
    let deepest = if time <= 0.0 { asked.deepest(target_distance)? } else { None };
    let deepest = deepest.map(|Touch { points: [point, _], normal, gap, .. }| ShapeContact {
        point,
        normal,
        depth: -gap,
        id: 0,
    });
    let contact = deepest.unwrap_or_else(|| against(&contact, course.velocity(time, contact.point)));
    Ok(Some(Impact { time, part: 0, contact }))
}

/// A contact where surfaces meet first. Where the border of one meets the inside of the other, only the
/// normal of the latter is that of the contact. That is the one more against the velocity of the second.
fn against(contact: &Contact, velocity: [f64; 3]) -> ShapeContact {
    let along = |n: [f64; 3]| (0..3).map(|k| n[k] * velocity[k]).sum::<f64>();
    let speed = along(velocity).sqrt();
    let [a, b] = contact.normals.unwrap_or([velocity.map(|c| c / speed.max(f64::MIN_POSITIVE)); 2]);
    let normal = if along(a).abs() >= along(b).abs() { a } else { b };
    let normal = if along(normal) > 0.0 { normal.map(|c| -c) } else { normal };
    ShapeContact { point: contact.point, normal, depth: 0.0, id: 0 }
}

impl Course {
    fn new(
        asked: &Question<'_>,
        [of_scan, of_other]: [&NonlinearRigidMotion; 2],
        [start, end]: [Real; 2],
    ) -> Result<Self, Unsupported> {
        let angle = f64::from((of_scan.angvel.length() + of_other.angvel.length()) * (end - start));
        let pieces = (angle / TURN).ceil().clamp(1.0, PIECES);
        let rate = f64::from(end - start) / pieces;
        let origin = from_pose(&asked.pose).inverse();
        let at = |time: Real| {
            let placed = of_scan.position_at_time(time).inv_mul(&of_other.position_at_time(time));
            from_pose(&placed).after(&origin)
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most `PIECES`")]
        let times = (1..=pieces as u32).map(|k| start + to_real(rate * f64::from(k)));
        let poses: Vec<Pose> = std::iter::once(Pose::IDENTITY).chain(times.map(at)).collect();
        let sphere = asked.other.compute_local_bounding_sphere();
        let centre = from_vector(asked.pose * sphere.center);
        let ways = poses.windows(2).map(|pair| {
            let [p, q] = [pair[0].apply(centre), pair[1].apply(centre)];
            (0..3).map(|k| (q[k] - p[k]).powi(2)).sum::<f64>().sqrt()
        });
        // An arc is a little longer than its chord.
        let way = 1.01 * ways.sum::<f64>() + angle * f64::from(sphere.radius);
        let motion = Motion::through(&poses).or(Err(Unsupported))?;
        Ok(Self { motion, rate, start: f64::from(start), way })
    }

    /// The velocity of the other shape at `point` just before `time`, which is above zero.
    fn velocity(&self, time: f64, point: [f64; 3]) -> [f64; 3] {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most `PIECES`")]
        let piece = (time.ceil() - 1.0).max(0.0) as usize;
        self.motion.screw(piece).velocity(point)
    }

    /// The motion of what is at `pose` at first.
    fn of(&self, pose: &Pose) -> Result<Motion, Unsupported> {
        let ends = (0_u32..).map(f64::from).take_while(|time| *time <= self.motion.duration());
        let poses: Vec<Pose> = ends.map(|time| self.motion.at(time).after(pose)).collect();
        Motion::through(&poses).or(Err(Unsupported))
    }

    fn told(&self, asked: &Question<'_>, impact: &Impact) -> ShapeCastHit {
        let time = self.start + self.rate * impact.time;
        let moved = self.motion.at(impact.time);
        told(asked, (impact.part, &impact.contact), &moved, time, impact.time <= 0.0)
    }
}

/// The hit in the words of parry. `moved` is the displacement up to the impact.
fn told(
    asked: &Question<'_>,
    (part, contact): (u32, &ShapeContact),
    moved: &Pose,
    time: f64,
    is_at_start: bool,
) -> ShapeCastHit {
    let placed = moved.after(&from_pose(&asked.pose));
    let deepest = [0, 1, 2].map(|k| contact.point[k] - contact.depth * contact.normal[k]);
    let away = to_vector(placed.rotate_inverse(contact.normal.map(|c| -c)));
    let (normal1, normal2) = asked.ordered(to_vector(contact.normal), away);
    let on_other = to_vector(placed.apply_inverse(deepest));
    let (witness1, witness2) = asked.ordered(to_vector(contact.point), on_other);
    let (subshape1, subshape2) = asked.ordered(0, part);
    let status =
        if is_at_start { ShapeCastStatus::PenetratingOrWithinTargetDist } else { ShapeCastStatus::Converged };
    let time_of_impact = to_real(time);
    ShapeCastHit { time_of_impact, witness1, witness2, normal1, normal2, status, subshape1, subshape2 }
}
