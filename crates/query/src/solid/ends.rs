//! Contacts at the ends of sheets. A shape beside or across the end of a sheet moves out past the end,
//! along the sheet, if that is the shorter way.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use fearless_simd::Level;
use nearmiss_geometry::nalgebra::Vector3;

use crate::leaf::disc_triangle::FlatDisc;
use crate::pair::placed::ViewScratch;
use crate::solid::candidates::{Candidate, CandidateBlocks, Slab, single};
use crate::solid::core::Solid;
use crate::solid::elements::{Element, Elements};
use crate::solid::place::{PRECISION, Place, disc_gap, from_behind, place_at};
use crate::solid::sides::Sides;
use crate::solid::touch::touch;

type Vector = Vector3<f64>;

/// The greatest numbers of points at borders, and of sheets, that are looked at.
const BORDERS: u32 = 16;
const SHEETS: u32 = 4;

/// The least cosine of the normals of two discs of a sheet.
const SAME: f64 = 0.7;

/// The greatest distance of a disc from the plane of another one of the sheet, in local radii.
const LEVEL: f32 = 1.0;

/// The greatest distance of the centres of two discs of a sheet, in the sum of their radii, and the greatest
/// number of discs for which it counts.
const LINK: f64 = 1.6;
const MOST_LINKED: usize = 256;

/// Directions along a sheet that are compared, and halvings of the angle between two of them.
const DIRECTIONS: u32 = 24;
const HALVINGS: u32 = 8;

/// The greatest angle of a way to the sheet, and the angles to either side that are compared.
const STEEP: f64 = TAU / 6.0;
const RISES: i32 = 4;
const TURNS: i32 = 2;

/// A sheet ends in a direction if a ball before the furthest disc touches nothing: the distance of its
/// centre from the rim and its radius, in local radii.
const BEFORE: f64 = 0.5;
const BALL: f64 = 0.4;

/// The directions in which a sheet may end that are tried, and the cosine of the angle between two of them.
const TRIES: u32 = 6;
const ALIKE: f64 = 0.9;

/// A place over a disc if it is within this distance of its centre, in local radii: less than any radius.
const OVER: f32 = 0.35;

/// The cosine of the angle between the way to a core that is behind a disc and the way inwards.
const ACROSS: f64 = 0.5;

/// The least sine of the angle between the normal and the way from the nearest disc to a core past the end.
const LEAST: f64 = 0.05;

/// Reusable memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct SheetEnds {
    discs: Vec<Near>,
    places: Vec<(usize, Place)>,
}

/// A disc near the shape.
#[derive(Debug, Clone, Copy)]
struct Near {
    candidate: Candidate,
    i: usize,
    disc: FlatDisc,
}

/// The discs of a sheet near a shape.
struct Sheet<'s> {
    elements: &'s Elements<'s>,
    solid: &'s Solid<'s>,
    sides: &'s Sides,
    /// A disc at the border, with its local radius.
    border: FlatDisc,
    band: f64,
    discs: &'s [Near],
}

/// The furthest discs of a sheet in some directions along it.
struct Outermost {
    discs: [FlatDisc; DIRECTIONS as usize],
    count: usize,
}

impl Outermost {
    /// Adds a disc unless it is the last one.
    fn push(&mut self, disc: FlatDisc) {
        if self.count == 0 || self.discs[self.count - 1].centre != disc.centre {
            self.discs[self.count] = disc;
            self.count += 1;
        }
    }

    fn all(&self) -> &[FlatDisc] {
        &self.discs[..self.count]
    }
}

/// The way past an end of a sheet.
#[derive(Debug, Clone, Copy)]
struct Way {
    /// A unit vector.
    out: Vector,
    /// The furthest place of the sheet in that direction, from the centre of the border's disc.
    end: f64,
    /// The least place of the shape in that direction.
    low: f64,
}

impl Way {
    /// The length of the shift with which the shape is past the end.
    fn length(&self) -> f64 {
        self.end - self.low
    }
}

impl SheetEnds {
    /// Settles the candidates at which `solid` moves out past the ends of sheets. Returns their points and
    /// places, in the order of their numbers from 0 on. O(n) for n candidates, and nothing if none of them is
    /// at a border.
    pub(crate) fn settle<'s>(
        &'s mut self,
        elements: &Elements<'_>,
        (solid, sides): (&Solid<'_>, &Sides),
        level: Level,
        (found, scratch): (&mut CandidateBlocks, &mut ViewScratch),
    ) -> &'s [(usize, Place)] {
        self.places.clear();
        let mut sheets = 0;
        for _ in 0..BORDERS {
            let Some(border) = found.first_border().filter(|_| sheets < SHEETS) else { break };
            sheets += u32::from(self.leave(elements, (solid, sides), (level, scratch), (found, border)));
        }
        &self.places
    }

    /// Settles the candidates of the sheet to which a point at a border belongs, if the shape moves out past
    /// its end. Returns `false` if it clearly does not.
    fn leave(
        &mut self,
        elements: &Elements<'_>,
        (solid, sides): (&Solid<'_>, &Sides),
        (level, scratch): (Level, &mut ViewScratch),
        (found, border): (&mut CandidateBlocks, Candidate),
    ) -> bool {
        found.look_at(border);
        let i = found.point(border);
        let local = elements.arrays.radii[i];
        let (at, normal, band) = (elements.position(i), elements.normal(i), f64::from(local));
        // The far side of a thin body is no way out.
        let is_opposite = |candidate| {
            let i = found.point(candidate);
            elements.is_disc(i) && elements.normal(i).dot(&normal) <= -SAME
        };
        if found.is_behind(border) && found.in_front().any(is_opposite) {
            return false;
        }
        let slab = Slab {
            at: single(&at),
            normal: single(&normal),
            within: local * LEVEL,
            inside: single(&solid.inside),
        };
        let [most, beside_sq] = found.mark_slab(level, &slab);
        let beside = beside_sq.max(0.0).sqrt();
        // At most 45° steep, a way past the end is longer than the inner radius less the way to the nearest
        // disc.
        let height = (normal.dot(&(solid.inside - at))).abs();
        let least = solid.inner_radius() - FRAC_1_SQRT_2 * (height + f64::from(beside));
        if beside < OVER * local && f64::from(most) <= least {
            return false;
        }
        self.gather(elements, found, &normal);
        let border = FlatDisc { centre: at, normal, radius: f64::from(elements.arrays.discs.get(i)) };
        let bare = elements.bare();
        let mut ends = |sheet: &Sheet<'_>, way: &Way| {
            let ball = Solid::ball((sheet.before(way), BALL * band));
            touch(&bare, ball.as_ref(), None, (level, scratch)).verdict.is_separated()
        };
        let mut leaving =
            Sheet { elements, solid, sides, border, band, discs: &self.discs }.leave(found, &mut ends);
        if leaving.is_none() && connect(&mut self.discs, &border) {
            leaving =
                Sheet { elements, solid, sides, border, band, discs: &self.discs }.leave(found, &mut ends);
        }
        for near in &self.discs {
            found.look_at(near.candidate);
        }
        let Some((way, is_past)) = leaving else { return true };
        let sheet = Sheet { elements, solid, sides, border, band, discs: &self.discs };
        for &Near { candidate, i, disc } in sheet.discs {
            let is_inner = !elements.is_at_border(i);
            let place = if is_past { sheet.past(&disc, &way) } else { sheet.beside(&disc, &way, is_inner) };
            if let Some(place) = place.filter(|_| !found.is_settled(candidate)) {
                found.settle(candidate, self.places.len(), (place.depth, single(&place.normal)));
                self.places.push((i, place));
            }
        }
        true
    }

    /// Gathers the discs with a similar normal in the slab, in the order of their points.
    fn gather(&mut self, elements: &Elements<'_>, found: &CandidateBlocks, normal: &Vector) {
        self.discs.clear();
        self.discs.extend(found.in_slab().filter_map(|candidate| {
            let i = found.point(candidate);
            let Element::Disc(disc) = elements.element(i) else { return None };
            (disc.normal.dot(normal).abs() >= SAME).then_some(Near { candidate, i, disc })
        }));
        self.discs.sort_unstable_by_key(|near| near.i);
    }
}

/// Keeps the discs that are connected to `border`, with at most [`LINK`] radii between two centres. Returns
/// `true` if there are others. O(n²), so nothing for more than [`MOST_LINKED`] discs.
fn connect(discs: &mut Vec<Near>, border: &FlatDisc) -> bool {
    let count = discs.len();
    if count > MOST_LINKED {
        return false;
    }
    let is_linked = |a: &FlatDisc, b: &FlatDisc| {
        (a.centre - b.centre).norm_squared() <= (LINK * (a.radius + b.radius)).powi(2)
    };
    // The discs before `done` are connected, and their neighbours are before `next`.
    let Some(first) = discs.iter().position(|near| near.disc.centre == border.centre) else { return false };
    discs.swap(0, first);
    let (mut done, mut next) = (0, 1);
    while done < next {
        let disc = discs[done].disc;
        let mut k = next;
        while k < count {
            if is_linked(&disc, &discs[k].disc) {
                discs.swap(next, k);
                next += 1;
            }
            k += 1;
        }
        done += 1;
    }
    discs.truncate(next);
    discs.sort_unstable_by_key(|near| near.i);
    next < count
}

impl Sheet<'_> {
    /// The way on which the shape moves out past an end, and `true` if the core reaches through the sheet.
    /// `None` if it moves out across the sheet.
    fn leave(
        &self,
        found: &CandidateBlocks,
        ends: &mut impl FnMut(&Self, &Way) -> bool,
    ) -> Option<(Way, bool)> {
        let (along, outermost) = self.shortest_along(ends)?;
        if let Some(normal) = self.apart(&along) {
            return (normal.dot(&along.out) > LEAST).then_some((along, false));
        }
        let way = self.shortest_about(&along, &outermost, TURNS);
        let way = if ends(self, &way) { way } else { self.shortest_about(&along, &outermost, 0) };
        self.is_deeper(way.length(), found).then_some((way, true))
    }

    /// The shortest way past an end along the sheet, and the furthest discs in directions along the sheet.
    /// `None` if the sheet does not end near the shape.
    fn shortest_along(&self, ends: &mut impl FnMut(&Self, &Way) -> bool) -> Option<(Way, Outermost)> {
        let normal = self.border.normal;
        let first = normal.cross(&Vector::ith(normal.iamin(), 1.0)).normalize();
        let second = normal.cross(&first);
        let step = TAU / f64::from(DIRECTIONS);
        let towards = |k: u32| {
            let (sin, cos) = (step * f64::from(k)).sin_cos();
            first * cos + second * sin
        };
        let mut ways = [None; DIRECTIONS as usize];
        let mut outermost = Outermost { discs: [self.border; DIRECTIONS as usize], count: 0 };
        for (k, way) in (0_u32..).zip(&mut ways) {
            let disc = self.furthest(&towards(k));
            *way = Some(self.way([&disc], towards(k)));
            outermost.push(disc);
        }
        for _ in 0..TRIES {
            let left = ways.iter().copied().flatten();
            let shortest: Way = left.min_by(|a, b| a.length().total_cmp(&b.length()))?;
            let way = self.nearby(&outermost, shortest, &[normal], step);
            if ends(self, &way) {
                return Some((way, outermost));
            }
            for other in &mut ways {
                *other = other.filter(|other| other.out.dot(&shortest.out) < ALIKE);
            }
        }
        None
    }

    /// The shortest way past the end that is at most [`STEEP`] to the sheet, and up to `turns` steps to
    /// either side of that along the sheet.
    fn shortest_about(&self, along: &Way, outermost: &Outermost, turns: i32) -> Way {
        let normal = self.border.normal;
        let across = normal.cross(&along.out);
        let step = STEEP / f64::from(RISES);
        let angles = |steps: i32| (-steps..=steps).map(move |k| step * f64::from(k));
        let outs = angles(turns).flat_map(|turn| {
            let turned = along.out * turn.cos() + across * turn.sin();
            angles(RISES).map(move |rise| turned * rise.cos() + normal * rise.sin())
        });
        let ways = outs.map(|out| self.way(outermost.all(), out));
        let shortest = ways.fold(*along, |best, way| if way.length() < best.length() { way } else { best });
        let axes = [normal.cross(&shortest.out), normal];
        let best = self.nearby(outermost, shortest, &axes[..1 + usize::from(turns > 0)], step);
        self.way(self.discs.iter().map(|near| &near.disc), best.out)
    }

    /// The shortest way near another one, turned about these axes by less than `angle` each.
    fn nearby(&self, discs: &Outermost, from: Way, axes: &[Vector], angle: f64) -> Way {
        let (mut best, mut angle) = (from, angle);
        for _ in 0..HALVINGS {
            angle *= 0.5;
            for axis in axes {
                for side in [-angle, angle] {
                    let turned = best.out + axis.cross(&best.out) * side;
                    let way = self.way(discs.all(), turned.normalize());
                    if way.length() < best.length() {
                        best = way;
                        break;
                    }
                }
            }
        }
        best
    }

    /// A place before the end of the sheet.
    fn before(&self, way: &Way) -> Vector {
        let disc = self.furthest(&way.out);
        disc.centre + disc.rim(&way.out) * (1.0 + BEFORE * self.band / disc.radius)
    }

    /// The furthest disc in a unit direction.
    fn furthest(&self, out: &Vector) -> FlatDisc {
        let reaches = self.discs.iter().map(|near| (self.reach(&near.disc, out), near.disc));
        let none = (f64::NEG_INFINITY, self.border);
        reaches.fold(none, |best, other| if other.0 > best.0 { other } else { best }).1
    }

    /// The way past some discs in a unit direction.
    fn way<'d>(&self, discs: impl IntoIterator<Item = &'d FlatDisc>, out: Vector) -> Way {
        let end = discs.into_iter().map(|disc| self.reach(disc, &out)).fold(f64::NEG_INFINITY, f64::max);
        let low = out.dot(&(self.solid.support(&-out) - self.border.centre)) - self.solid.radius;
        Way { out, end, low }
    }

    /// The furthest place of a disc in a unit direction, from the centre of the border's disc.
    fn reach(&self, disc: &FlatDisc, out: &Vector) -> f64 {
        let rise = disc.normal.dot(out);
        out.dot(&(disc.centre - self.border.centre)) + disc.radius * (1.0 - rise * rise).max(0.0).sqrt()
    }

    /// Returns `true` if a contact across the sheet is deeper than this.
    fn is_deeper(&self, than: f64, found: &CandidateBlocks) -> bool {
        let is_behind = |near: &Near| found.is_behind(near.candidate);
        let has_front = self.discs.iter().any(|near| !is_behind(near));
        self.discs.iter().filter(|near| !has_front || !is_behind(near)).any(|near| {
            let own = (near.i, found.sign(near.candidate));
            let place = || {
                let place = place_at(self.elements, self.solid, own.0, own.1)?;
                let is_open = self.sides.are_open(self.elements, own.0);
                let other = is_open.then(|| from_behind(self.elements, self.solid, own, &place)).flatten();
                other.unwrap_or(Some(place))
            };
            found.most(near.candidate) > than && place().is_some_and(|place| place.depth > than)
        })
    }

    /// The direction from the nearest disc to the core. `None` if the core reaches through the sheet, or to
    /// behind a disc.
    fn apart(&self, way: &Way) -> Option<Vector> {
        let mut nearest = (f64::INFINITY, Vector::zeros());
        for Near { disc, .. } in self.discs {
            let Some(gap) = disc_gap(self.solid, disc, self.most(disc)) else { continue };
            let apart = gap.on_core - gap.on_disc;
            if gap.distance <= PRECISION * disc.radius || apart.dot(&way.out) < -ACROSS * gap.distance {
                return None;
            }
            if gap.distance < nearest.0 {
                nearest = (gap.distance, apart / gap.distance);
            }
        }
        Some(nearest.1)
    }

    /// The place of a shape that moves out along `way`, at a disc.
    fn past(&self, disc: &FlatDisc, way: &Way) -> Option<Place> {
        let depth = self.reach(disc, &way.out) - way.low;
        let point = disc.centre + disc.rim(&way.out);
        let least = -self.elements.margin.max(disc.thickness());
        (depth >= least).then_some(Place { point, normal: way.out, depth })
    }

    /// The place of a shape whose core is before the end of the sheet, at a disc: along the way between their
    /// nearest points. `None` if that does not lead out, or if the disc is within the sheet and the shape
    /// does not touch it.
    fn beside(&self, disc: &FlatDisc, way: &Way, is_inner: bool) -> Option<Place> {
        let gap = disc_gap(self.solid, disc, self.most(disc))?;
        let normal = (gap.on_core - gap.on_disc).try_normalize(PRECISION * disc.radius)?;
        let depth = self.solid.radius - gap.distance;
        let least = if is_inner { -disc.thickness() } else { f64::NEG_INFINITY };
        (normal.dot(&way.out) > 0.0 && depth >= least).then_some(Place { point: gap.on_disc, normal, depth })
    }

    /// The distance within which the core counts.
    fn most(&self, disc: &FlatDisc) -> f64 {
        self.solid.radius + self.elements.margin.max(disc.thickness())
    }
}
