//! Patches of smooth sheets, and the choice of their signs by the votes of the edges between them.

use nearmiss_lanes::id32;

use super::agreement::{Edge, Weights};

/// A point, and whether another normal is reversed relative to the normal of that point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Signed {
    pub(super) point: u32,
    pub(super) turned: bool,
}

/// Sum of the votes of the edges between two sets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Votes {
    sets: [u32; 2],
    /// [`Weights`] of edges between agreeing normals, minus those of edges between opposite
    /// normals.
    same: i64,
    all: i64,
}

impl Votes {
    pub(super) fn new(edge: Edge, weights: &Weights) -> Self {
        let same = weights.of(edge);
        Self { sets: edge.ends, same, all: same.abs() }
    }
}

/// Returns the margin of the majority over the minority, from 0 to 1.
#[expect(clippy::cast_precision_loss, reason = "a share")]
fn share(same: i64, all: i64) -> f32 {
    if all > 0 { same.abs() as f32 / all as f32 } else { 0.0 }
}

/// Sets of points joined by edges. Each set has a root, to which signs are relative.
pub(super) struct Tree {
    /// Parent of each point, and the sign relative to it.
    above: Vec<Signed>,
    /// Size of each root's set.
    size: Vec<u32>,
    /// For each former root, the root it was joined to and the certainty of the sign.
    joined: Vec<(u32, f32)>,
    /// For each root, whether a cycle of smooth edges reverses a normal.
    pub(super) twisted: Vec<bool>,
}

impl Tree {
    pub(super) fn new(count: usize) -> Self {
        Self {
            above: (0..id32(count)).map(|point| Signed { point, turned: false }).collect(),
            size: vec![1; count],
            joined: (0..id32(count)).map(|point| (point, 1.0)).collect(),
            twisted: vec![false; count],
        }
    }

    /// Returns the root of the set of `point`, and the sign of `point` relative to it.
    pub(super) fn root(&mut self, mut point: u32) -> Signed {
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

    pub(super) fn join(&mut self, edge: Edge) {
        let [a, b] = edge.ends.map(|end| self.root(end));
        let turned = a.turned ^ b.turned ^ edge.opposite();
        if a.point == b.point {
            self.twisted[a.point as usize] |= turned;
        } else {
            self.link(a, b, turned, edge.along());
        }
    }

    /// Returns the votes between the sets joined so far, given votes between points; sums votes of
    /// equal pairs of sets, and sorts by pair.
    pub(super) fn between(&mut self, mut votes: Vec<Votes>) -> Vec<Votes> {
        votes.retain_mut(|vote| {
            let [a, b] = vote.sets.map(|set| self.root(set));
            vote.sets = [a.point.min(b.point), a.point.max(b.point)];
            vote.same = if a.turned == b.turned { vote.same } else { -vote.same };
            a.point != b.point
        });
        votes.sort_unstable_by_key(|vote| vote.sets);
        votes.dedup_by(|next, sum| {
            let is_same = next.sets == sum.sets;
            if is_same {
                sum.same += next.same;
                sum.all += next.all;
            }
            is_same
        });
        votes
    }

    /// Joins sets by the votes of all edges between two of them, each set with the one that has the
    /// clearest votes.
    pub(super) fn join_by_votes(&mut self, mut votes: Vec<Votes>) {
        while !votes.is_empty() {
            let by_clarity = |a: &(u32, usize), b: &(u32, usize)| {
                votes[b.1].same.abs().cmp(&votes[a.1].same.abs()).then(a.1.cmp(&b.1))
            };
            let mut clearest = by_set(&votes);
            clearest.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(by_clarity(a, b)));
            clearest.dedup_by_key(|(set, _)| *set);
            clearest.sort_unstable_by(by_clarity);
            for (_, k) in clearest {
                let vote = votes[k];
                let [a, b] = vote.sets.map(|set| self.root(set));
                if a.point != b.point {
                    self.link(a, b, a.turned ^ b.turned ^ (vote.same < 0), share(vote.same, vote.all));
                }
            }
            votes = self.between(votes);
        }
    }

    /// Returns for each patch, by its root, whether it is reversed relative to the root of its
    /// component.
    ///
    /// Starts with the signs from joining. Patches are then visited in turn, and a patch that the
    /// sum of all its `votes` contradicts is reversed, until no such patch is left. Each reversal increases
    /// the weight of the votes that are satisfied, so the process terminates.
    pub(super) fn settle(&mut self, votes: &[Votes]) -> Vec<bool> {
        let mut turned: Vec<bool> = (0..id32(self.above.len())).map(|i| self.root(i).turned).collect();
        let mut by_set = by_set(votes);
        by_set.sort_unstable();
        let mut is_settled = false;
        while !is_settled {
            is_settled = true;
            for patch in by_set.chunk_by(|a, b| a.0 == b.0) {
                let (mut followed, mut all) = (0, 0);
                for &(_, k) in patch {
                    let vote = votes[k];
                    let [a, b] = vote.sets.map(|set| turned[set as usize]);
                    followed += if a == b { vote.same } else { -vote.same };
                    all += vote.all;
                }
                if followed < 0 {
                    let set = patch[0].0 as usize;
                    turned[set] ^= true;
                    self.joined[set].1 = share(followed, all);
                    is_settled = false;
                }
            }
        }
        turned
    }

    fn link(&mut self, a: Signed, b: Signed, turned: bool, strength: f32) {
        let greater = (self.size[a.point as usize], b.point) >= (self.size[b.point as usize], a.point);
        let (root, leaf) = if greater { (a.point, b.point) } else { (b.point, a.point) };
        self.above[leaf as usize] = Signed { point: root, turned };
        self.size[root as usize] += self.size[leaf as usize];
        self.joined[leaf as usize] = (root, strength);
        self.twisted[root as usize] |= self.twisted[leaf as usize];
    }

    /// Returns the certainty of the least certain step through which `point` got its sign.
    pub(super) fn weakest(&self, mut point: u32) -> f32 {
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

/// Returns the indices of `votes`, once for each of their sets.
fn by_set(votes: &[Votes]) -> Vec<(u32, usize)> {
    votes.iter().enumerate().flat_map(|(k, vote)| vote.sets.map(|set| (set, k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vote(sets: [u32; 2], same: i64) -> Votes {
        Votes { sets, same, all: same.abs() + 1 }
    }

    /// Returns the weight of the satisfied votes minus that of the others.
    fn followed(votes: &[Votes], turned: &[bool]) -> i64 {
        let follows = |vote: &Votes| {
            let [a, b] = vote.sets.map(|set| turned[set as usize]);
            if a == b { vote.same } else { -vote.same }
        };
        votes.iter().map(follows).sum()
    }

    #[test]
    fn many_overrule_the_one_that_a_patch_was_surest_of() {
        let votes = vec![
            vote([0, 1], 10),
            vote([0, 2], -6),
            vote([0, 3], -6),
            vote([1, 2], 20),
            vote([1, 3], 20),
            vote([2, 3], 1),
        ];
        let mut tree = Tree::new(4);
        tree.join_by_votes(votes.clone());
        let signs: Vec<bool> = (0..4).map(|i| tree.root(i).turned).collect();
        assert!(signs.iter().all(|&turned| turned == signs[0]), "{signs:?}");
        let settled = tree.settle(&votes);
        assert!(settled[1] == settled[2] && settled[2] == settled[3] && settled[0] != settled[1]);
    }

    #[test]
    fn settled_no_patch_would_rather_be_turned() {
        let mut state = 7_u64;
        let mut draw = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        let mut gained = 0;
        for _ in 0..200 {
            let count = 2 + draw(30);
            let votes: Vec<Votes> = (0..4 * count)
                .map(|_| {
                    let ends = [draw(count), draw(count)].map(|i| u32::try_from(i).unwrap());
                    vote(ends, i64::try_from(draw(41)).unwrap() - 20)
                })
                .collect();
            let mut tree = Tree::new(usize::try_from(count).unwrap());
            let votes = tree.between(votes);
            tree.join_by_votes(votes.clone());
            let joined: Vec<bool> = (0..id32(tree.above.len())).map(|i| tree.root(i).turned).collect();
            let mut settled = tree.settle(&votes);
            let best = followed(&votes, &settled);
            gained += best - followed(&votes, &joined);
            for i in 0..settled.len() {
                settled[i] ^= true;
                assert!(followed(&votes, &settled) <= best, "patch {i} of {count}");
                settled[i] ^= true;
            }
        }
        assert!(gained > 1000, "{gained}");
    }
}
