//! The contact manifold of a shape and a scan: up to eight points, each with a normal and a depth.
//!
//! Each disc that the shape touches can give one contact, the deepest place of the shape over the disc.
//! Each ball can give one along the way from its centre.

use fearless_simd::Level;
use nearmiss_hierarchy::PointKind;

use crate::ask::options::Detail;
use crate::pair::placed::ViewScratch;
use crate::solid::answer::ShapeContact;
use crate::solid::candidates::CandidateBlocks;
use crate::solid::core::Solid;
use crate::solid::descent::Near;
use crate::solid::elements::Elements;
use crate::solid::ends::SheetEnds;
use crate::solid::gather::Gather;
use crate::solid::hint::{MOST, ShapeHint};
use crate::solid::probe::is_far;
use crate::solid::refine::refine;
use crate::solid::selection::{Met, Selected, Selection};
use crate::solid::sides::Sides;

/// Evaluations that move the deepest contact over the surface.
const SLIDES: u32 = 3;

/// Reusable memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Candidates {
    found: CandidateBlocks,
    selected: Selected,
    ends: SheetEnds,
}

/// Writes the manifold of `solid` and the scan to `out`.
pub(crate) fn contacts(
    elements: &Elements<'_>,
    solid: Option<&Solid<'_>>,
    hint: Option<&mut ShapeHint>,
    out: &mut Vec<ShapeContact>,
    (level, scratch, candidates): (Level, &mut ViewScratch, &mut Candidates),
) {
    out.clear();
    let (mut points, mut bands, mut at_ends) = ([0; MOST], [0.0; MOST], [false; MOST]);
    if let Some(solid) = solid {
        let sides = Sides::new(elements, solid, hint.as_deref());
        let Candidates { found, selected, ends } = candidates;
        found.clear();
        selected.places.clear();
        // About a longer core the clearance of the centre rarely tells more than the list of boxes.
        if !(solid.is_point() && is_far(elements, solid, (elements.margin, false))) {
            let mut near = Near::new(elements, solid, false, &mut scratch.corners);
            near.limit(elements.margin);
            let search = &mut Gather { near, sides: &sides, found: &mut *found };
            // The search never ends early.
            let _whole = near.search(level, elements.margin, search);
            found.arrange();
        }
        for &(i, place) in ends.settle(elements, (solid, &sides), level, (found, scratch)) {
            selected.places.push(Met { place, i, is_past_end: true });
        }
        let mut selection = Selection::new((elements, solid, &sides), level, found, selected);
        selection.run(hint.as_deref());
        for (n, met) in selection.taken().enumerate() {
            (points[n], bands[n], at_ends[n]) = (met.i, elements.band(met.i), met.is_past_end);
            out.push(met.contact(elements));
        }
        if elements.detail == Detail::Witness && elements.placed.verifies() {
            for (n, (contact, i)) in out.iter_mut().zip(points).enumerate() {
                let is_within = elements.placed.scan().kind(i) != PointKind::Edge && !at_ends[n];
                if elements.is_disc(i) && is_within {
                    let slides = if n == 0 { SLIDES } else { 0 };
                    refine(elements, (solid, &sides.inside), (i, slides), contact, scratch);
                }
            }
            let deepest = (0..out.len()).max_by(|&a, &b| out[a].depth.total_cmp(&out[b].depth));
            if let Some(deepest) = deepest.filter(|&n| out[n].depth > out[0].depth) {
                out.swap(0, deepest);
                points.swap(0, deepest);
                bands.swap(0, deepest);
            }
        }
    }
    if let Some(hint) = hint {
        hint.number(out, (&points, &bands));
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::nalgebra::Vector3;
    use nearmiss_geometry::{PointCloud, Pose};
    use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
    use rand::RngExt;

    use super::*;
    use crate::ask::options::CollideOptions;
    use crate::leaf::disc_triangle::FlatDisc;
    use crate::pair::placed::Placed;
    use crate::solid::gather::SPREAD;
    use crate::solid::place::{from_behind, place_at};
    use crate::solid::plan::ShapePlan;
    use crate::solid::selection::LEVEL;
    use crate::solid::shape::Shape;

    type Vector = Vector3<f64>;

    /// The places of all discs and balls, before and behind the surface, and those at discs that the shape is
    /// behind of.
    fn all_places(elements: &Elements<'_>, solid: &Solid<'_>) -> [Vec<Met>; 3] {
        let sides = Sides::new(elements, solid, None);
        let mut all = [Vec::new(), Vec::new(), Vec::new()];
        for i in 0..elements.placed.scan().len() {
            let (normal, radius) = (elements.normal(i), f64::from(elements.arrays.discs.get(i)));
            let disc = FlatDisc { centre: elements.position(i), normal, radius };
            let (sign, is_behind) =
                if elements.is_disc(i) { sides.of(&disc, elements.band(i)) } else { (1.0, false) };
            let Some(place) = place_at(elements, solid, i, sign) else { continue };
            let other = from_behind(elements, solid, (i, sign), &place);
            let list = if other.is_some() { 2 } else { usize::from(is_behind) };
            if let Some(place) = other.unwrap_or(Some(place)) {
                all[list].push(Met { place, i, is_past_end: false });
            }
        }
        all
    }

    #[test]
    fn contacts_are_places_far_from_each_other() {
        let mesh = dragon_mesh(Dragon::Points5k).unwrap();
        // A strip of random width, whose borders are not straight.
        let rng = &mut rng(5);
        let strip: Vec<[f64; 3]> = (0..2000)
            .map(|_| {
                let [x, y] = [rng.random_range(0.0..4.0_f64), rng.random_range(-0.5..0.5)];
                [x, y * (0.2 + (3.0 * x).sin().powi(2)), 0.0]
            })
            .collect();
        for (name, points, full) in [("dragon", mesh.vertices(), 600), ("strip", &strip, 100)] {
            let found = compare_with_all_places(name, points);
            assert!(found > full, "{found} full manifolds of {name}");
        }
    }

    /// Compares manifolds on a scan of `points` with all places. Returns the number of full ones.
    fn compare_with_all_places(name: &str, points: &[[f64; 3]]) -> usize {
        let cloud = PointCloud::from_positions(points).unwrap();
        let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
        let r = scan.sampling_radius();
        let rng = &mut rng(77);
        let (mut full, mut past, mut spread) = (0, 0, Vec::new());
        for round in 0..1200 {
            let options = CollideOptions::estimated().with_detail(Detail::Verdict);
            let options = options.with_margin([0.0, 0.3 * r][round % 2]);
            let plan = ShapePlan::new(&options, &scan).unwrap();
            let pose = if round % 3 == 0 { rotation(rng).with_scale(3.0) } else { Pose::IDENTITY };
            let elements = Elements::new(Placed::new(&scan, &pose), &plan);
            let size = r * pose.scale();
            let i = rng.random_range(0..scan.len());
            let at = pose.apply(scan.arrays().position(i).map(f64::from));
            let (off, along) = (point_in(rng, 1.5 * size), unit_vector(rng));
            let centre = [0, 1, 2].map(|k| at[k] + off[k]);
            let end = [0, 1, 2].map(|k| centre[k] + 4.0 * size * along[k]);
            let half = [2.0, 1.0, 0.5].map(|h| h * size);
            let body = rotation(rng).with_translation(centre);
            let shape = match round % 5 {
                0 => Shape::Sphere { centre, radius: [1.0, 0.0, 0.3][round % 3] * size },
                1 => Shape::Capsule { ends: [centre, end], radius: 0.7 * size },
                2 => Shape::Box { pose: body, half, radius: 0.0 },
                3 => Shape::Box { pose: body, half, radius: 0.4 * size },
                _ => Shape::Cylinder { pose: body, half_height: size, radius: size, rounding: 0.0 },
            };
            let solid = Solid::new(&shape, elements.placed.stored_to_world()).unwrap();
            let (mut out, mut candidates) = (Vec::new(), Candidates::default());
            let working = (Level::new(), &mut ViewScratch::default(), &mut candidates);
            contacts(&elements, Some(&solid), None, &mut out, working);
            let [mut front, mut behind, mut turned] = all_places(&elements, &solid);
            for met in candidates.selected.places.iter().filter(|met| met.is_past_end) {
                front.retain(|other| other.i != met.i);
                behind.retain(|other| other.i != met.i);
                turned.retain(|other| other.i != met.i);
                front.push(*met);
                past += 1;
            }
            // Leaves are searched for discs without their thickness at the rim, so others may be missed.
            let is_near = |met: &&Met| {
                let gap = elements.element(met.i).gap(&solid, elements.margin).0;
                gap.distance <= solid.radius + elements.margin
            };
            let all = if front.iter().any(|met| is_near(&met)) { front } else { [front, behind].concat() };
            let near: Vec<Met> = all.iter().filter(is_near).copied().collect();
            if near.is_empty() {
                assert!(out.len() <= all.len().max(1), "{name}, round {round}: {out:?}");
                continue;
            }
            let deepest = near.iter().chain(&turned).max_by(|a, b| a.deeper(b)).unwrap();
            let band = all
                .iter()
                .chain(&turned)
                .find(|met| met.contact(&elements).id == out[0].id)
                .map_or(0.0, |met| elements.band(met.i));
            let least = deepest.contact(&elements).depth - LEVEL * band;
            assert!(out[0].depth >= least, "{name}, round {round}: {:?}, deepest {deepest:?}", out[0]);
            // Only the first contact is at a disc that the shape is behind of.
            let is_turned = turned.iter().any(|met| met.contact(&elements) == out[0]);
            let all = if is_turned { [turned.clone(), all].concat() } else { all };
            let ids: Vec<u64> = all.iter().map(|met| met.contact(&elements).id).collect();
            let own = |contact: &ShapeContact| {
                let n = ids.iter().position(|&id| id == contact.id);
                let n = n.unwrap_or_else(|| panic!("{name}, round {round}: {contact:?} is no place"));
                assert_eq!(all[n].contact(&elements), *contact, "{name}, round {round}");
                all[n]
            };
            let taken: Vec<Met> = out.iter().map(own).collect();
            let free = Free { elements: &elements, near: &near };
            let close = too_close(&elements, &taken);
            assert!(close.is_none(), "{name}, round {round}: {close:?} is too near another contact");
            if taken.len() < MOST {
                let left = free.next(&taken);
                assert!(left.is_none(), "{name}, round {round}: room for {left:?}");
            }
            spread.push([free.gap(&taken), free.gap(&free.one_by_one(taken[0]))]);
            full += usize::from(out.len() == MOST);
        }
        assert!(past > 100, "{past} places past ends of {name}");
        // A round that chooses by centres leaves about the gaps that one by one leaves.
        let [rounds, one_by_one] = [0, 1].map(|k| spread.iter().map(|gaps| gaps[k]).sum::<f64>());
        assert!(rounds <= 1.02 * one_by_one, "{name}: gaps of {rounds}, one by one {one_by_one}");
        full
    }

    /// A contact that is not apart from one before, if there is one.
    fn too_close(elements: &Elements<'_>, taken: &[Met]) -> Option<Met> {
        let is_close = |&n: &usize| {
            let least = f64::from(SPREAD * elements.arrays.radii[taken[n].i]) * (1.0 - 1e-9);
            taken[..n].iter().any(|it| (it.place.point - taken[n].place.point).norm() < least)
        };
        (0..taken.len()).find(is_close).map(|n| taken[n])
    }

    /// Places among which contacts are selected.
    struct Free<'s, 'a> {
        elements: &'s Elements<'a>,
        near: &'s [Met],
    }

    impl Free<'_, '_> {
        /// The place whose disc or ball is furthest, of those that are apart from all contacts.
        fn next(&self, taken: &[Met]) -> Option<Met> {
            let apart = |met: &Met| {
                let centre = self.elements.position(met.i);
                let away =
                    |x: Vector| taken.iter().map(|it| (x - it.place.point).norm()).fold(f64::MAX, f64::min);
                let least = f64::from(SPREAD * self.elements.arrays.radii[met.i]) * (1.0 + 1e-4);
                let [away, of_centre] = [away(met.place.point), away(centre)];
                (away.min(of_centre) > least).then_some((of_centre, *met))
            };
            self.near.iter().filter_map(apart).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, met)| met)
        }

        /// The contacts that are selected one by one.
        fn one_by_one(&self, deepest: Met) -> Vec<Met> {
            let mut taken = vec![deepest];
            while taken.len() < MOST {
                let Some(next) = self.next(&taken) else { break };
                taken.push(next);
            }
            taken
        }

        /// The greatest distance of a place from the nearest contact.
        fn gap(&self, taken: &[Met]) -> f64 {
            let away = |met: &Met| {
                taken.iter().map(|it| (met.place.point - it.place.point).norm()).fold(f64::MAX, f64::min)
            };
            self.near.iter().map(away).fold(0.0, f64::max)
        }
    }
}
