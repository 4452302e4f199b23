//! An arm of six links in a world with a room, and the proof that a motion of its joints is free.

use nearmiss::{Bodies, BodyId, DistancePlan, NearestPair, Placed, Pose, Scan, Scratch, Shape, World};

pub(crate) const LINKS: usize = 6;

/// The angles of the joints.
pub(crate) type Angles = [f64; LINKS];

/// Axes of the joints, each in the frame of the link before it.
const AXES: [[f64; 3]; LINKS] =
    [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Lengths of the links, and the radius of all, as shares of the length of the arm.
const LENGTHS: [f64; LINKS] = [0.16, 0.28, 0.24, 0.12, 0.12, 0.08];
const RADIUS: f64 = 0.03;

/// The length of a tool in the hand.
const TOOL: f64 = 0.12;

/// The greatest clearance that is proven, as a share of the length of the arm. Pairs further apart need no
/// distance query.
pub(crate) const CLEARANCE: f64 = 0.05;

/// Intervals shorter than this are not split.
const SHORTEST: f64 = 1e-4;

/// A body of a link.
#[derive(Debug, Clone, Copy)]
struct Part {
    id: BodyId,
    link: usize,
    is_tool: bool,
    /// The body's pose in the frame of the link.
    offset: Pose,
    /// The greatest distance of the body from the joint of its link.
    reach: f64,
}

/// An arm in a room.
#[derive(Debug)]
pub(crate) struct Arm<'a> {
    world: World<&'a Scan, std::convert::Infallible, Shape<'static>>,
    room: BodyId,
    parts: Vec<Part>,
    pub(crate) base: [f64; 3],
    /// The sum of the lengths of the links.
    pub(crate) length: f64,
    plan: DistancePlan,
}

/// The capsule of a link in its frame.
fn capsule(link: usize, length: f64) -> Shape<'static> {
    let tip = [LENGTHS[link] * length, 0.0, 0.0];
    Shape::Capsule { ends: [[0.0; 3], tip], radius: RADIUS * length }
}

/// Poses of the links.
fn poses(base: [f64; 3], length: f64, angles: &Angles) -> [Pose; LINKS] {
    let mut at = Pose::from_translation(base);
    std::array::from_fn(|k| {
        let pose = at.after(&Pose::from_axis_angle(AXES[k], angles[k]));
        at = pose.after(&Pose::from_translation([LENGTHS[k] * length, 0.0, 0.0]));
        pose
    })
}

impl<'a> Arm<'a> {
    /// Puts an arm whose first joint is at `base` into a room. A scanned tool may be in its hand.
    pub(crate) fn new(
        room: &'a Scan,
        (base, length): ([f64; 3], f64),
        tool: Option<&'a Scan>,
        plan: DistancePlan,
    ) -> Self {
        let mut world = World::with_shapes();
        let room = world.insert(room, &Pose::IDENTITY);
        let mut parts: Vec<Part> = (0..LINKS)
            .map(|link| Part {
                id: world.insert_shape(capsule(link, length), &Pose::IDENTITY),
                link,
                is_tool: false,
                offset: Pose::IDENTITY,
                reach: (LENGTHS[link] + RADIUS) * length,
            })
            .collect();
        if let Some(tool) = tool {
            let bounds = tool.bounds();
            let size = 2.0 * bounds.half_extents().into_iter().fold(0.0, f64::max);
            // The middle of the tool is in front of the hand.
            let shrunk = Pose::IDENTITY.with_scale(TOOL * length / size);
            let (from, ahead) = (shrunk.apply(bounds.centre()), (LENGTHS[LINKS - 1] + 0.5 * TOOL) * length);
            let offset = shrunk.with_translation([ahead - from[0], -from[1], -from[2]]);
            let id = world.insert(tool, &offset);
            // The box of the surface, whose joint is now at the origin.
            let corners = world.bounds(id).map_or([[f64::INFINITY; 3]; 8], |bounds| bounds.corners());
            let norm = |p: [f64; 3]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
            let reach = corners.into_iter().map(norm).fold(0.0, f64::max);
            parts.push(Part { id, link: LINKS - 1, is_tool: true, offset, reach });
        }
        Self { world, room, parts, base, length, plan }
    }

    /// The capsules of the links.
    pub(crate) fn links(&self, angles: &Angles) -> [Shape<'static>; LINKS] {
        let poses = poses(self.base, self.length, angles);
        std::array::from_fn(|k| {
            let at_rest = capsule(k, self.length);
            at_rest.moved(&poses[k]).unwrap_or(at_rest)
        })
    }

    /// Places on the tool where it is now, some 80.
    pub(crate) fn tool(&self) -> Vec<[f64; 3]> {
        let places = |tool: Placed<'_>| -> Vec<[f64; 3]> {
            let count = tool.scan().len();
            (0..count).step_by(count.div_ceil(80)).map(|i| tool.point(i)).collect()
        };
        let tool = self.parts.iter().find_map(|part| self.world.placed(part.id));
        tool.map(places).unwrap_or_default()
    }

    /// Moves all bodies.
    pub(crate) fn turn_to(&mut self, angles: &Angles) {
        let poses = poses(self.base, self.length, angles);
        for part in &self.parts {
            self.world.move_to(part.id, &poses[part.link].after(&part.offset));
        }
    }

    /// Returns the part of a link with this body; `None` for the room.
    fn part(&self, id: BodyId) -> Option<&Part> {
        self.parts.iter().find(|part| part.id == id)
    }

    /// Tells whether a pair of bodies matters: a link and the room, or two links that are no neighbours. The
    /// tool is no neighbour of the link before its own.
    fn counts(&self, a: BodyId, b: BodyId) -> bool {
        match (self.part(a), self.part(b)) {
            (Some(a), Some(b)) => a.link.abs_diff(b.link) > usize::from(!a.is_tool && !b.is_tool),
            _ => true,
        }
    }

    /// A bound on how far the bodies of a pair move, one as seen from the other, while the joints turn by
    /// `turns`: a joint moves a place by no more than its angle times the length of the arm up to it.
    fn travel(&self, [a, b]: [BodyId; 2], turns: &Angles) -> f64 {
        let (a, b) = (self.part(a), self.part(b));
        // The number of joints between a body and the base.
        let joints = |part: Option<&Part>| part.map_or(0, |part| part.link + 1);
        let (first, far) = if joints(a) < joints(b) { (joints(a), b) } else { (joints(b), a) };
        let Some(far) = far else { return 0.0 };
        let reach = |joint: usize| LENGTHS[joint..far.link].iter().sum::<f64>() * self.length + far.reach;
        (first..=far.link).map(|joint| turns[joint].abs() * reach(joint)).sum()
    }

    /// A lower bound on the distance that all pairs keep while the joints turn by up to `turns` either
    /// way, at most [`CLEARANCE`] of the length of the arm; and whether a pair touches now.
    fn clearance(&self, turns: &Angles, pairs: &mut Vec<[BodyId; 2]>, scratch: &mut Scratch) -> (f64, bool) {
        let most = CLEARANCE * self.length;
        let reach = |a, b| self.counts(a, b).then(|| most + self.travel([a, b], turns));
        let all = || self.parts.iter().map(|part| part.id);
        let farthest = all().map(|id| self.travel([self.room, id], turns)).fold(0.0, f64::max);
        // A pair of links moves no more than the outer one and the room.
        self.world.near_pairs_by(Bodies::All, most + farthest, reach, pairs);
        let (mut least, mut touches) = (most, false);
        for &ids in &*pairs {
            let found = self.world.body_pair(ids).and_then(|pair| pair.distance(&self.plan, scratch));
            let [lower, upper] = found.map_or([0.0, f64::INFINITY], |found| [found.lower, found.upper]);
            least = least.min(lower - self.travel(ids, turns));
            touches |= upper <= 0.0;
        }
        (least, touches)
    }

    /// The nearest pair of a link and the room, and that of two links.
    pub(crate) fn nearest_pairs(&self, scratch: &mut Scratch) -> [Option<NearestPair>; 2] {
        [true, false].map(|with_room| {
            let counts = |a: BodyId, b: BodyId| self.counts(a, b) && (a == self.room) == with_room;
            self.world.nearest_pair(Bodies::All, f64::INFINITY, counts, &self.plan, scratch)
        })
    }

    /// Returns the name of a body, for people.
    pub(crate) fn name(&self, id: BodyId) -> String {
        match self.part(id) {
            None => "the room".into(),
            Some(part) if part.is_tool => "the tool".into(),
            Some(part) => format!("link {}", part.link),
        }
    }
}

/// The angles at a time from 0 to 1.
pub(crate) fn between([from, to]: [&Angles; 2], time: f64) -> Angles {
    std::array::from_fn(|k| from[k] + (to[k] - from[k]) * time)
}

/// The proof that a leg of a path is free.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Proof {
    /// The distance that all pairs keep, proven.
    pub(crate) clearance: f64,
    pub(crate) intervals: u32,
}

/// Proves that a leg is free: in the middle of each interval all pairs are further apart than they can
/// move until its ends. Otherwise the interval is halved. Returns the time of the first doubt if there is
/// no proof.
pub(crate) fn prove(arm: &mut Arm<'_>, leg: [&Angles; 2], scratch: &mut Scratch) -> Result<Proof, f64> {
    let mut proof = Proof { clearance: f64::INFINITY, intervals: 0 };
    let mut pairs = Vec::new();
    // The earliest on top.
    let mut open = vec![[0.0, 1.0]];
    while let Some([start, end]) = open.pop() {
        let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
        let turns = std::array::from_fn(|k| (leg[1][k] - leg[0][k]) * half);
        arm.turn_to(&between(leg, middle));
        let (least, touches) = arm.clearance(&turns, &mut pairs, scratch);
        proof.intervals += 1;
        if least > 0.0 {
            proof.clearance = proof.clearance.min(least);
        } else if touches || end - start < SHORTEST {
            return Err(start);
        } else {
            open.extend([[middle, end], [start, middle]]);
        }
    }
    Ok(proof)
}
