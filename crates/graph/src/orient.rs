//! Which side is out: one sign for each normal, so that neighbours agree.
//!
//! As in Hoppe et al. 1992, a spanning tree of the edges along which normals agree best carries the sign from point to
//! point. We differ twice.
//!
//! They hold normals to agree that are parallel, which fails at sharp edges and through thin plates. Ours mirror each
//! other in the plane half way between the points, as two normals of one circle do, of a sphere, a plane, of both sides
//! of a ridge, a groove or a plate: with e the direction of the edge, n' is held against n − 2 (n·e) e.
//!
//! And their tree lets one edge decide between two sides of a doubtful place. Only along smooth sheets do we grow it
//! edge by edge (Kruskal's algorithm); the patches that this leaves are joined by what all edges between two of them
//! say together, each patch to the one that it is surest of, until no edge is left. `benches` (`geodesics`) counts what
//! comes out wrong.

use crate::Adjacency;
use crate::parallel::ranges;

/// Steps of agreement that are told apart; edges of one step are taken in the order of their points.
const STEPS: u16 = 1024;

/// Normals that agree like this lie on one smooth sheet. If a ring of such edges still turns a normal round, the sheet
/// has one side only.
const SMOOTH: f32 = 0.95;

/// Which side is out, where something says so.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sides<'a> {
    /// Normals that the scan came with, one a point; zero or NaN where it had none.
    pub normals: Option<&'a [[f32; 3]]>,
    /// Where the scanner stood: normals point there.
    pub scanner: Option<[f32; 3]>,
}

/// What decided the side of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Decision {
    /// The greater part of the scan's own normals.
    Normals,
    /// The greater part faces the scanner.
    Scanner,
    /// The volume it encloses is positive.
    Volume,
    /// Nothing: the sum of the normals has a positive component of largest magnitude.
    Convention,
}

/// Points that edges connect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedPart {
    /// The least index of a point.
    pub first: u32,
    /// Number of points.
    pub points: u32,
    /// Whether it has two sides: no ring of edges between normals that nearly agree turns a normal round.
    pub orientable: bool,
    /// What decided which is out.
    pub decision: Decision,
}

/// How well normals could be oriented.
#[derive(Debug, Clone, PartialEq)]
pub struct Orientation {
    /// For each point 255 where its sign is certain, 0 where it might as well be the other: the lesser of the agreement
    /// of its edges, those against it taken off, and of the doubt in the least certain step by which its sign came from
    /// the greater part.
    pub confidence: Vec<u8>,
    /// The connected parts, by their first points.
    pub parts: Vec<OrientedPart>,
}

/// Whether two normals agree as they are, how well, and how well along the surface, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Agreement {
    same: bool,
    strength: f32,
    along: f32,
}

#[inline]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// How the normals `m` at `p` and `n` at `q` agree.
#[inline]
fn agreement(p: [f32; 3], m: [f32; 3], q: [f32; 3], n: [f32; 3]) -> Agreement {
    let e = sub(q, p);
    let square = dot(e, e);
    let (me, ne) = (dot(m, e), dot(n, e));
    let mirrored = dot(m, n) - 2.0 * me * ne / square;
    let off = (me * me).max(ne * ne) / square;
    // Points in one place, or normals that are none, say nothing.
    let strength = if mirrored.abs() > 0.0 { mirrored.abs().min(1.0) } else { 0.0 };
    let along = if off < 1.0 { strength * (1.0 - off) } else { 0.0 };
    Agreement { same: mirrored >= 0.0, strength, along }
}

/// Turns `normals` so that neighbours in `graph` agree, and outwards where that can be told: by what `sides` says,
/// where the greater part of a component follows it, else so that the component encloses a positive volume about its
/// centre, each point standing for the square of its local sampling radius. What the signs are beforehand does not
/// matter but where all of that says nothing.
///
/// O(e log e) in the number of edges, of which only those in doubt are sorted, in part on all cores; the result does
/// not depend on how many there are.
///
/// # Panics
/// When there is not a position, a normal and a radius for each point, and a normal of its own if `sides` has these.
pub fn orient(
    graph: &Adjacency,
    positions: &[[f32; 3]],
    radii: &[f32],
    sides: Sides<'_>,
    normals: &mut [[f32; 3]],
) -> Orientation {
    let count = graph.len();
    let lengths = [positions.len(), radii.len(), normals.len(), sides.normals.map_or(count, <[_]>::len)];
    assert_eq!(lengths, [count; 4], "one of each a point");
    let mut tree = Tree::new(count);
    let edges = strongest_first(graph, positions, normals);
    let (smooth, rest) = edges.split_at(edges.partition_point(|edge| edge.along() >= SMOOTH));
    smooth.iter().for_each(|&edge| tree.join(edge));
    tree.join_by_votes(rest);
    let roots: Vec<Signed> = (0..id(count)).map(|i| tree.root(i)).collect();
    let out = outwards(&roots, positions, radii, sides, normals);
    for (normal, (root, out)) in normals.iter_mut().zip(roots.iter().zip(&out.turned)) {
        if root.turned != *out {
            *normal = normal.map(|c| -c);
        }
    }
    let confidence = confidences(graph, positions, normals, &tree);
    let mut parts = out.parts;
    for part in &mut parts {
        part.orientable = !tree.twisted[roots[part.first as usize].point as usize];
    }
    Orientation { confidence, parts }
}

#[expect(clippy::cast_possible_truncation, reason = "graphs have fewer than 2³² points")]
fn id(i: usize) -> u32 {
    i as u32
}

/// Two points, and how their normals agree.
#[derive(Debug, Clone, Copy, Default)]
struct Edge {
    ends: [u32; 2],
    /// The step of how well normals agree, and one bit for opposite ones.
    strength: u16,
    /// [`STEPS`] − 1 − the step of how well they agree along the surface.
    weakness: u16,
}

impl Edge {
    fn new(ends: [u32; 2], found: Agreement) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to STEPS − 1")]
        let step = |share: f32| (share * f32::from(STEPS - 1)) as u16;
        let strength = step(found.strength) << 1 | u16::from(!found.same);
        Self { ends, strength, weakness: STEPS - 1 - step(found.along) }
    }

    fn opposite(self) -> bool {
        self.strength & 1 != 0
    }

    fn along(self) -> f32 {
        f32::from(STEPS - 1 - self.weakness) / f32::from(STEPS - 1)
    }

    fn strength(self) -> f32 {
        f32::from(self.strength >> 1) / f32::from(STEPS - 1)
    }
}

/// All edges, the best agreement first; of equal steps by their points.
fn strongest_first(graph: &Adjacency, positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<Edge> {
    let stretches = ranges(graph.len(), |points| {
        let mut edges = Vec::new();
        let mut counts = vec![0_u32; usize::from(STEPS)];
        for i in points {
            let (p, m) = (positions[i], normals[i]);
            for &j in graph.of(i).iter().filter(|&&j| i < j as usize) {
                let edge = Edge::new([id(i), j], agreement(p, m, positions[j as usize], normals[j as usize]));
                counts[usize::from(edge.weakness)] += 1;
                edges.push(edge);
            }
        }
        (edges, counts)
    });
    let mut next = vec![0_usize; usize::from(STEPS)];
    let mut total = 0;
    for (step, next) in next.iter_mut().enumerate() {
        *next = total;
        total += stretches.iter().map(|(_, counts)| counts[step] as usize).sum::<usize>();
    }
    let mut sorted = vec![Edge::default(); total];
    for edge in stretches.into_iter().flat_map(|(edges, _)| edges) {
        let to = &mut next[usize::from(edge.weakness)];
        sorted[*to] = edge;
        *to += 1;
    }
    sorted
}

/// A point, and whether the normal of another is turned relative to its own.
#[derive(Debug, Clone, Copy)]
struct Signed {
    point: u32,
    turned: bool,
}

/// What the edges between two sets say together.
#[derive(Debug, Clone, Copy)]
struct Votes {
    sets: [u32; 2],
    /// Squares of the strengths of the edges between normals that agree, less those of the others.
    same: f64,
    all: f64,
}

/// Sets of points that edges have joined. Each has a root, to which signs are relative.
struct Tree {
    /// Towards the root.
    above: Vec<Signed>,
    /// Of a root the size of its set.
    size: Vec<u32>,
    /// How a root lost its place: the root it was joined to, and how certain the sign was.
    joined: Vec<(u32, f32)>,
    /// Of a root: whether a ring of strong edges turns normals round.
    twisted: Vec<bool>,
}

impl Tree {
    fn new(count: usize) -> Self {
        Self {
            above: (0..id(count)).map(|point| Signed { point, turned: false }).collect(),
            size: vec![1; count],
            joined: (0..id(count)).map(|point| (point, 1.0)).collect(),
            twisted: vec![false; count],
        }
    }

    /// The root of the set of `point`, and its sign relative to that.
    fn root(&mut self, mut point: u32) -> Signed {
        let mut turned = false;
        loop {
            let up = self.above[point as usize];
            if up.point == point {
                return Signed { point, turned };
            }
            let further = self.above[up.point as usize];
            let jump = Signed { point: further.point, turned: up.turned != further.turned };
            self.above[point as usize] = jump;
            turned ^= jump.turned;
            point = jump.point;
        }
    }

    fn join(&mut self, edge: Edge) {
        let [a, b] = edge.ends.map(|end| self.root(end));
        let turned = a.turned ^ b.turned ^ edge.opposite();
        if a.point == b.point {
            self.twisted[a.point as usize] |= turned;
        } else {
            self.link(a, b, turned, edge.along());
        }
    }

    /// Joins sets by what all `edges` between two of them say together, the clearest first.
    fn join_by_votes(&mut self, edges: &[Edge]) {
        let mut votes: Vec<Votes> = edges
            .iter()
            .map(|edge| {
                let strength = f64::from(edge.strength());
                Votes {
                    sets: edge.ends,
                    same: if edge.opposite() { -strength } else { strength },
                    all: strength,
                }
            })
            .collect();
        loop {
            votes.retain_mut(|vote| {
                let [a, b] = vote.sets.map(|set| self.root(set));
                vote.sets = [a.point.min(b.point), a.point.max(b.point)];
                vote.same = if a.turned == b.turned { vote.same } else { -vote.same };
                a.point != b.point
            });
            if votes.is_empty() {
                return;
            }
            // Stable, so that sums are taken in one order.
            votes.sort_by_key(|vote| vote.sets);
            votes.dedup_by(|next, sum| {
                let is_same = next.sets == sum.sets;
                if is_same {
                    sum.same += next.same;
                    sum.all += next.all;
                }
                is_same
            });
            // Each set with the one it is surest of.
            let mut clearest: Vec<(u32, usize)> = Vec::with_capacity(2 * votes.len());
            clearest.extend(votes.iter().enumerate().flat_map(|(k, vote)| vote.sets.map(|set| (set, k))));
            clearest.sort_by(|a, b| {
                a.0.cmp(&b.0)
                    .then(votes[b.1].same.abs().total_cmp(&votes[a.1].same.abs()))
                    .then(a.1.cmp(&b.1))
            });
            clearest.dedup_by_key(|(set, _)| *set);
            clearest
                .sort_by(|a, b| votes[b.1].same.abs().total_cmp(&votes[a.1].same.abs()).then(a.1.cmp(&b.1)));
            for (_, k) in clearest {
                let vote = votes[k];
                let [a, b] = vote.sets.map(|set| self.root(set));
                if a.point != b.point {
                    let turned = a.turned ^ b.turned ^ (vote.same < 0.0);
                    #[expect(clippy::cast_possible_truncation, reason = "a share")]
                    let clear = if vote.all > 0.0 { (vote.same.abs() / vote.all) as f32 } else { 0.0 };
                    self.link(a, b, turned, clear);
                }
            }
        }
    }

    fn link(&mut self, a: Signed, b: Signed, turned: bool, strength: f32) {
        let greater = (self.size[a.point as usize], b.point) >= (self.size[b.point as usize], a.point);
        let (root, leaf) = if greater { (a.point, b.point) } else { (b.point, a.point) };
        self.above[leaf as usize] = Signed { point: root, turned };
        self.size[root as usize] += self.size[leaf as usize];
        self.joined[leaf as usize] = (root, strength);
        self.twisted[root as usize] |= self.twisted[leaf as usize];
    }

    /// The least certain step by which the sign of `point` came from the greater part.
    fn weakest(&self, mut point: u32) -> f32 {
        let mut weakest = 1.0_f32;
        loop {
            let (up, strength) = self.joined[point as usize];
            if up == point {
                return weakest;
            }
            weakest = weakest.min(strength);
            point = up;
        }
    }
}

/// What speaks for the normals of a part as they are relative to its root.
#[derive(Debug, Clone, Copy, Default)]
struct Evidence {
    first: u32,
    points: u32,
    normals: f64,
    scanner: f64,
    volume: f64,
    /// The greatest that the volume could be, were every normal to point away from the centre.
    extent: f64,
    /// Sums for the centre, and of the normals.
    area: f64,
    position: [f64; 3],
    normal: [f64; 3],
}

impl Evidence {
    /// Volumes beyond this share of what they could be are no accident: a plate a hundred times as wide as it is thick
    /// has one of 0.013, flat noise on a sheet has none.
    const VOLUME: f64 = 1e-3;

    /// What decides, and whether normals have to be turned.
    fn decide(&self) -> (Decision, bool) {
        if self.normals.abs() > 0.0 {
            return (Decision::Normals, self.normals < 0.0);
        }
        if self.scanner.abs() > 0.0 {
            return (Decision::Scanner, self.scanner < 0.0);
        }
        if self.volume.abs() > Self::VOLUME * self.extent {
            return (Decision::Volume, self.volume < 0.0);
        }
        let largest = self.normal.into_iter().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        (Decision::Convention, largest < 0.0)
    }
}

/// The parts, and for each point whether its part is to be turned.
struct Outwards {
    parts: Vec<OrientedPart>,
    turned: Vec<bool>,
}

fn outwards(
    roots: &[Signed],
    positions: &[[f32; 3]],
    radii: &[f32],
    sides: Sides<'_>,
    normals: &[[f32; 3]],
) -> Outwards {
    let mut part_of = vec![u32::MAX; roots.len()];
    let mut evidence: Vec<Evidence> = Vec::new();
    for (i, root) in roots.iter().enumerate() {
        let part = &mut part_of[root.point as usize];
        if *part == u32::MAX {
            *part = id(evidence.len());
            evidence.push(Evidence { first: id(i), ..Evidence::default() });
        }
        let sums = &mut evidence[*part as usize];
        let sign = if root.turned { -1.0 } else { 1.0 };
        let area = f64::from(radii[i]).powi(2);
        sums.points += 1;
        sums.area += area;
        for k in 0..3 {
            sums.position[k] += area * f64::from(positions[i][k]);
            sums.normal[k] += sign * f64::from(normals[i][k]);
        }
        let vote = |with: [f32; 3]| match dot(normals[i], with) {
            d if d > 0.0 => sign,
            d if d < 0.0 => -sign,
            _ => 0.0,
        };
        sums.normals += sides.normals.map_or(0.0, |given| vote(given[i]));
        sums.scanner += sides.scanner.map_or(0.0, |scanner| vote(sub(scanner, positions[i])));
    }
    for (i, root) in roots.iter().enumerate() {
        let sums = &mut evidence[part_of[root.point as usize] as usize];
        let area = f64::from(radii[i]).powi(2);
        let away = [0, 1, 2].map(|k| f64::from(positions[i][k]) - sums.position[k] / sums.area);
        let height: f64 = (0..3).map(|k| away[k] * f64::from(normals[i][k])).sum();
        sums.volume += if root.turned { -area * height } else { area * height };
        sums.extent += area * away.iter().map(|c| c * c).sum::<f64>().sqrt();
    }
    let decided: Vec<(Decision, bool)> = evidence.iter().map(Evidence::decide).collect();
    let parts = evidence.iter().zip(&decided).map(|(sums, &(decision, _))| OrientedPart {
        first: sums.first,
        points: sums.points,
        orientable: true,
        decision,
    });
    let turned = roots.iter().map(|root| decided[part_of[root.point as usize] as usize].1);
    Outwards { parts: parts.collect(), turned: turned.collect() }
}

fn confidences(graph: &Adjacency, positions: &[[f32; 3]], normals: &[[f32; 3]], tree: &Tree) -> Vec<u8> {
    let stretches = ranges(graph.len(), |points| {
        let confidence = |i: usize| {
            let (mut votes, mut all) = (0.0, 0.0);
            for &j in graph.of(i) {
                let j = j as usize;
                let found = agreement(positions[i], normals[i], positions[j], normals[j]);
                let weight = found.strength * found.strength;
                votes += if found.same { weight } else { -weight };
                all += weight;
            }
            let share = if all > 0.0 { (votes / all).max(0.0) } else { 0.0 };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
            let byte = (255.0 * share.min(tree.weakest(id(i)))).round() as u8;
            byte
        };
        points.map(confidence).collect::<Vec<u8>>()
    });
    stretches.concat()
}
