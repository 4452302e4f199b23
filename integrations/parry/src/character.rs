//! A character that walks among scans and other shapes.

use parry3d::bounding_volume::Aabb;
use parry3d::math::{Real, Vector};
use parry3d::query::QueryDispatcher;
use parry3d::shape::{Ball, Capsule};

use crate::character_options::{CharacterError, CharacterOptions};
use crate::obstacles::{Hit, Obstacle, Obstacles};

/// Walls that one piece of a way may slide along, and slopes that it may slide down.
const SLIDES: u32 = 4;

/// Pieces of a way, each at most as long as a step is high.
const PIECES: Real = 100.0;

/// Passes that push a character out of what it overlaps.
const PUSHES: u32 = 4;

/// At a smaller angle to a wall than that with this sine, the gap to it may become smaller than the skin.
const GRAZING: Real = 0.2;

/// A gap below this share of the skin is restored.
const WORN: Real = 0.5;

/// Lengths below this share of the radius count as none.
const TINY: Real = 1e-4;

/// A kinematic character: it walks, slides along walls, climbs steps, stays on the ground, and falls as
/// the caller says.
///
/// It is a capsule whose lower end, up to the height of a step, is as wide as its foot: a ball of half its
/// radius, or more if steps are low. First the part above the height of a step moves sideways. Then the
/// foot comes down from that height, onto whatever is there: the floor, a step, or a slope. So nothing
/// lower than a step is in the way, and neither is the noise of a scanned floor. The ground carries the
/// character unless it is steeper than the greatest slope; steeper ground is not climbed, and the
/// character slides down on it. An edge carries it if the ground behind the edge does.
///
/// It does not move bodies of a world. Give a kinematic body the shape [`Self::capsule`] and move it to
/// [`Self::centre`], and the world pushes others away. rapier's own controller asks parry about contacts,
/// whatever dispatcher the world has, and does not see scans.
///
/// Deterministic. Costs some 5 to 15 shape casts if the way is no longer than a step is high.
///
/// ```
/// use nearmiss::{BuildOptions, PointCloud, Scan};
/// use nearmiss_parry::{Character, CharacterOptions, Obstacle, ScanDispatcher, ScanShape};
/// use parry3d::math::{Pose, Vector};
/// use parry3d::query::{DefaultQueryDispatcher, QueryDispatcher};
///
/// // A floor, and a step of 0.2 from x = 1 on.
/// let points: Vec<[f64; 3]> = (0..10_000_u32)
///     .map(|i| [f64::from(i % 100) * 0.02, f64::from(i / 100) * 0.02])
///     .map(|[x, z]| [x, if x < 1.0 { 0.0 } else { 0.2 }, z])
///     .collect();
/// let floor = Scan::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let floor = ScanShape::new(floor)?;
/// let obstacles = [Obstacle { pose: Pose::IDENTITY, shape: &floor }];
///
/// let dispatcher = ScanDispatcher.chain(DefaultQueryDispatcher);
/// let mut character = Character::new(&CharacterOptions::default(), Vector::new(0.4, 0.0, 1.0))?;
/// for _ in 0..25 {
///     let stride = character.step(Vector::new(0.04, -0.01, 0.0), &dispatcher, &obstacles);
///     assert!(stride.is_grounded);
/// }
/// let feet = character.feet();
/// assert!((feet.x - 1.4).abs() < 1e-3 && (feet.y - 0.2).abs() < 5e-3, "{feet}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Character {
    options: CharacterOptions,
    feet: Vector,
    /// Height of the last ground, from which a climb counts; that of the feet in the air.
    footing: Real,
    is_grounded: bool,
}

/// The result of a [step](Character::step).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stride {
    /// The way of the feet.
    pub moved: Vector,
    /// `true` if something was in the way to the side or above.
    pub is_blocked: bool,
    /// `true` if it stands on ground that carries it. The caller then sets the speed of a fall to zero.
    pub is_grounded: bool,
    /// The unit normal of what is below the feet, also where it is too steep to stand.
    pub ground: Option<Vector>,
}

/// A place after a piece of a way.
#[derive(Debug, Clone, Copy)]
struct Place {
    feet: Vector,
    is_blocked: bool,
    ground: Option<Ground>,
}

/// A piece of a way.
#[derive(Debug, Clone, Copy)]
struct Way {
    /// To the side.
    aside: Vector,
    /// Up; negative for down.
    rise: Real,
    /// The drop to ground that is followed.
    snap: Real,
    /// Height from which a climb counts.
    footing: Real,
}

impl Character {
    /// Puts the feet of a character at a place, in the air until the first step.
    ///
    /// # Errors
    /// If an option is out of range; the error names it. If the place is not finite.
    pub fn new(options: &CharacterOptions, feet: Vector) -> Result<Self, CharacterError> {
        let options = options.checked()?;
        if !feet.is_finite() {
            return Err(CharacterError::Feet { got: feet });
        }
        Ok(Self { options, feet, footing: feet.dot(options.up), is_grounded: false })
    }

    /// The place of the feet.
    #[must_use]
    pub fn feet(&self) -> Vector {
        self.feet
    }

    /// The middle of the capsule.
    #[must_use]
    pub fn centre(&self) -> Vector {
        self.feet + self.options.up * (0.5 * self.options.height)
    }

    /// The capsule about its centre, for a collider.
    #[must_use]
    pub fn capsule(&self) -> Capsule {
        let CharacterOptions { up, height, radius, .. } = self.options;
        let half = up * (0.5 * height - radius);
        Capsule::new(-half, half, radius)
    }

    /// Returns `true` if it stands on ground that carries it.
    #[must_use]
    pub fn is_grounded(&self) -> bool {
        self.is_grounded
    }

    /// The options, with a unit vector up.
    #[must_use]
    pub fn options(&self) -> &CharacterOptions {
        &self.options
    }

    /// A box around all places that the next step may reach: obstacles outside it need not be listed.
    #[must_use]
    pub fn reach(&self, wanted: Vector) -> Aabb {
        let CharacterOptions { height, radius, step, snap, skin, .. } = self.options;
        let half = 0.5 * height + radius + step + snap + skin + wanted.length();
        Aabb::from_half_extents(self.centre(), Vector::splat(half))
    }

    /// Moves the character by `wanted` as far as obstacles allow, at most a hundred step heights to the
    /// side. The part of `wanted` along `up` is the caller's jump or fall, for example the speed of the
    /// fall times the time of a frame.
    ///
    /// A character on the ground that is not lifted follows the ground down by up to the snap. A way that
    /// is not finite counts as none.
    pub fn step(
        &mut self,
        wanted: Vector,
        dispatcher: &dyn QueryDispatcher,
        obstacles: &[Obstacle<'_>],
    ) -> Stride {
        let start = self.feet;
        let up = self.options.up;
        let wanted = if wanted.is_finite() { wanted } else { Vector::ZERO };
        let rise = wanted.dot(up);
        let aside = wanted - up * rise;
        let pieces = (aside.length() / self.options.step).ceil().clamp(1.0, PIECES);
        // Longer ways end early.
        let aside = aside.clamp_length_max(PIECES * self.options.step);
        let obstacles = Obstacles { list: obstacles, dispatcher };
        let (mut is_blocked, mut ground) = (false, None);
        let walk = Walk { options: &self.options, obstacles };
        self.feet = walk.pushed_out(self.feet);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most `PIECES`")]
        for _ in 0..pieces as u32 {
            let snap = if self.is_grounded && rise <= 0.0 { self.options.snap } else { 0.0 };
            let way = Way { aside: aside / pieces, rise: rise / pieces, snap, footing: self.footing };
            let place = walk.piece(self.feet, &way, SLIDES);
            let below = place.ground.filter(|it| it.carries);
            self.feet = place.feet;
            self.is_grounded = below.is_some();
            self.footing = below.map_or(self.feet, |it| it.point).dot(up);
            is_blocked |= place.is_blocked;
            ground = place.ground.map(|it| it.normal);
        }
        Stride { moved: self.feet - start, is_blocked, is_grounded: self.is_grounded, ground }
    }
}

/// The ground below a place.
#[derive(Debug, Clone, Copy)]
struct Ground {
    /// Its height above the place.
    height: Real,
    point: Vector,
    normal: Vector,
    /// `true` if it carries the character.
    carries: bool,
}

/// A character among obstacles.
struct Walk<'a> {
    options: &'a CharacterOptions,
    obstacles: Obstacles<'a>,
}

impl Walk<'_> {
    /// The part above the height of a step, relative to the feet.
    fn body(&self) -> Capsule {
        let CharacterOptions { up, height, radius, step, .. } = *self.options;
        Capsule::new(up * (step + radius), up * (height - radius), radius)
    }

    /// The radius of the foot. On a slope that carries it, the body is free above a foot of this size.
    fn foot(&self) -> Real {
        let CharacterOptions { radius, step, .. } = *self.options;
        radius - step.min(0.5 * radius)
    }

    fn tiny(&self) -> Real {
        TINY * self.options.radius
    }

    /// The part of a vector across `up`.
    fn flat(&self, v: Vector) -> Vector {
        v - self.options.up * v.dot(self.options.up)
    }

    fn is_gentle(&self, normal: Vector) -> bool {
        normal.dot(self.options.up) >= self.options.slope.cos()
    }

    /// Moves the body out of walls, until it keeps the skin.
    fn pushed_out(&self, mut feet: Vector) -> Vector {
        let (body, skin) = (self.body(), self.options.skin);
        for _ in 0..PUSHES {
            match self.obstacles.gap(&body, feet, skin) {
                Some((gap, out)) if gap < WORN * skin => feet += out * (skin - gap),
                _ => break,
            }
        }
        feet
    }

    /// Moves the body sideways, along walls. Returns `true` if it met one.
    fn slide(&self, mut feet: Vector, way: Vector) -> (Vector, bool) {
        let (body, skin) = (self.body(), self.options.skin);
        let mut rest = way;
        let mut last: Option<Vector> = None;
        for _ in 0..SLIDES {
            let length = rest.length();
            if length <= self.tiny() {
                break;
            }
            // Also keeps the skin from what is a little further.
            let ahead = rest * (1.0 + skin / length);
            let Some(hit) = self.obstacles.cast(&body, feet, ahead) else {
                return (feet + rest, last.is_some());
            };
            let Some(wall) = self.wall(feet, ahead, &hit) else { return (feet, true) };
            let sine = -rest.dot(wall) / length;
            let go = (hit.share * (length + skin) - skin / sine.max(GRAZING)) / length;
            if go >= 1.0 {
                return (feet + rest, last.is_some());
            }
            let go = go.max(0.0);
            feet += rest * go;
            rest *= 1.0 - go;
            rest -= wall * rest.dot(wall);
            // Into a corner, or back.
            if last.is_some_and(|last| rest.dot(last) < 0.0) || rest.dot(way) <= 0.0 {
                return (feet, true);
            }
            last = Some(wall);
        }
        (feet, last.is_some())
    }

    /// The horizontal normal of what stops the body: that of the surface, or the way from the contact to
    /// the axis where the surface does not face the motion, as at the rim of an obstacle.
    fn wall(&self, feet: Vector, way: Vector, hit: &Hit) -> Option<Vector> {
        let normals = [hit.normal, feet + way * hit.share - hit.point];
        let walls = normals.into_iter().filter_map(|normal| self.flat(normal).try_normalize());
        walls.into_iter().find(|wall| wall.dot(way) < 0.0)
    }

    /// Moves the body by `way`, which is vertical, and keeps the skin. Returns the share and the hit.
    fn lift(&self, feet: Vector, way: Vector) -> (Real, Option<Hit>) {
        let length = way.length();
        if length <= self.tiny() {
            return (1.0, None);
        }
        let skin = self.options.skin;
        let hit = self.obstacles.cast(&self.body(), feet, way * (1.0 + skin / length));
        let share = hit.map_or(1.0, |hit| (hit.share * (length + skin) - skin) / length);
        (share.clamp(0.0, 1.0), hit.filter(|_| share < 1.0))
    }

    /// The first contact of the foot, which comes down from the height of a step to `fall` below the feet.
    fn ground(&self, feet: Vector, fall: Real) -> Option<Ground> {
        let CharacterOptions { up, step, .. } = *self.options;
        let (radius, way) = (self.foot(), step + fall);
        let from = feet + up * (step + radius);
        let hit = self.obstacles.cast(&Ball::new(radius), from, -up * way)?;
        let height = step - hit.share * way;
        let carries = self.is_gentle(hit.normal) || self.is_ledge(from, &hit);
        // Upwards also where the foot meets a surface from behind.
        let normal = if hit.normal.dot(up) < 0.0 { -hit.normal } else { hit.normal };
        Some(Ground { height, point: hit.point, normal, carries })
    }

    /// Returns `true` if the foot rests on an edge, and there is gentle ground behind it.
    fn is_ledge(&self, from: Vector, hit: &Hit) -> bool {
        let (up, radius) = (self.options.up, self.foot());
        let Some(out) = self.flat(hit.point - from).try_normalize() else { return false };
        let above = hit.point + out * (0.5 * radius) + up * radius;
        let normal = self.obstacles.normal_along(above, -up * (2.0 * radius));
        normal.is_some_and(|normal| self.is_gentle(normal))
    }

    /// Takes a piece of a way: sideways, then up or down. On gentle ground, it goes down by the snap at
    /// least.
    fn piece(&self, from: Vector, way: &Way, slides: u32) -> Place {
        let Way { aside, rise, snap, .. } = *way;
        let up = self.options.up;
        let (mut feet, mut is_blocked) = self.slide(from, aside);
        if rise > 0.0 {
            let (share, hit) = self.lift(feet, up * rise);
            feet += up * (rise * share);
            is_blocked |= hit.is_some();
        }
        let fall = (-rise).max(0.0);
        // Beyond the fall, only ground that carries it counts.
        let ground = self.ground(feet, fall.max(snap)).filter(|it| it.height >= -fall || it.carries);
        if let Some(it) = ground.filter(|it| it.height > self.tiny()) {
            let steep = self.steep(feet, &it, way.footing).filter(|steep| aside.dot(*steep) < 0.0);
            let has_room = self.lift(feet, up * it.height).1.is_none();
            if (steep.is_some() || !has_room) && aside != Vector::ZERO {
                // Along the foot of the slope, or not at all.
                let along = steep.filter(|_| slides > 0);
                let aside = along.map_or(Vector::ZERO, |steep| aside - steep * aside.dot(steep));
                let place = self.piece(from, &Way { aside, ..*way }, slides.saturating_sub(1));
                return Place { is_blocked: true, ..place };
            }
            if has_room {
                feet += up * it.height;
            }
            return Place { feet, is_blocked, ground };
        }
        let down = ground.map_or(fall, |it| (-it.height).max(0.0));
        let (share, rim) = self.lift(feet, -up * down);
        let ground = match rim {
            // The body is wider than the foot.
            Some(hit) => self.rim(feet, &hit),
            None => ground,
        };
        let feet = feet - up * (down * share);
        let left = fall - down * share;
        match ground {
            Some(Ground { normal, carries: false, .. }) if left > self.tiny() && slides > 0 => {
                let way_down = -up * left;
                let along = way_down - normal * way_down.dot(normal);
                let down = along.dot(up).min(0.0);
                let way = Way { aside: self.flat(along), rise: down, snap: 0.0, ..*way };
                let slid = self.piece(feet, &way, slides - 1);
                Place { is_blocked: is_blocked || slid.is_blocked, ..slid }
            }
            _ => Place { feet, is_blocked, ground },
        }
    }

    /// The horizontal direction away from ground that is not climbed: too steep, or too high above the
    /// footing.
    fn steep(&self, feet: Vector, ground: &Ground, footing: Real) -> Option<Vector> {
        if ground.point.dot(self.options.up) - footing > self.options.step {
            return self.flat(feet - ground.point).try_normalize();
        }
        self.flat(ground.normal).try_normalize().filter(|_| !ground.carries)
    }

    /// A rim on which the lower end of the body hangs, with the normal from the contact to the centre of
    /// that end.
    fn rim(&self, feet: Vector, hit: &Hit) -> Option<Ground> {
        let CharacterOptions { up, radius, .. } = *self.options;
        let across = self.flat(feet - hit.point);
        let height = (radius * radius - across.length_squared()).max(0.0).sqrt();
        let normal = (across + up * height).try_normalize()?;
        Some(Ground { height: 0.0, point: hit.point, normal, carries: false })
    }
}
