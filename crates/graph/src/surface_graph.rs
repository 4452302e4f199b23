//! The complete graph of a scan: proximity graph, orientation, close pairs and levels.

use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};
use nearmiss_lanes::parallel::both;
use nearmiss_store::{Array, Check, File, Flaw, LoadError, Progress, WriteError, Writer};
use nearmiss_surface::SurfacePlan;
use serde::{Deserialize, Serialize};

use crate::length::distance;
use crate::orient::{Decision, OrientedPart, Sides, orient};
use crate::{
    Adjacency, ClosePairs, GeodesicKernel, GraphCounts, GraphError, GraphMeta, GraphOptions, LazyPath,
    Levels, Network, Paths, PointGraph, edge_lengths,
};

/// Paths over virtual edges may pass through a point if the sum of its distances from both ends is
/// at most this multiple of the distance of the ends.
const NARROW: f32 = 1.5;

/// The progress of a build with close pairs, as shares of its running time: once the points are
/// joined, the normals oriented, the points near each point found, and the map of them stored.
const JOINED: f64 = 0.2;
const ORIENTED: f64 = 0.35;
const SEARCHED: f64 = 0.74;
const MAPPED: f64 = 0.91;

/// The progress of a build without close pairs once the points are joined.
const JOINED_ALONE: f64 = 0.6;

const CONFIDENCE: [u8; 4] = *b"CNFD";
const PARTS: [u8; 4] = *b"PART";

/// The samples of a surface that a graph is built over, in the order of the hierarchy's leaves.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceSamples<'a> {
    /// Options that define the surface.
    pub plan: &'a SurfacePlan,
    /// Positions of the samples.
    pub positions: &'a [[f32; 3]],
    /// Local sampling radii of the samples.
    pub radii: &'a [f32],
}

/// Returns the support radii of samples with these local sampling radii.
fn support_radii(plan: &SurfacePlan, radii: &[f32]) -> Vec<f32> {
    radii.iter().map(|&r| plan.support_radius(r)).collect()
}

/// The proximity graph of a scan, with orientation, geodesic distances and coarser levels.
#[derive(Debug, Clone)]
pub struct SurfaceGraph {
    points: PointGraph,
    confidence: Array<u8>,
    parts: Array<StoredPart>,
    /// Maps of the points, then of the cells of each level; empty, or all of these.
    close_pairs: Vec<ClosePairs>,
    /// Stored with the map of close pairs, otherwise computed at first use.
    levels: OnceLock<Levels>,
    /// Computed at first use, as are the fields below.
    lengths: OnceLock<Vec<f32>>,
    areas: OnceLock<Vec<f64>>,
    bridged: OnceLock<(Adjacency, Vec<f32>)>,
}

/// Metadata of a graph: everything except the arrays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SurfaceGraphMeta {
    points: GraphMeta,
    has_close_pairs: bool,
}

/// An oriented part in its stored form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct StoredPart {
    first: u32,
    points: u32,
    /// Bit 0: 1 if orientable. Higher bits: index in [`DECISIONS`].
    flags: u32,
}

/// All decisions, by their stored number.
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
    /// Builds the graph of `samples` and orients their `normals` along it: consistently, and
    /// outwards as far as the outside is known (see [`orient`]).
    ///
    /// The signs of `normals` may be arbitrary before. Takes O(n log n) time, on all cores with the
    /// feature `rayon`. The result is the same for any number of cores.
    ///
    /// # Errors
    /// Fails if an option is out of range, if a coordinate is not finite or beyond ±1e18, or if
    /// there are too many points or edges.
    ///
    /// # Panics
    /// Panics if the numbers of positions, radii and normals, including those of `sides` if any,
    /// differ.
    pub fn build(
        samples: SurfaceSamples<'_>,
        sides: Sides<'_>,
        normals: &mut [[f32; 3]],
        options: &GraphOptions,
    ) -> Result<Self, GraphError> {
        Self::build_watched(samples, sides, normals, options, &Progress::default())
    }

    /// Like [`Self::build`], and tells `progress` the share of the work that is done.
    ///
    /// # Errors
    /// As [`Self::build`].
    ///
    /// # Panics
    /// As [`Self::build`].
    pub fn build_watched(
        samples: SurfaceSamples<'_>,
        sides: Sides<'_>,
        normals: &mut [[f32; 3]],
        options: &GraphOptions,
        progress: &Progress,
    ) -> Result<Self, GraphError> {
        let [joined, oriented] =
            if options.close_pairs.is_some() { [JOINED, ORIENTED] } else { [JOINED_ALONE, 1.0] };
        let points = PointGraph::build(samples.positions, options)?;
        progress.reach(joined);
        let found = orient(points.edges(), samples.positions, samples.radii, sides, normals);
        let parts: Vec<StoredPart> = found.parts.iter().map(StoredPart::of).collect();
        let graph = Self {
            points,
            confidence: found.confidence.into(),
            parts: parts.into(),
            close_pairs: Vec::new(),
            levels: OnceLock::new(),
            lengths: OnceLock::new(),
            areas: OnceLock::new(),
            bridged: OnceLock::new(),
        };
        progress.reach(oriented);
        Ok(match options.close_pairs {
            None => graph,
            Some(paths) => graph.with_close_pairs(samples, paths, progress),
        })
    }

    fn with_close_pairs(self, samples: SurfaceSamples<'_>, paths: Paths, progress: &Progress) -> Self {
        let network = self.network(samples.positions);
        let map = |network, radii: &[f32], told: &(dyn Fn(f64) + Sync)| {
            ClosePairs::build_watched(network, &support_radii(samples.plan, radii), paths, told)
        };
        let of_points = |share: f64| progress.add((SEARCHED - ORIENTED) * share);
        // Building levels uses one core only.
        let (of_points, levels) = both(
            || map(network, samples.radii, &of_points),
            || self.levels(samples.positions, samples.radii),
        );
        progress.reach(MAPPED);
        let of_cells = levels.cells().iter().map(|cells| map(cells.network(), cells.radii(), &|_| ()));
        let close_pairs = std::iter::once(of_points).chain(of_cells).collect();
        Self { close_pairs, ..self }
    }

    /// Returns the proximity graph.
    #[must_use]
    pub fn points(&self) -> &PointGraph {
        &self.points
    }

    /// Returns the confidence in the sign of each point's normal: 255 for certain, 0 for arbitrary.
    #[must_use]
    pub fn confidence(&self) -> &[u8] {
        &self.confidence
    }

    /// Returns the connected components, by their first points.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = OrientedPart> {
        self.parts.iter().map(|part| part.part())
    }

    /// Returns the map of close pairs, if it was requested.
    #[must_use]
    pub fn close_pairs(&self) -> Option<&ClosePairs> {
        self.close_pairs.first()
    }

    /// Returns the map of close pairs of cells; `level` 0 is the finest of [`Self::levels`].
    /// Support radii grow with the cells. `None` if there is no such level or no map.
    #[must_use]
    pub fn close_cells(&self, level: usize) -> Option<&ClosePairs> {
        self.close_pairs.get(level.checked_add(1)?)
    }

    /// Returns coarser graphs over subsets of the points. They are stored with a map of close
    /// pairs. Otherwise they are computed at first use, in about a second for a million points.
    ///
    /// # Panics
    /// Panics if the number of positions or of radii differs from the number of points.
    #[must_use]
    pub fn levels(&self, positions: &[[f32; 3]], radii: &[f32]) -> &Levels {
        self.levels.get_or_init(|| Levels::build(self.network(positions), radii))
    }

    /// Returns the edges with their lengths, for searches. The lengths are computed at first use.
    #[must_use]
    pub fn network(&self, positions: &[[f32; 3]]) -> Network<'_> {
        let lengths = self.lengths.get_or_init(|| edge_lengths(self.points.edges(), positions));
        Network::new(self.points.edges(), lengths)
    }

    /// Returns the edges and virtual edges, which bridge small holes (Klein & Zachmann 2005, §4.5),
    /// with their lengths. They are computed at first use.
    #[must_use]
    pub fn bridged_network(&self, positions: &[[f32; 3]]) -> Network<'_> {
        let (graph, lengths) = self.bridged.get_or_init(|| {
            let graph = self.points.edges().union(self.points.virtual_edges());
            let lengths = edge_lengths(&graph, positions);
            (graph, lengths)
        });
        Network::new(graph, lengths)
    }

    /// Returns the prefix sums of the points' areas in units of π, for drawing points by area: a 0,
    /// then for each point the sum up to and including it.
    ///
    /// The area of a point is the square of its local sampling radius. Computed at first use; takes
    /// eight bytes a point.
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

    /// Computes everything that searches along the graph otherwise compute at first use: lengths,
    /// [areas](Self::areas), [bridges](Self::bridged_network) and [levels](Self::levels). Takes
    /// O(e log e) time for e edges. The first search is then as fast as later ones.
    pub fn make_ready(&self, samples: SurfaceSamples<'_>) {
        let _ = self.levels(samples.positions, samples.radii);
        let _ = self.bridged_network(samples.positions);
        let _ = self.areas(samples.radii);
    }

    /// Sets `path` to a path along the surface between `ends`, as [`LazyPath::lead`] does. Returns
    /// `false`, and clears `path`, if the ends are not connected.
    ///
    /// # Panics
    /// Panics if an end is not a point, or if the number of positions or of radii differs from the
    /// number of points.
    pub fn lead(&self, positions: &[[f32; 3]], radii: &[f32], ends: [u32; 2], path: &mut LazyPath) -> bool {
        path.lead(self.levels(positions, radii), self.network(positions), positions, ends)
    }

    /// Sets `path` to a shortest path from `a` to `b` that may use virtual edges but stays near
    /// both ends. At each of its points, the sum of the distances from the ends is at most 1.5
    /// times the distance of the ends.
    ///
    /// For points that are near each other with a hole between them (Klein & Zachmann 2005, §4.5).
    /// The time is proportional to the number of points in that region. Returns `false`, and clears
    /// `path`, if there is no such path.
    /// # Panics
    /// Panics if an end is not a point, or if the number of positions differs from the number of
    /// points.
    pub fn lead_across(&self, positions: &[[f32; 3]], [a, b]: [u32; 2], path: &mut LazyPath) -> bool {
        let place = |i: u32| positions[i as usize];
        let apart = distance(place(a), place(b));
        let near = |i: u32| distance(place(i), place(a)) + distance(place(i), place(b)) <= NARROW * apart;
        path.lead_through(self.bridged_network(positions), [a, b], near)
    }

    /// Returns the geodesic kernel over these samples, if there is a map of close pairs.
    ///
    /// # Panics
    /// Panics if `samples` are not the samples that the graph was built over.
    #[must_use]
    pub fn kernel<'a>(&'a self, samples: SurfaceSamples<'a>) -> Option<GeodesicKernel<'a>> {
        let SurfaceSamples { plan, positions, radii } = samples;
        let pairs = self.close_pairs()?;
        Some(GeodesicKernel::new(plan, positions, radii, self.points.edges(), pairs))
    }

    /// Returns the numbers of points, edges and components.
    #[must_use]
    pub fn counts(&self) -> GraphCounts {
        self.points.counts()
    }

    /// Returns the sizes in bytes of the graph with its orientation, of the maps, and of the
    /// levels.
    #[must_use]
    pub fn byte_lens(&self) -> [usize; 3] {
        let graph = self.points.bytes() + self.confidence.len() + size_of_val::<[_]>(&self.parts);
        [
            graph,
            self.close_pairs.iter().map(ClosePairs::byte_len).sum(),
            self.levels.get().map_or(0, Levels::byte_len),
        ]
    }

    /// Returns the metadata.
    #[must_use]
    pub fn meta(&self) -> SurfaceGraphMeta {
        SurfaceGraphMeta { points: self.points.meta(), has_close_pairs: !self.close_pairs.is_empty() }
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// Fails if the container already has sections of these names.
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

    /// Loads the graph of points with these radii from `file` without copying arrays.
    ///
    /// With either `check`, no method of the graph fails afterwards. [`Check::Full`] also verifies
    /// that arrays agree with each other, lists are ordered and lengths are valid. It cannot verify
    /// that a distance is the shortest, or that a confidence is justified.
    ///
    /// # Errors
    /// Fails if a section is missing, holds values that no build writes, or contradicts another
    /// section.
    pub fn load(
        file: &File,
        meta: SurfaceGraphMeta,
        (plan, radii): (&SurfacePlan, &[f32]),
        check: Check,
    ) -> Result<Self, LoadError> {
        let count = radii.len();
        let points = PointGraph::load(file, meta.points, count, check)?;
        let confidence: Array<u8> = file.array(CONFIDENCE, 0)?;
        Flaw::length("confidences of normals", confidence.len(), count)?;
        let parts: Array<StoredPart> = file.array(PARTS, 0)?;
        let is_sound = |part: &StoredPart| {
            let known = part.flags as usize >> 1 < DECISIONS.len();
            known && points.components().get(part.first as usize) == Some(&part.first)
        };
        if let Some(index) = parts.iter().position(|part| !is_sound(part)) {
            return Err(Flaw::Value { what: "the orientation of part", index }.into());
        }
        if check == Check::Full {
            check_parts(&parts, points.components())?;
        }
        let (mut close_pairs, mut levels) = (Vec::new(), OnceLock::new());
        if meta.has_close_pairs {
            let stored = Levels::load(file, count, check)?;
            let radii = std::iter::once(radii).chain(stored.cells().iter().map(|cells| cells.radii()));
            let map = |(part, radii): (u32, &[f32])| {
                ClosePairs::load(file, part, (radii.len(), |i| plan.support_radius(radii[i])), check)
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

/// Checks that there is one part for each component, in order and with the right number of points.
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
    if found == expected { Ok(()) } else { Err(Flaw::Length { array: "parts", found, expected }) }
}
