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
use crate::solid::place::{PRECISION, Place, disc_gap, place_at};
use crate::solid::touch::touch;

type Vector = Vector3<f64>;

/// The greatest number of sheets whose ends are looked at.
const SHEETS: u32 = 8;

/// The least cosine of the normals of two discs of a sheet.
const SAME: f64 = 0.7;

/// The greatest distance of a disc from the plane of another one of the sheet, in local radii.
const LEVEL: f32 = 1.0;

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

/// Reusable memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct SheetEnds {
    discs: Vec<Near>,
    places: Vec<(Candidate, usize, Place)>,
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
    /// A disc at the border, with its local radius.
    border: FlatDisc,
    band: f64,
    discs: &'s [Near],
}

/// The furthest disc of a sheet in each of some directions along it.
type Outermost = [FlatDisc; DIRECTIONS as usize];

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
    /// How far the shape must move to be past the end.
    fn length(&self) -> f64 {
        self.end - self.low
    }
}

impl SheetEnds {
    /// The places at which `solid` moves out past the ends of sheets, with their candidates and points.
    /// O(n) for n candidates, and nothing if none of them is at a border.
    pub(crate) fn places<'s>(
        &'s mut self,
        elements: &Elements<'_>,
        solid: &Solid<'_>,
        level: Level,
        (found, scratch): (&mut CandidateBlocks, &mut ViewScratch),
    ) -> &'s [(Candidate, usize, Place)] {
        self.places.clear();
        for _ in 0..SHEETS {
            let Some(border) = found.first_border() else { break };
            self.leave(elements, solid, (level, scratch), (found, border));
        }
        &self.places
    }

    /// Adds the places of the sheet to which a point at a border belongs, if the shape moves out past its end.
    fn leave(
        &mut self,
        elements: &Elements<'_>,
        solid: &Solid<'_>,
        (level, scratch): (Level, &mut ViewScratch),
        (found, border): (&mut CandidateBlocks, Candidate),
    ) {
        let i = found.point(border);
        let local = elements.arrays.radii[i];
        let (at, normal, band) = (elements.position(i), elements.normal(i), f64::from(local));
        let slab = Slab {
            at: single(&at),
            normal: single(&normal),
            within: local * LEVEL,
            inside: single(&solid.inside),
        };
        let [most, beside_sq] = found.mark_slab(level, &slab);
        let beside = beside_sq.max(0.0).sqrt();
        // A way past the end, up to 45° steep, is longer than the inner radius less the way to the nearest disc.
        let height = (normal.dot(&(solid.inside - at))).abs();
        let least = solid.inner_radius() - FRAC_1_SQRT_2 * (height + f64::from(beside));
        if beside < OVER * local && f64::from(most) <= least {
            return;
        }
        self.discs.clear();
        self.discs.extend(found.in_slab().filter_map(|candidate| {
            let i = found.point(candidate);
            let Element::Disc(disc) = elements.element(i) else { return None };
            (disc.normal.dot(&normal).abs() >= SAME).then_some(Near { candidate, i, disc })
        }));
        let border = FlatDisc { centre: at, normal, radius: f64::from(elements.arrays.discs.get(i)) };
        let sheet = Sheet { elements, solid, border, band, discs: &self.discs };
        let bare = elements.without_witness().within(0.0);
        let mut ends = |way: &Way| {
            let ball = Solid::ball((sheet.before(way), BALL * band));
            let answer = touch(&bare, ball.as_ref(), None, (level, scratch));
            !answer.verdict.is_touching()
        };
        let Some((along, outermost)) = sheet.shortest_along(&mut ends) else { return };
        let is_beyond = along.out.dot(&(solid.inside - at)) > along.end;
        let way = sheet.shortest_about(&along, &outermost, TURNS);
        let way = if ends(&way) { way } else { sheet.shortest_about(&along, &outermost, 0) };
        let is_shorter = sheet.is_deeper(way.length(), found);
        if !is_shorter && !is_beyond {
            return;
        }
        let crosses = is_shorter && sheet.discs.iter().any(|near| sheet.crosses(&near.disc, &way));
        for &Near { candidate, i, disc } in sheet.discs {
            let place = if crosses { sheet.past(&disc, &way) } else { sheet.beside(&disc, &way) };
            self.places.extend(place.map(|place| (candidate, i, place)));
        }
    }
}

impl Sheet<'_> {
    /// The shortest way past an end along the sheet, and the furthest discs in directions along the sheet.
    /// `None` if the sheet does not end near the shape.
    fn shortest_along(&self, ends: &mut impl FnMut(&Way) -> bool) -> Option<(Way, Outermost)> {
        let normal = self.border.normal;
        let first = normal.cross(&Vector::ith(normal.iamin(), 1.0)).normalize();
        let second = normal.cross(&first);
        let step = TAU / f64::from(DIRECTIONS);
        let towards = |k: u32| {
            let (sin, cos) = (step * f64::from(k)).sin_cos();
            first * cos + second * sin
        };
        let mut ways = [None; DIRECTIONS as usize];
        let mut outermost = [self.border; DIRECTIONS as usize];
        for (k, (way, disc)) in (0_u32..).zip(ways.iter_mut().zip(&mut outermost)) {
            *disc = self.furthest(&towards(k));
            *way = Some(self.way([&*disc], towards(k)));
        }
        for _ in 0..TRIES {
            let left = ways.iter().copied().flatten();
            let shortest: Way = left.min_by(|a, b| a.length().total_cmp(&b.length()))?;
            let way = self.nearby(&outermost, shortest, &[normal], step);
            if ends(&way) {
                return Some((way, outermost));
            }
            for other in &mut ways {
                *other = other.filter(|other| other.out.dot(&shortest.out) < ALIKE);
            }
        }
        None
    }

    /// The shortest way past the end that is at most [`STEEP`] to the sheet, and up to `turns` steps to either
    /// side of that along the sheet.
    fn shortest_about(&self, along: &Way, outermost: &Outermost, turns: i32) -> Way {
        let normal = self.border.normal;
        let across = normal.cross(&along.out);
        let step = STEEP / f64::from(RISES);
        let angles = |steps: i32| (-steps..=steps).map(move |k| step * f64::from(k));
        let outs = angles(turns).flat_map(|turn| {
            let turned = along.out * turn.cos() + across * turn.sin();
            angles(RISES).map(move |rise| turned * rise.cos() + normal * rise.sin())
        });
        let ways = outs.map(|out| self.way(outermost, out));
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
                    let way = self.way(discs, turned.normalize());
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

    /// How far a disc reaches in a unit direction, from the centre of the border's disc.
    fn reach(&self, disc: &FlatDisc, out: &Vector) -> f64 {
        let rise = disc.normal.dot(out);
        out.dot(&(disc.centre - self.border.centre)) + disc.radius * (1.0 - rise * rise).max(0.0).sqrt()
    }

    /// Returns `true` if a contact across the sheet is deeper than this.
    fn is_deeper(&self, than: f64, found: &CandidateBlocks) -> bool {
        self.discs.iter().any(|near| {
            let most = || place_at(self.elements, self.solid, near.i, found.sign(near.candidate));
            found.most(near.candidate) > than && most().is_some_and(|place| place.depth > than)
        })
    }

    /// Returns `true` if the core reaches through the sheet at a disc, or to behind the disc.
    fn crosses(&self, disc: &FlatDisc, way: &Way) -> bool {
        let gap = self.solid.gap(disc, f64::INFINITY);
        let apart = gap.on_core - gap.on_disc;
        gap.distance <= PRECISION * disc.radius || apart.dot(&way.out) < -ACROSS * gap.distance
    }

    /// The place of a shape that moves out along `way`, at a disc.
    fn past(&self, disc: &FlatDisc, way: &Way) -> Option<Place> {
        let depth = self.reach(disc, &way.out) - way.low;
        let point = disc.centre + disc.rim(&way.out);
        (depth >= -self.elements.margin).then_some(Place { point, normal: way.out, depth })
    }

    /// The place of a shape whose core is before the end of the sheet, at a disc: along the way between their
    /// nearest points. `None` if that does not lead out.
    fn beside(&self, disc: &FlatDisc, way: &Way) -> Option<Place> {
        let radius = self.solid.radius;
        let gap = disc_gap(self.solid, disc, radius + self.elements.margin.max(disc.thickness()))?;
        let normal = (gap.on_core - gap.on_disc).try_normalize(PRECISION * disc.radius)?;
        (normal.dot(&way.out) > 0.0).then_some(Place {
            point: gap.on_disc,
            normal,
            depth: radius - gap.distance,
        })
    }
}
