//! All that a scan keeps of its graph.

use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};
use nearmiss_lanes::parallel::both;
use nearmiss_store::{Array, Check, File, Flaw, LoadError, WriteError, Writer};
use nearmiss_surface::SurfacePlan;
use serde::{Deserialize, Serialize};

use crate::length::distance;
use crate::orient::{Decision, OrientedPart, Sides, orient};
use crate::{
    Adjacency, ClosePairs, GeodesicKernel, GraphCounts, GraphError, GraphMeta, GraphOptions, LazyPath,
    Levels, Network, Paths, PointGraph, edge_lengths,
};

/// Ways over virtual edges stay where the sum of the distances from both ends is at most so many times their
/// distance.
const NARROW: f32 = 1.5;

const CONFIDENCE: [u8; 4] = *b"CNFD";
const PARTS: [u8; 4] = *b"PART";

/// The samples of a surface that a graph is made of, in the order of the hierarchy's leaves.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    /// What defines the surface.
    pub plan: &'a SurfacePlan,
    /// Where they are.
    pub positions: &'a [[f32; 3]],
    /// Their local sampling radii.
    pub radii: &'a [f32],
}

/// How far samples of these radii are heard.
fn horizons(plan: &SurfacePlan, radii: &[f32]) -> Vec<f32> {
    radii.iter().map(|&r| plan.horizon(r)).collect()
}

/// Who is whose neighbour on a surface, which side of it is out, and how far it is along it.
#[derive(Debug, Clone)]
pub struct SurfaceGraph {
    points: PointGraph,
    confidence: Array<u8>,
    parts: Array<StoredPart>,
    /// Of the points, then of the cells of each level; none, or all.
    close_pairs: Vec<ClosePairs>,
    /// There and stored with the map of close pairs, or made when first wanted.
    levels: OnceLock<Levels>,
    /// Made when first wanted.
    lengths: OnceLock<Vec<f32>>,
    areas: OnceLock<Vec<f64>>,
    bridged: OnceLock<(Adjacency, Vec<f32>)>,
}

/// What is stored of a graph beside arrays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SurfaceGraphMeta {
    points: GraphMeta,
    has_close_pairs: bool,
}

/// A part as it is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct StoredPart {
    first: u32,
    points: u32,
    /// 1 if orientable, and twice the number of the decision.
    flags: u32,
}

/// By number.
const DECISIONS: [Decision; 4] =
    [Decision::Normals, Decision::Scanner, Decision::Volume, Decision::Convention];

impl StoredPart {
    fn of(part: &OrientedPart) -> Self {
        let decision = (0..).zip(DECISIONS).find_map(|(i, d)| (d == part.decision).then_some(i)).unwrap_or(3);
        Self { first: part.first, points: part.points, flags: u32::from(part.orientable) | decision << 1 }
    }

    fn part(self) -> OrientedPart {
        let decision = DECISIONS.get(self.flags as usize >> 1).copied().unwrap_or(Decision::Convention);
        OrientedPart { first: self.first, points: self.points, orientable: self.flags & 1 != 0, decision }
    }
}

impl SurfaceGraph {
    /// The graph of `samples`, whose `normals`, of any sign, are turned so that they agree along it, and
    /// outwards as far as that can be told (see [`orient`]). O(n log n), on all cores with the feature
    /// `rayon`; the same on any number of them.
    ///
    /// # Errors
    /// When an option is out of range, a coordinate is no number that can be squared, or there is too much to
    /// number.
    ///
    /// # Panics
    /// When there is not a radius and a normal for each point, and one of its own if `sides` has these.
    pub fn build(
        samples: Samples<'_>,
        sides: Sides<'_>,
        normals: &mut [[f32; 3]],
        options: &GraphOptions,
    ) -> Result<Self, GraphError> {
        let points = PointGraph::build(samples.positions, options)?;
        let oriented = orient(points.edges(), samples.positions, samples.radii, sides, normals);
        let parts: Vec<StoredPart> = oriented.parts.iter().map(StoredPart::of).collect();
        let graph = Self {
            points,
            confidence: oriented.confidence.into(),
            parts: parts.into(),
            close_pairs: Vec::new(),
            levels: OnceLock::new(),
            lengths: OnceLock::new(),
            areas: OnceLock::new(),
            bridged: OnceLock::new(),
        };
        Ok(match options.close_pairs {
            None => graph,
            Some(paths) => graph.with_close_pairs(samples, paths),
        })
    }

    fn with_close_pairs(self, samples: Samples<'_>, paths: Paths) -> Self {
        let network = self.network(samples.positions);
        let map = |network, radii: &[f32]| ClosePairs::build(network, &horizons(samples.plan, radii), paths);
        // Levels are made on one core.
        let (of_points, levels) =
            both(|| map(network, samples.radii), || self.levels(samples.positions, samples.radii));
        let of_cells = levels.cells().iter().map(|cells| map(cells.network(), cells.radii()));
        let close_pairs = std::iter::once(of_points).chain(of_cells).collect();
        Self { close_pairs, ..self }
    }

    /// Who is joined to whom.
    #[must_use]
    pub fn points(&self) -> &PointGraph {
        &self.points
    }

    /// For each point 255 where the side of its normal is certain, 0 where it might as well be the other.
    #[must_use]
    pub fn confidence(&self) -> &[u8] {
        &self.confidence
    }

    /// The parts that edges connect, by their first points.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = OrientedPart> {
        self.parts.iter().map(|part| part.part())
    }

    /// The map of close pairs, if it was asked for.
    #[must_use]
    pub fn close_pairs(&self) -> Option<&ClosePairs> {
        self.close_pairs.first()
    }

    /// The map of close pairs of the cells of a level, from 0 for the finest of [`Self::levels`], whose reach
    /// grows with the cells; `None` where there is no such level, or no map.
    #[must_use]
    pub fn close_cells(&self, level: usize) -> Option<&ClosePairs> {
        self.close_pairs.get(level.checked_add(1)?)
    }

    /// Coarser graphs over ever fewer of the points. With a map of close pairs they are there; without they
    /// are made when first wanted, some second for a million points.
    ///
    /// # Panics
    /// When there is not a position and a radius for each point.
    #[must_use]
    pub fn levels(&self, positions: &[[f32; 3]], radii: &[f32]) -> &Levels {
        self.levels.get_or_init(|| Levels::build(self.network(positions), radii))
    }

    /// The edges with their lengths, for searches; these are made when first wanted.
    #[must_use]
    pub fn network(&self, positions: &[[f32; 3]]) -> Network<'_> {
        let lengths = self.lengths.get_or_init(|| edge_lengths(self.points.edges(), positions));
        Network::new(self.points.edges(), lengths)
    }

    /// The edges with the virtual ones, which bridge small holes (S1 §4.5), and their lengths; made when
    /// first wanted.
    #[must_use]
    pub fn bridged_network(&self, positions: &[[f32; 3]]) -> Network<'_> {
        let (graph, lengths) = self.bridged.get_or_init(|| {
            let graph = self.points.edges().union(self.points.virtual_edges());
            let lengths = edge_lengths(&graph, positions);
            (graph, lengths)
        });
        Network::new(graph, lengths)
    }

    /// For each point the areas of all before it, in units of π, and last that of all, for drawing points by
    /// area: one stands for the square of its local sampling radius. Made when first wanted, eight bytes a
    /// point.
    #[must_use]
    pub fn areas(&self, radii: &[f32]) -> &[f64] {
        self.areas.get_or_init(|| {
            let mut sum = 0.0;
            let areas = radii.iter().map(|&r| {
                let before = sum;
                sum += f64::from(r) * f64::from(r);
                before
            });
            let mut areas: Vec<f64> = areas.collect();
            areas.push(sum);
            areas
        })
    }

    /// Makes what searches along the graph make when they first want it: lengths, [areas](Self::areas),
    /// [bridges](Self::bridged_network) and [levels](Self::levels). O(e log e) for e edges. For those who
    /// want the first search to be as fast as the next.
    pub fn make_ready(&self, samples: Samples<'_>) {
        let _ = self.levels(samples.positions, samples.radii);
        let _ = self.bridged_network(samples.positions);
        let _ = self.areas(samples.radii);
    }

    /// Makes `path` one from `a` to `b` along the surface, as [`LazyPath::lead`] does. False, with no path,
    /// where none leads there.
    ///
    /// # Panics
    /// When there is no such point, or not a position and a radius for each.
    pub fn lead(&self, positions: &[[f32; 3]], radii: &[f32], ends: [u32; 2], path: &mut LazyPath) -> bool {
        path.lead(self.levels(positions, radii), self.network(positions), positions, ends)
    }

    /// Makes `path` a shortest one from `a` to `b` over virtual edges too, as far as it stays near both: the
    /// sum of the distances from them no more than half as much again as their own. For points that are near
    /// each other, with a hole between (S1 §4.5). Takes time by the number of points there.
    ///
    /// # Panics
    /// When there is no such point, or not a position for each.
    pub fn lead_across(&self, positions: &[[f32; 3]], [a, b]: [u32; 2], path: &mut LazyPath) -> bool {
        let place = |i: u32| positions[i as usize];
        let apart = distance(place(a), place(b));
        let near = |i: u32| distance(place(i), place(a)) + distance(place(i), place(b)) <= NARROW * apart;
        path.lead_through(self.bridged_network(positions), [a, b], near)
    }

    /// The geodesic kernel over these samples, if there is a map of close pairs.
    ///
    /// # Panics
    /// When these are not the samples that the graph is of.
    #[must_use]
    pub fn kernel<'a>(&'a self, samples: Samples<'a>) -> Option<GeodesicKernel<'a>> {
        let Samples { plan, positions, radii } = samples;
        let pairs = self.close_pairs()?;
        Some(GeodesicKernel::new(plan, positions, radii, self.points.edges(), pairs))
    }

    /// How many there are of what.
    #[must_use]
    pub fn counts(&self) -> GraphCounts {
        self.points.counts()
    }

    /// Bytes of all its arrays: of the graph with its orientation, of the maps, and of the levels.
    #[must_use]
    pub fn byte_lens(&self) -> [usize; 3] {
        let graph = self.points.bytes() + self.confidence.len() + size_of_val::<[_]>(&self.parts);
        [
            graph,
            self.close_pairs.iter().map(ClosePairs::byte_len).sum(),
            self.levels.get().map_or(0, Levels::byte_len),
        ]
    }

    /// What is stored beside the arrays.
    #[must_use]
    pub fn meta(&self) -> SurfaceGraphMeta {
        SurfaceGraphMeta { points: self.points.meta(), has_close_pairs: !self.close_pairs.is_empty() }
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// When the container has sections of these names already.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        self.points.add_to(writer)?;
        writer.section(CONFIDENCE, 0, &self.confidence)?.section(PARTS, 0, &self.parts)?;
        for (part, pairs) in (0..).zip(&self.close_pairs) {
            pairs.add_to(writer, part)?;
        }
        match self.levels.get() {
            Some(levels) if !self.close_pairs.is_empty() => levels.add_to(writer),
            _ => Ok(()),
        }
    }

    /// The graph in `file` of points with these radii, its arrays in place. With either `check` no use of it
    /// fails. With [`Check::Full`] arrays also agree with each other, lists are in order and lengths are
    /// lengths; whether a distance is the shortest there is, or a confidence deserved, only a build could
    /// tell.
    ///
    /// # Errors
    /// When a section is missing, holds what no build writes, or the sections contradict each other.
    pub fn load(
        file: &File,
        meta: SurfaceGraphMeta,
        (plan, radii): (&SurfacePlan, &[f32]),
        check: Check,
    ) -> Result<Self, LoadError> {
        let count = radii.len();
        let points = PointGraph::load(file, meta.points, count, check)?;
        let confidence: Array<u8> = file.array(CONFIDENCE, 0)?;
        Flaw::length("the confidence of normals", confidence.len(), count)?;
        let parts: Array<StoredPart> = file.array(PARTS, 0)?;
        let is_sound = |part: &StoredPart| {
            let known = part.flags as usize >> 1 < DECISIONS.len();
            known && points.components().get(part.first as usize) == Some(&part.first)
        };
        if let Some(index) = parts.iter().position(|part| !is_sound(part)) {
            return Err(Flaw::Value { what: "the side of part", index }.into());
        }
        if check == Check::Full {
            check_parts(&parts, points.components())?;
        }
        let (mut close_pairs, mut levels) = (Vec::new(), OnceLock::new());
        if meta.has_close_pairs {
            let stored = Levels::load(file, count, check)?;
            let radii = std::iter::once(radii).chain(stored.cells().iter().map(|cells| cells.radii()));
            let map = |(part, radii): (u32, &[f32])| {
                ClosePairs::load(file, part, (radii.len(), |i| plan.horizon(radii[i])), check)
            };
            close_pairs = (0..).zip(radii).map(map).collect::<Result<_, _>>()?;
            levels = stored.into();
        }
        Ok(Self {
            points,
            confidence,
            parts,
            close_pairs,
            levels,
            lengths: OnceLock::new(),
            areas: OnceLock::new(),
            bridged: OnceLock::new(),
        })
    }
}

/// Checks that there is a part for each component, in order, with as many points.
fn check_parts(parts: &[StoredPart], components: &[u32]) -> Result<(), Flaw> {
    let mut sizes = vec![0_u32; components.len()];
    for &first in components {
        sizes[first as usize] += 1;
    }
    let expected = (0_u32..).zip(&sizes).filter(|(_, size)| **size > 0);
    let differs =
        |(part, (first, &points)): (&StoredPart, (u32, &u32))| [part.first, part.points] != [first, points];
    if let Some(index) = parts.iter().zip(expected.clone()).position(differs) {
        return Err(Flaw::Value { what: "part", index });
    }
    let (found, expected) = (parts.len(), expected.count());
    if found == expected { Ok(()) } else { Err(Flaw::Length { array: "the list of parts", found, expected }) }
}
