//! Local sampling radii.
//!
//! The spacing of a point is the distance to its K-th nearest neighbour. K grows up to 256 while
//! those neighbours look like a line, as the returns of one LiDAR ring do. Spacings are then
//! smoothed, `r_i := min_j (r_j + 0.3 ‖p_i − p_j‖)`, so that an isolated point cannot affect a
//! dense region. Lines without another beside them and bends in rings are excluded as j, because
//! their distances do not measure the spacing of a surface.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Level, Simd, dispatch};
use nearmiss_index::{BlockTree, Nearest, PointBlock};
use nearmiss_lanes::parallel::{change_both, fill_with, in_order, ranges_with};
use nearmiss_store::{Room, WorkError, Workspace};
use nearmiss_surface::symmetric_eigen;

use crate::tree::topology::Topology;

const WIDTH: usize = PointBlock::WIDTH;

/// The number of neighbours examined first if the first K look like a line; doubled while all of
/// them do.
const LINE_NEIGHBOURS: usize = 32;

/// The maximum number of neighbours. 256 neighbours along a ring suffice to find another ring a
/// hundred spacings away. Sixteen beams 2° apart, with a return every 0.2°, leave such gaps on a
/// floor with a slope of one in ten. A line with no other line that near is a wire, or isolated.
const MOST_NEIGHBOURS: usize = 256;

/// Points look like a line if λ2 < 0.05 λ3, which tolerates noise.
const LINE: f64 = 0.05;

/// The maximum growth of radii per distance. With 0.3 they can double over about three spacings.
pub(crate) const GROWTH: f32 = 0.3;

/// The spacing of a point, and the appearance of its neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Spacing {
    pub(crate) radius: f32,
    /// The distance of the K-th neighbour, which along a ring is less than the radius.
    plain: f32,
    /// The appearance, as a number.
    look: u32,
}

/// The appearance of the neighbours of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub(crate) enum Look {
    /// The first K spread over an area.
    #[default]
    Area = 0,
    /// The first K are on a line, more of them are not: a ring among others.
    Ring = 1,
    /// All examined neighbours are on a line.
    Line = 2,
    /// The first K spread only because a ring bends there or is jagged: most points around see a
    /// ring.
    Bend = 3,
    /// The spacing exceeds the reach of the scan.
    Sparse = 4,
}

impl Spacing {
    fn new(radius: f32, plain: f32, look: Look) -> Self {
        Self { radius, plain, look: look as u32 }
    }

    /// Returns the appearance of the neighbours.
    pub(crate) const fn look(&self) -> Look {
        match self.look {
            1 => Look::Ring,
            2 => Look::Line,
            3 => Look::Bend,
            4 => Look::Sparse,
            _ => Look::Area,
        }
    }
}

/// Returns the spacings of `points`, which must be distinct and those of `tree`.
pub(crate) fn spacings(
    points: &[[f32; 3]],
    tree: &BlockTree<'_>,
    neighbours: usize,
    work: &Workspace,
) -> Result<Room<Spacing>, WorkError> {
    let mut room = work.room(points.len())?;
    let spacings: &mut [Spacing] = &mut room;
    let of_block = |block: usize| block * WIDTH..(block * WIDTH + WIDTH).min(points.len());
    let search = || Search::new(tree, points);
    fill_with(spacings, WIDTH, search, |search, blocks, spacings| {
        for (block, spacings) in blocks.zip(spacings.chunks_mut(WIDTH)) {
            search.start(block);
            let plain = search.plain(neighbours);
            for (spacing, i) in spacings.iter_mut().zip(of_block(block)) {
                *spacing = search.spacing(i, neighbours, plain);
            }
        }
    });
    if spacings.iter().all(|s| s.look() == Look::Area) {
        return Ok(room);
    }
    // A byte can count more votes than are needed.
    let mut votes = work.room::<u8>(points.len())?;
    let counted: &mut [u8] = &mut votes;
    let found = &*spacings;
    let vote = |search: &mut Search<'_>, blocks: Range<usize>| {
        let mut nearby = Vec::new();
        for block in blocks.filter(|&block| found[of_block(block)].iter().any(|s| s.look() != Look::Area)) {
            search.start(block);
            for i in of_block(block).filter(|&i| found[i].look() != Look::Area) {
                search.look(i, neighbours);
                nearby.extend(search.near.iter().map(|&(_, j)| j));
            }
        }
        nearby
    };
    in_order(tree.blocks().len(), search, vote, |nearby| {
        for j in nearby {
            counted[j] = counted[j].saturating_add(1);
        }
    });
    for (spacing, votes) in spacings.iter_mut().zip(counted) {
        if spacing.look() == Look::Area && 2 * usize::from(*votes) >= neighbours {
            spacing.look = Look::Bend as u32;
        }
    }
    Ok(room)
}

/// Returns the spacings of the points of some blocks, sixteen for each, and their radii: smoothed
/// along their first neighbours, whose radii are known, and at most `reach`. The votes of
/// neighbours about bends are left out.
pub(crate) fn spacings_of(
    points: &[[f32; 3]],
    tree: &BlockTree<'_>,
    (neighbours, reach): (usize, f32),
    radii: &[f32],
    blocks: &[u32],
) -> Vec<(Spacing, f32)> {
    // Few blocks at once, as a thread may finish early if there are not many.
    let some = ranges_with(
        blocks.len(),
        4,
        || Search::new(tree, points),
        |search, some| {
            let blocks = &blocks[some];
            let mut found = Vec::with_capacity(blocks.len() * WIDTH);
            for block in blocks {
                let first = *block as usize * WIDTH;
                search.start(*block as usize);
                let plain = search.plain(neighbours);
                for i in first..first + WIDTH {
                    if i >= points.len() {
                        found.push((Spacing::default(), 0.0));
                        continue;
                    }
                    let mut spacing = search.spacing(i, neighbours, plain);
                    let smooth = |least: f32, n: (f64, usize)| least.min(radii[n.1] + GROWTH * length(&n));
                    let mut radius = search.nearest(i, neighbours).fold(spacing.radius, smooth);
                    limit(std::slice::from_mut(&mut spacing), std::slice::from_mut(&mut radius), reach);
                    found.push((spacing, radius));
                }
            }
            found
        },
    );
    some.into_iter().flatten().collect()
}

/// A search for the neighbours of the points of a block.
struct Search<'a> {
    tree: &'a BlockTree<'a>,
    points: &'a [[f32; 3]],
    level: Level,
    block: usize,
    found: Nearest,
    /// The number of neighbours in `found` for each point of the block.
    count: usize,
    /// Squared distance and index of a point itself and its nearest neighbours, by distance, then
    /// index.
    near: Vec<(f64, usize)>,
}

impl<'a> Search<'a> {
    fn new(tree: &'a BlockTree<'a>, points: &'a [[f32; 3]]) -> Self {
        let (found, near) = (Nearest::default(), Vec::new());
        Self { tree, points, level: Level::new(), block: 0, found, count: 0, near }
    }

    /// Continues with another block.
    fn start(&mut self, block: usize) {
        (self.block, self.count) = (block, 0);
    }

    /// Returns the points of the block whose neighbours certainly spread over an area, as bits:
    /// [`Self::spacing`] would give [`Look::Area`]. All points are examined at once.
    fn plain(&mut self, neighbours: usize) -> u64 {
        self.tree.nearest(self.level, self.block, neighbours, &mut self.found);
        self.count = neighbours;
        dispatch!(self.level, simd => simd.vectorize(
            #[inline(always)]
            || self.surely_areas(neighbours)
        ))
    }

    #[inline(always)]
    fn surely_areas(&self, neighbours: usize) -> u64 {
        let own = &self.tree.blocks()[self.block].position;
        let mut sums = [[0.0_f64; WIDTH]; 9];
        let mut plain = u64::MAX;
        for rank in 0..neighbours {
            let mut d = [[0.0_f64; WIDTH]; 3];
            for lane in 0..WIDTH {
                match self.found.ranked(lane, rank) {
                    Some(near) => {
                        let p = self.points[near.id as usize];
                        for k in 0..3 {
                            d[k][lane] = f64::from(p[k] - own[k][lane]);
                        }
                    }
                    None => plain &= !(1 << lane),
                }
            }
            let [x, y, z] = &d;
            for i in 0..WIDTH {
                let (x, y, z) = (x[i], y[i], z[i]);
                let products = [x, y, z, x * x, x * y, x * z, y * y, y * z, z * z];
                for k in 0..9 {
                    sums[k][i] += products[k];
                }
            }
        }
        for lane in 0..WIDTH {
            let mut of = [0.0; 9];
            for k in 0..9 {
                of[k] = sums[k][lane];
            }
            let is_line = Sums { count: neighbours + 1, of }.is_surely_line();
            plain &= !(u64::from(is_line != Some(false)) << lane);
        }
        plain
    }

    /// Returns the spacing of point `i` of the block. Only points that are not `plain` are looked at
    /// singly.
    fn spacing(&mut self, i: usize, neighbours: usize, plain: u64) -> Spacing {
        if plain >> (i % WIDTH) & 1 == 1 { self.area(i, neighbours) } else { self.examine(i, neighbours) }
    }

    /// Returns the spacing of point `i` of the block, whose neighbours spread over an area.
    fn area(&self, i: usize, neighbours: usize) -> Spacing {
        let last = self.found.ranked(i % WIDTH, neighbours - 1);
        let radius = last.map_or(0.0, |last| length(&self.exact(i, last.id as usize)));
        Spacing::new(radius, radius, Look::Area)
    }

    /// Returns the squared distance of points `i` and `j` in double precision, and `j`.
    fn exact(&self, i: usize, j: usize) -> (f64, usize) {
        let d = [0, 1, 2].map(|k| f64::from(self.points[j][k]) - f64::from(self.points[i][k]));
        (d[0] * d[0] + d[1] * d[1] + d[2] * d[2], j)
    }

    /// Fills `near` with point `i` of the block and its nearest `count` neighbours. Those of the
    /// whole block are found at once.
    fn look(&mut self, i: usize, count: usize) {
        if count > self.count {
            self.tree.nearest(self.level, self.block, count, &mut self.found);
            self.count = count;
        }
        let mut near = std::mem::take(&mut self.near);
        near.clear();
        near.push((0.0, i));
        near.extend(self.nearest(i, count));
        self.near = near;
    }

    /// Returns the squared distances and indices of the nearest `count` neighbours of point `i` of the
    /// block, of those that have been found.
    fn nearest(&self, i: usize, count: usize) -> impl Iterator<Item = (f64, usize)> + '_ {
        self.found.of(i % WIDTH).take(count).map(move |n| self.exact(i, n.id as usize))
    }

    /// Returns the spacing of point `i` of the block, examining as many neighbours as needed.
    fn examine(&mut self, i: usize, neighbours: usize) -> Spacing {
        self.look(i, neighbours);
        let radius = self.near.last().map_or(0.0, length);
        let mut sums = Sums::default();
        self.near.iter().for_each(|n| sums.add(self.points, i, n.1));
        if self.near.len() <= neighbours || !sums.is_line() {
            return Spacing::new(radius, radius, Look::Area);
        }
        let mut count = LINE_NEIGHBOURS;
        while sums.count < MOST_NEIGHBOURS {
            let known = self.near.len();
            self.look(i, count);
            for k in known..self.near.len() {
                sums.add(self.points, i, self.near[k].1);
                if !sums.is_line() && sums.lies_across(self.points, &self.near[..=k]) {
                    return Spacing::new(length(&self.near[k]), radius, Look::Ring);
                }
            }
            if self.near.len() <= count {
                break;
            }
            count *= 2;
        }
        Spacing::new(radius, radius, Look::Line)
    }
}

/// Returns the distance of a neighbour, at least 1e-18, whose square is still a normal number in
/// single precision.
#[expect(clippy::cast_possible_truncation, reason = "radii are stored in single precision")]
fn length(near: &(f64, usize)) -> f32 {
    near.0.sqrt().max(1e-18) as f32
}

/// Sums over some points, relative to one of them.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: usize,
    /// x y z xx xy xz yy yz zz.
    of: [f64; 9],
}

impl Sums {
    /// Adds point `i`, relative to point `origin`.
    fn add(&mut self, points: &[[f32; 3]], origin: usize, i: usize) {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(points[i][k] - points[origin][k]));
        for (sum, v) in self.of.iter_mut().zip([x, y, z, x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += v;
        }
        self.count += 1;
    }

    /// Returns the covariance around the mean as xx xy xz yy yz zz.
    #[inline(always)]
    fn covariance(&self) -> [f64; 6] {
        #[expect(clippy::cast_precision_loss, reason = "at most 257")]
        let n = self.count as f64;
        let [x, y, z, xx, xy, xz, yy, yz, zz] = self.of.map(|sum| sum / n);
        [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z]
    }

    /// Returns `true` if a point of `near`, seen from the first, is more across the main direction
    /// than along it. An arc spreads too, but only a neighbouring ring has points to the side.
    fn lies_across(&self, points: &[[f32; 3]], near: &[(f64, usize)]) -> bool {
        let main = symmetric_eigen(self.covariance()).vectors[2];
        let origin = points[near[0].1];
        near.iter().any(|&(d_sq, i)| {
            let along: f64 = (0..3).map(|k| main[k] * f64::from(points[i][k] - origin[k])).sum();
            2.0 * along * along < d_sq
        })
    }

    /// Returns `true` if the points look like a line: the covariance around their mean has λ2 <
    /// 0.05 λ3.
    fn is_line(&self) -> bool {
        self.is_surely_line().unwrap_or_else(|| {
            let [_, l2, l3] = symmetric_eigen(self.covariance()).values;
            l2 < LINE * l3
        })
    }

    /// Returns the same if it can be decided without an eigensolver, as for most neighbourhoods.
    #[inline(always)]
    fn is_surely_line(&self) -> Option<bool> {
        let c = self.covariance();
        // The sum of the principal minors is λ1λ2 + λ3(λ1 + λ2). For a line it is less than (0.05²
        // + 2·0.05) λ3², otherwise at least 0.05/1.05² of the squared trace.
        let minors = c[0] * c[3] - c[1] * c[1] + c[0] * c[5] - c[2] * c[2] + c[3] * c[5] - c[4] * c[4];
        let trace_sq = (c[0] + c[3] + c[5]).powi(2);
        if minors > (LINE * LINE + 2.0 * LINE) * trace_sq * (1.0 + 1e-9) {
            return Some(false);
        }
        (minors < LINE / (1.0 + LINE).powi(2) * trace_sq * (1.0 - 1e-9)).then_some(true)
    }
}

/// Returns `r_i := min_j (r_j + 0.3 ‖p_i − p_j‖)` over i and all j but lines, bends and sparse
/// points.
pub(crate) fn smooth(
    tree: &BlockTree<'_>,
    spacings: &[Spacing],
    work: &Workspace,
) -> Result<Room<f32>, WorkError> {
    // Distances along a line do not measure the spacing of the surface around it.
    let tip = |i: usize| match spacings[i].look() {
        Look::Area | Look::Ring => spacings[i].radius,
        Look::Line | Look::Bend | Look::Sparse => f32::INFINITY,
    };
    let mut tips = work.room(tree.blocks().len())?;
    let (cones, level) = (tree.cones(&mut tips, tip, GROWTH), Level::new());
    let mut radii = work.room(spacings.len())?;
    fill_with(
        &mut radii,
        WIDTH,
        || (),
        |(), blocks, radii| {
            for (block, radii) in blocks.zip(radii.chunks_mut(WIDTH)) {
                let own = &spacings[block * WIDTH..][..radii.len()];
                let mut heights = [0.0; WIDTH];
                for (height, own) in heights.iter_mut().zip(own) {
                    *height = if own.look() == Look::Bend { f32::MAX } else { own.radius };
                }
                let lowest = cones.below(level, block, &heights);
                for ((radius, own), lowest) in radii.iter_mut().zip(own).zip(lowest) {
                    *radius = if lowest < f32::MAX { lowest } else { own.radius };
                }
            }
        },
    );
    Ok(radii)
}

/// Limits `radii`, the smoothed `spacings`, to `reach`. A ring whose next ring is further away
/// becomes a line, with the distance of its K-th neighbour. Any other point with a greater spacing
/// becomes [`Look::Sparse`].
///
/// Minima can be taken in any order, so this equals a limit before smoothing.
pub(crate) fn limit(spacings: &mut [Spacing], radii: &mut [f32], reach: f32) {
    change_both(spacings, radii, 1 << 10, |_, spacing, radius| {
        if spacing.radius > reach {
            if spacing.look() == Look::Ring {
                spacing.look = Look::Line as u32;
                *radius = radius.min(spacing.plain);
            } else if spacing.look() != Look::Line {
                spacing.look = Look::Sparse as u32;
            }
        }
        *radius = radius.min(reach);
    });
}

/// Computes a value for each node, in the order of ids: for leaves from their points, for other
/// nodes from the values of their children.
pub(crate) fn fold_nodes<T: Copy + Default>(
    topology: &Topology,
    leaf: impl Fn(Range<usize>) -> T,
    join: impl Fn(T, T) -> T,
) -> Vec<T> {
    let mut values = vec![T::default(); topology.len()];
    // Children come after their parent.
    for id in topology.ids().rev() {
        values[id.index()] = if topology.is_leaf(id) {
            leaf(topology.points(id))
        } else {
            let children = topology.children(id).iter().map(|child| values[child.index()]);
            children.reduce(&join).unwrap_or_default()
        };
    }
    values
}
