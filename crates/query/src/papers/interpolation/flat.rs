//! Interpolation search without hierarchy: brackets among drawn points of a, and a search along the
//! path of each.

use std::ops::ControlFlow;

use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_graph::{LazyPath, SurfaceGraph};
use nearmiss_hierarchy::NodePair;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::root::{GraphPath, Root, Slope, find_root};
use super::sides::Side;
use super::survey::Bounds;
use super::volume::Volume;
use crate::ask::answer::{Contact, Reason};
use crate::ask::interpolation::{Brackets, Interpolation, SurfelSize};
use crate::leaf::crossing::crossing;
use crate::leaf::disc_pair::FAR;
use crate::papers::Papers;
use crate::papers::random::{FLAT, below, stream};

/// Draws per point inside the box of b before drawing stops.
const DRAWS: u32 = 8;

/// The limit of steps from nearest point to nearest point.
const STEPS: u32 = 32;

/// The limit of evaluations along an edge.
const LOOKS: u32 = 8;

/// Partners tried per drawn point in a list of the close-pairs map. About 30 points are within the
/// support radius.
const OF_THE_ANNULUS: u32 = 4;

/// A path this many times as long as the distance of its ends is a detour.
const DETOUR: f64 = 4.0;

/// Virtual edges join only points at most this many sampling radii apart, so the holes that they
/// bridge are small.
const NARROW: f32 = 32.0;

/// A path has arrived when it is this near b, in b's local sampling radii.
const ARRIVED: f64 = 0.1;

/// A point counts as on b if |f| is at most this many of b's local sampling radii.
const ZERO: f64 = 0.25;

/// The greatest distance of a contact from the tangent planes of both nearest points, in their
/// local sampling radii. Edges cut bends short, and points are noisy.
const OFF: f64 = 0.5;

/// The state of a search.
struct Ways<'a> {
    search: &'a Interpolation,
    graph: &'a SurfaceGraph,
    path: LazyPath,
    rng: Xoshiro256PlusPlus,
}

/// Two points of a and their sides of b.
#[derive(Debug, Clone, Copy)]
struct Bracket {
    points: [u32; 2],
    sides: [Side; 2],
}

fn id(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

impl Papers<'_, '_> {
    /// Draws points of a in the box of b and searches for intersections between points on different
    /// sides of b.
    pub(crate) fn interpolate_all(&mut self, search: &Interpolation) -> ControlFlow<()> {
        // No volumes are compared here, so nothing is proven.
        self.search.compared.push(NodePair { a: NodeId::ROOT, b: NodeId::ROOT });
        let [va, _] = self.search.pair.views;
        let Some(graph) = va.graph() else {
            self.search.doubt = Some(Reason::NoGraph);
            return ControlFlow::Continue(());
        };
        let mut volume = std::mem::take(&mut self.scratch.interpolation.volume);
        let path = std::mem::take(&mut self.scratch.interpolation.path);
        let mut ways = Ways { search, graph, path, rng: stream(search.seed, FLAT) };
        let flow = self.draw_and_search(&mut volume, &mut ways);
        (self.scratch.interpolation.volume, self.scratch.interpolation.path) = (volume, ways.path);
        flow
    }

    fn draw_and_search(&mut self, volume: &mut Volume, ways: &mut Ways<'_>) -> ControlFlow<()> {
        let search = ways.search;
        let bounds = self.bounds_of_b();
        let areas = ways.graph.areas(self.search.pair.a.radii);
        self.survey(areas, volume)?;
        if volume.count == 0 {
            return ControlFlow::Continue(());
        }
        let surfels = match search.surfels {
            SurfelSize::Count(count) => f64::from(count),
            SurfelSize::Radius(radii) => {
                let radius = radii * f64::from(self.search.pair.a.sampling_radius);
                (volume.area / (radius * radius)).max(1.0)
            }
        };
        // More surfels than points are meaningless: no two points are nearer to each other than
        // neighbours.
        let surfels = surfels.min(f64::from(volume.count));
        let wanted = search.draws(surfels);
        #[expect(clippy::cast_possible_truncation, reason = "a length in single precision")]
        let reach = 2.0 * (volume.area / surfels).sqrt() as f32;
        self.scratch.interpolation.crossed.clear();
        self.scratch.interpolation.drawn.begin(wanted.min(volume.count), reach);
        self.search.pair.meter.spent.leaf_pairs += 1;
        if volume.count <= wanted {
            for i in volume.points() {
                self.try_drawn(i, &bounds, ways)?;
            }
        } else {
            let (mut left, mut draws) = (wanted, DRAWS.saturating_mul(wanted));
            while left > 0 && draws > 0 {
                draws -= 1;
                let Some(i) = volume.draw(areas, &mut ways.rng) else { break };
                left -= u32::from(self.try_drawn(i, &bounds, ways)?);
            }
        }
        if self.search.found.is_none() {
            self.draw_all_near(search.approaches as usize, reach, ways.graph)
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Processes a drawn point. Returns `false` if it is outside the box of b.
    fn try_drawn(&mut self, i: u32, bounds: &Bounds, ways: &mut Ways<'_>) -> ControlFlow<(), bool> {
        self.search.pair.meter.leaf_work(1);
        self.search.pair.meter.go_on()?;
        let place = self.search.pair.a.position(i as usize);
        if !bounds.holds(place) {
            return ControlFlow::Continue(false);
        }
        // Drawn points are anywhere, so none is a hint for the next.
        let side = self.side_again(i, 0);
        self.estimate = self.estimate.min(side.distance.abs());
        let partner = match ways.search.brackets {
            Brackets::Drawn => None,
            Brackets::Annulus => self.partner_around(i, &side, ways)?,
        };
        let drawn = &mut self.scratch.interpolation.drawn;
        let partner = partner.or_else(|| drawn.partner(place, &side).map(|other| (other.point, other.side)));
        drawn.add(i, place, side);
        if let Some((other, other_side)) = partner.filter(|(other, _)| *other != i) {
            let bracket = Bracket { points: [i, other], sides: [side, other_side] };
            self.search_between(&bracket, ways)?;
        }
        ControlFlow::Continue(true)
    }

    /// Tries a few points about two surfel radii from `i` along the surface, as far as the map of
    /// close pairs reaches. Returns the first on the other side of b. These points are a part of
    /// the annulus of Klein & Zachmann 2005, §4.3.
    fn partner_around(
        &mut self,
        i: u32,
        side: &Side,
        ways: &mut Ways<'_>,
    ) -> ControlFlow<(), Option<(u32, Side)>> {
        let Some(pairs) = ways.graph.close_pairs() else { return ControlFlow::Continue(None) };
        let reach = self.scratch.interpolation.drawn.reach();
        // The list is sorted by distance; the outer half has most of the points.
        let list = pairs.of(i as usize).take_while(|close| close.distance <= reach);
        let outer = list.filter(|close| close.distance >= 0.5 * reach).map(|close| close.point);
        let annulus = &mut self.scratch.interpolation.annulus;
        annulus.clear();
        annulus.extend(outer);
        let count = annulus.len();
        for _ in 0..OF_THE_ANNULUS.min(id(count)) {
            self.search.pair.meter.go_on()?;
            let other = self.scratch.interpolation.annulus[below(&mut ways.rng, count)];
            let found = self.side(other, side.near);
            if side.is_opposite(&found) {
                return ControlFlow::Continue(Some((other, found)));
            }
        }
        ControlFlow::Continue(None)
    }

    /// Searches for an intersection on the path between two points on different sides.
    fn search_between(&mut self, bracket: &Bracket, ways: &mut Ways<'_>) -> ControlFlow<()> {
        let (positions, radii) = (self.search.pair.views[0].scan().positions(), self.search.pair.a.radii);
        let Ways { search, graph, path, .. } = ways;
        let tries = self.search.tries;
        let mut length = f64::INFINITY;
        if graph.lead(positions, radii, bracket.points, path) {
            length = path.length();
            self.search_along(path, bracket, graph, search)?;
        }
        let [p, q] = bracket.points.map(|i| Vector3::from(positions[i as usize]));
        let apart = (p - q).norm();
        let is_near = apart <= NARROW * self.search.pair.a.sampling_radius;
        if self.search.tries == tries
            && is_near
            && length > DETOUR * f64::from(apart)
            && graph.points().virtual_edges().edge_count() > 0
            && graph.lead_across(positions, bracket.points, path)
        {
            return self.search_along(path, bracket, graph, search);
        }
        ControlFlow::Continue(())
    }

    fn search_along(
        &mut self,
        path: &mut LazyPath,
        bracket: &Bracket,
        graph: &SurfaceGraph,
        search: &Interpolation,
    ) -> ControlFlow<()> {
        let [first, last] = bracket.sides;
        let mut hint = if first.away < last.away { first.near } else { last.near };
        let arrived = ARRIVED * f64::from(self.search.pair.b.radii[hint as usize]) * self.scale_of_b();
        let nearer = usize::from(last.distance.abs() < first.distance.abs());
        let slope = self.slope(bracket.points[nearer], &bracket.sides[nearer]);
        let (positions, radii) = (self.search.pair.views[0].scan().positions(), self.search.pair.a.radii);
        let mut along = GraphPath { path, levels: graph.levels(positions, radii), positions, slope };
        let root = find_root(&mut along, [first.distance, last.distance], arrived, |along, k| {
            if self.search.pair.meter.go_on().is_break() {
                return None;
            }
            let point = along.path.point(k).point;
            let side = self.side_again(point, hint);
            hint = side.near;
            along.slope = self.slope(point, &side);
            Some(side.known())
        });
        let point = |k: usize| path.point(k).point;
        match root {
            None => ControlFlow::Break(()),
            Some(Root::Point(k) | Root::Undefined(k)) => {
                let (i, x) = (point(k), self.search.pair.views[0].point(point(k) as usize));
                let side = self.side_at(x, hint);
                self.meets_at(i, x, &side, search)
            }
            Some(Root::Edge { first, values }) => {
                let ends = [point(first).min(point(first + 1)), point(first).max(point(first + 1))];
                let Err(place) = self.scratch.interpolation.crossed.binary_search(&ends) else {
                    // Another bracket led to the same edge.
                    self.search.tries += 1;
                    return ControlFlow::Continue(());
                };
                self.scratch.interpolation.crossed.insert(place, ends);
                self.search_edge([point(first), point(first + 1)], values, hint, search)
            }
        }
    }

    /// The distance from b, to first order about a point of a, in a's stored frame.
    fn slope(&self, i: u32, side: &Side) -> Slope {
        let (place, j) = (self.search.pair.a.position(i as usize), side.near as usize);
        let normal = self.search.pair.relative.direction(self.search.pair.b.normals[j]);
        // Far from b, the distance is that from b's nearest point.
        let is_far = side.distance.abs() >= side.away && side.away > 0.0;
        let from = Vector3::from(place)
            - Vector3::from(self.search.pair.relative.point(self.search.pair.b.position(j)));
        let outwards = if side.distance < 0.0 { -from } else { from };
        let gradient = outwards.try_normalize(0.0).filter(|_| is_far).map_or(normal, Into::into);
        Slope { place, value: side.distance / self.search.pair.views[0].stored_to_world().scale(), gradient }
    }

    /// The scale from b's stored frame to the world.
    pub(crate) fn scale_of_b(&self) -> f64 {
        self.search.pair.views[1].stored_to_world().scale()
    }

    /// Searches for an intersection on the edge between two points of a with these signed distances
    /// from b.
    pub(super) fn search_edge(
        &mut self,
        ends: [u32; 2],
        values: [f64; 2],
        hint: u32,
        search: &Interpolation,
    ) -> ControlFlow<()> {
        let [va, _] = self.search.pair.views;
        let [p, q] = ends.map(|i| Vector3::from(va.point(i as usize)));
        let ([mut from, mut to], [mut at_from, mut at_to]) = ([0.0, 1.0], values);
        let mut looks = 0;
        // Klein & Zachmann 2005, §4.6 adds the signed distances here, but their sum vanishes for a
        // good bracket.
        let (share, x, side) = loop {
            self.search.pair.meter.go_on()?;
            let share = if looks % 3 == 2 { 0.5 } else { at_from.abs() / (at_from.abs() + at_to.abs()) };
            let share = from + (to - from) * if share.is_finite() { share } else { 0.5 };
            let x = p + share * (q - p);
            let side = self.side_at(x.into(), hint);
            looks += 1;
            let arrived =
                ARRIVED * f64::from(self.search.pair.b.radii[side.near as usize]) * self.scale_of_b();
            if side.distance.abs() <= arrived || looks == LOOKS || !side.is_known {
                break (share, x, side);
            }
            if (side.distance < 0.0) == (values[0] < 0.0) {
                (from, at_from) = (share, side.distance);
            } else {
                (to, at_to) = (share, side.distance);
            }
        };
        let i = if share <= 0.5 { ends[0] } else { ends[1] };
        self.meets_at(i, x.into(), &side, search)
    }

    /// Handles a point on the surface of a, near its point `i`, that should be on b as well: a
    /// contact if it is.
    fn meets_at(&mut self, i: u32, x: [f64; 3], side: &Side, search: &Interpolation) -> ControlFlow<()> {
        let [va, vb] = self.search.pair.views;
        let nearest =
            va.scan().nearest_point_within(i as usize, va.stored_to_world().apply_inverse(x), f64::INFINITY);
        self.search.pair.meter.spent.neighbour_steps += u64::from(nearest.1);
        let (i, j) = (nearest.0 as usize, side.near as usize);
        let radii = [
            f64::from(self.search.pair.a.radii[i]) * va.stored_to_world().scale(),
            f64::from(self.search.pair.b.radii[j]) * self.scale_of_b(),
        ];
        let normals = [
            va.stored_to_world().rotate(self.search.pair.a.normals[i].map(f64::from)),
            vb.stored_to_world().rotate(self.search.pair.b.normals[j].map(f64::from)),
        ];
        let from = [va.point(i), vb.point(j)].map(|p| Vector3::from(x) - Vector3::from(p));
        // Edges of a cross gaps and lead from sheet to sheet. The side also changes where b ends,
        // but there are no samples there, and f vanishes between two sheets of b.
        let far = f64::from(FAR) * radii[0].max(radii[1]);
        let off = [0, 1].map(|k: usize| Vector3::from(normals[k]).dot(&from[k]).abs());
        let is_off = [0, 1].into_iter().any(|k: usize| from[k].norm() > far || off[k] > OFF * radii[k]);
        if is_off || side.distance.abs() > ZERO * radii[1] {
            return ControlFlow::Continue(());
        }
        if let Some(reason) = self.search.pair.doubt_about(i, j) {
            self.search.doubt.get_or_insert(reason);
            return ControlFlow::Continue(());
        }
        let contact = Contact {
            point: x,
            normals: Some(normals),
            residual: off[0].max(side.distance.abs()),
            sources: [va.scan().id(i), vb.scan().id(j)],
        };
        self.hit_by(search, contact, i, j)
    }

    /// Moves the drawn points that are near b towards it, from nearest point to nearest point,
    /// until the discs there cross or the distance stops shrinking.
    fn draw_all_near(&mut self, most: usize, reach: f32, graph: &SurfaceGraph) -> ControlFlow<()> {
        let reach = f64::from(reach) * self.search.pair.views[0].stored_to_world().scale();
        let mut near = std::mem::take(&mut self.scratch.interpolation.near);
        near.clear();
        let drawn = self.scratch.interpolation.drawn.points().iter();
        near.extend(
            drawn
                .filter(|drawn| drawn.side.away <= reach)
                .map(|drawn| (drawn.side.away, drawn.point, drawn.side.near)),
        );
        near.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        // Points may have been drawn twice.
        near.dedup_by_key(|near| near.1);
        near.truncate(most);
        self.scratch.interpolation.seen.clear();
        let mut flow = ControlFlow::Continue(());
        for &(_, i, j) in &near {
            flow = self.draw_near(i, j, graph);
            if flow.is_break() || self.search.found.is_some() {
                break;
            }
        }
        self.scratch.interpolation.near = near;
        flow
    }

    fn draw_near(&mut self, mut i: u32, mut j: u32, graph: &SurfaceGraph) -> ControlFlow<()> {
        let [va, vb] = self.search.pair.views;
        for _ in 0..STEPS {
            self.search.pair.meter.go_on()?;
            let towards = |view: &crate::pair::placed::Placed<'_>, own: u32, x: [f64; 3]| {
                view.scan().nearest_point_within(
                    own as usize,
                    view.stored_to_world().apply_inverse(x),
                    f64::INFINITY,
                )
            };
            let (next, steps_a) = towards(va, i, vb.point(j as usize));
            let (other, steps_b) = towards(vb, j, va.point(next as usize));
            let steps = u64::from(steps_a) + u64::from(steps_b);
            self.search.pair.meter.spent.neighbour_steps += steps;
            self.search.pair.meter.leaf_work(steps);
            let is_there = (next, other) == (i, j);
            (i, j) = (next, other);
            if self.scratch.interpolation.seen.contains(&[i, j]) {
                return ControlFlow::Continue(());
            }
            if is_there {
                break;
            }
        }
        self.scratch.interpolation.seen.push([i, j]);
        let away = (Vector3::from(va.point(i as usize)) - Vector3::from(vb.point(j as usize))).norm();
        self.estimate = self.estimate.min(away);
        // Compare the discs of these points and of their neighbours.
        let about_a = std::iter::once(i).chain(graph.points().edges().of(i as usize).iter().copied());
        for i in about_a {
            let disc = self.search.pair.disc_a(i as usize);
            let of_b = vb.graph().map_or(&[][..], |graph| graph.points().edges().of(j as usize));
            for j in std::iter::once(j).chain(of_b.iter().copied()) {
                let (distance, [ra, rb]) = self.search.pair.points(i as usize, j as usize);
                if distance > FAR * ra.max(rb) || !crossing(&disc, &self.search.pair.disc_b(j as usize)) {
                    continue;
                }
                match self.search.pair.doubt_about(i as usize, j as usize) {
                    Some(reason) => _ = self.search.doubt.get_or_insert(reason),
                    None => return self.search.crossed(i as usize, j as usize),
                }
            }
        }
        ControlFlow::Continue(())
    }
}
