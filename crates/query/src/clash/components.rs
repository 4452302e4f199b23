//! Connected components of places. Two places are joined if their distance is at most a link
//! length.
//!
//! A tree of boxes halves the places, and pairs of its nodes are compared from the root down. A
//! pair is dropped if its boxes are further apart than a link, or if both nodes are in one
//! component already. It is joined as a whole if no two of its places can be further apart than a
//! link. Otherwise its halves are compared. Differences, quotients and sums round monotonically, so
//! a box decides exactly as each of its pairs of places would. The components are therefore equal
//! to those found by comparing all pairs, at any scale.

use nearmiss_geometry::Aabb;

/// The places of a node with at most this many are compared one by one.
const LEAF: usize = 8;

/// Returns the number of the component of each place, counted from 0 in the order of their first
/// places.
///
/// Two places whose distance is at most `link` are in one component; `link` 0 joins equal places
/// only. A place with a coordinate that is not finite is a component of its own.
///
/// Takes n log n steps if the places are spread out or close together, and memory for two numbers
/// and a box per place. The order of the places changes the numbers of the components but not the
/// components.
#[must_use]
pub fn components(places: &[[f64; 3]], link: f64) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..places.len()).filter(|&i| places[i].iter().all(|c| c.is_finite())).collect();
    let parents = (0..places.len()).collect();
    let mut joining = Joining { places, link, nodes: Vec::new(), parents };
    if !order.is_empty() {
        joining.grow(&mut order, 0);
        joining.join(&order, 0, 0);
    }
    numbered(places.len(), |i| joining.root(i))
}

/// Returns the number of the set of each item, counted from 0 in the order of first items. `root` returns the
/// first item of a set.
pub(crate) fn numbered(items: usize, mut root: impl FnMut(usize) -> usize) -> Vec<usize> {
    let (mut numbers, mut count) = (vec![0; items], 0);
    for i in 0..items {
        let root = root(i);
        if root == i {
            numbers[i] = count;
            count += 1;
        } else {
            numbers[i] = numbers[root];
        }
    }
    numbers
}

/// A range of places in the order of the tree, with their box.
struct Node {
    start: usize,
    end: usize,
    bounds: Aabb,
    /// The child with the second half of the places; the child with the first half is the next
    /// node. `None` for a leaf.
    second: Option<usize>,
    /// `true` if all places are known to be in one component.
    is_one: bool,
}

struct Joining<'a> {
    places: &'a [[f64; 3]],
    link: f64,
    nodes: Vec<Node>,
    /// Union-find parent of each place: an earlier place of the same component, or the place itself
    /// if it is the first.
    parents: Vec<usize>,
}

impl Joining<'_> {
    /// Appends the subtree of the places in `order`, the first of which has position `start` in the
    /// order of all places.
    fn grow(&mut self, order: &mut [usize], start: usize) {
        let bounds = Aabb::of(order.iter().map(|&i| self.places[i]));
        let own = self.nodes.len();
        self.nodes.push(Node { start, end: start + order.len(), bounds, second: None, is_one: false });
        if order.len() <= LEAF {
            return;
        }
        let half = bounds.half_extents();
        let axis = (1..3).fold(0, |longest, k| if half[k] > half[longest] { k } else { longest });
        let places = self.places;
        let (first, _, _) = order.select_nth_unstable_by(order.len() / 2, |&i, &j| {
            places[i][axis].total_cmp(&places[j][axis]).then(i.cmp(&j))
        });
        let middle = first.len();
        self.grow(&mut order[..middle], start);
        self.nodes[own].second = Some(self.nodes.len());
        self.grow(&mut order[middle..], start + middle);
    }

    /// Joins all places of nodes `a` and `b` (which may be equal) that are at most a link apart.
    fn join(&mut self, order: &[usize], a: usize, b: usize) {
        if self.is_one(order, a)
            && (a == b
                || self.is_one(order, b)
                    && self.root(order[self.nodes[a].start]) == self.root(order[self.nodes[b].start]))
        {
            return;
        }
        let (box_a, box_b) = (self.nodes[a].bounds, self.nodes[b].bounds);
        let gap = [0, 1, 2].map(|k| (box_b.min[k] - box_a.max[k]).max(box_a.min[k] - box_b.max[k]).max(0.0));
        if !within(gap, self.link) {
            return;
        }
        let most = [0, 1, 2].map(|k| (box_b.max[k] - box_a.min[k]).max(box_a.max[k] - box_b.min[k]));
        if within(most, self.link) {
            self.unite(order, a);
            self.unite(order, b);
            self.link_places(order[self.nodes[a].start], order[self.nodes[b].start]);
            return;
        }
        match (self.nodes[a].second, self.nodes[b].second) {
            (None, None) => {
                for i in self.nodes[a].start..self.nodes[a].end {
                    for j in self.nodes[b].start..self.nodes[b].end {
                        let [p, q] = [order[i], order[j]];
                        let apart = [0, 1, 2].map(|k| (self.places[p][k] - self.places[q][k]).abs());
                        if within(apart, self.link) {
                            self.link_places(p, q);
                        }
                    }
                }
            }
            (Some(second), _) if a == b => {
                self.join(order, a + 1, a + 1);
                self.join(order, second, second);
                self.join(order, a + 1, second);
            }
            (Some(second), other) if other.is_none() || self.size(a) >= self.size(b) => {
                self.join(order, a + 1, b);
                self.join(order, second, b);
            }
            (_, Some(second)) => {
                self.join(order, a, b + 1);
                self.join(order, a, second);
            }
            // The guard above takes all other pairs.
            (Some(_), None) => {}
        }
    }

    fn size(&self, node: usize) -> usize {
        self.nodes[node].end - self.nodes[node].start
    }

    /// Joins all places of a node.
    fn unite(&mut self, order: &[usize], node: usize) {
        if self.nodes[node].is_one {
            return;
        }
        let Node { start, end, .. } = self.nodes[node];
        for i in start + 1..end {
            self.link_places(order[start], order[i]);
        }
        self.nodes[node].is_one = true;
    }

    /// Returns `true` if all places of a node are in one component, and caches that result.
    fn is_one(&mut self, order: &[usize], node: usize) -> bool {
        let Node { start, end, second, is_one, .. } = self.nodes[node];
        let all = is_one
            || match second {
                None => (start + 1..end).all(|i| self.root(order[i]) == self.root(order[start])),
                Some(second) => {
                    self.is_one(order, node + 1)
                        && self.is_one(order, second)
                        && self.root(order[start]) == self.root(order[self.nodes[second].start])
                }
            };
        self.nodes[node].is_one = all;
        all
    }

    /// Joins the components of two places; the earlier root stays the root.
    fn link_places(&mut self, i: usize, j: usize) {
        let (i, j) = (self.root(i), self.root(j));
        self.parents[i.max(j)] = i.min(j);
    }

    /// Returns the first place of the component of place `i`, and halves the path to it.
    fn root(&mut self, mut i: usize) -> usize {
        while self.parents[i] != i {
            self.parents[i] = self.parents[self.parents[i]];
            i = self.parents[i];
        }
        i
    }
}

/// Returns `true` if a vector with these absolute components is at most `link` long. Divides by
/// `link` first, so that squares neither overflow nor underflow.
fn within(apart: [f64; 3], link: f64) -> bool {
    if link > 0.0 {
        let [x, y, z] = apart.map(|d| d / link);
        x * x + y * y + z * z <= 1.0
    } else {
        apart == [0.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary;

    use super::*;

    /// Finds the components by comparing all pairs of places.
    fn twin(places: &[[f64; 3]], link: f64) -> Vec<usize> {
        let mut numbers = vec![usize::MAX; places.len()];
        let mut count = 0;
        for first in 0..places.len() {
            if numbers[first] != usize::MAX {
                continue;
            }
            let mut open = vec![first];
            numbers[first] = count;
            while let Some(i) = open.pop() {
                for j in 0..places.len() {
                    let apart = [0, 1, 2].map(|k| (places[i][k] - places[j][k]).abs());
                    if numbers[j] == usize::MAX && within(apart, link) {
                        numbers[j] = count;
                        open.push(j);
                    }
                }
            }
            count += 1;
        }
        numbers
    }

    fn count(numbers: &[usize]) -> usize {
        numbers.iter().max().map_or(0, |most| most + 1)
    }

    #[test]
    fn components_are_those_of_all_pairs() {
        let mut rng = arbitrary::rng(5);
        let mut kinds_of_answers = [0; 3];
        for n in [1, 2, 7, 9, 40, 300] {
            for scale in [1e-160, 1e-3, 1.0, 1e9, 1e160] {
                let places: Vec<[f64; 3]> =
                    (0..n).map(|_| arbitrary::point_in(&mut rng, 1.0).map(|c| c * scale)).collect();
                for share in [0.0, 0.01, 0.1, 0.2, 0.3, 0.5, 4.0] {
                    let found = components(&places, share * scale);
                    assert_eq!(found, twin(&places, share * scale), "{n} places, link {share} × {scale}");
                    let parts = count(&found);
                    kinds_of_answers[if parts == n { 0 } else { usize::from(parts == 1) + 1 }] += 1;
                }
            }
        }
        assert!(kinds_of_answers.iter().all(|&n| n > 10), "all apart, some, one: {kinds_of_answers:?}");
    }

    #[test]
    fn places_exactly_a_link_apart_are_joined() {
        // A lattice and a chain: every distance is the link or more, rounded as for single pairs.
        for step in [1.0, 0.1, 0.3, 1e-7, 12_345.6] {
            let lattice: Vec<[f64; 3]> = (0..6_u32)
                .flat_map(|i| (0..6).flat_map(move |j| (0..6).map(move |k| [i, j, k].map(f64::from))))
                .map(|p| p.map(|c| c * step))
                .collect();
            for link in [step, step * (1.0 - 1e-15), step * (1.0 + 1e-15), step * 2.0_f64.sqrt()] {
                assert_eq!(components(&lattice, link), twin(&lattice, link), "step {step}, link {link}");
            }
            let chain: Vec<[f64; 3]> = (0..500_u32).map(|i| [f64::from(i) * step, 0.0, 0.0]).collect();
            assert_eq!(components(&chain, step), twin(&chain, step), "a chain of step {step}");
        }
        let chain: Vec<[f64; 3]> = (0..20_000_u32).rev().map(|i| [f64::from(i), 0.0, 0.0]).collect();
        assert_eq!(count(&components(&chain, 1.0)), 1);
        assert_eq!(count(&components(&chain, 0.99)), 20_000);
    }

    #[test]
    fn degenerate_places_have_components_too() {
        assert!(components(&[], 1.0).is_empty());
        let equal = vec![[1.0, -2.0, 1e9]; 100_000];
        assert_eq!(count(&components(&equal, 0.0)), 1);
        assert_eq!(count(&components(&equal, 1e-300)), 1);
        let odd = [[f64::NAN; 3], [0.0; 3], [f64::INFINITY, 0.0, 0.0], [0.5, 0.0, 0.0], [f64::NAN; 3]];
        assert_eq!(components(&odd, 1.0), [0, 1, 2, 1, 3]);
        assert_eq!(components(&[[0.0; 3], [-0.0; 3]], 0.0), [0, 0]);
        assert_eq!(components(&[[-1.7e308; 3], [1.7e308; 3]], 1e308), [0, 1]);
    }

    #[test]
    fn two_crowds_a_little_further_apart_than_a_link_stay_two() {
        let mut rng = arbitrary::rng(6);
        let places: Vec<[f64; 3]> = (0..100_000_u32)
            .map(|i| {
                let [x, y, z] = arbitrary::point_in(&mut rng, 1.0);
                [x + if i % 2 == 0 { 0.0 } else { 4.001 }, y, z]
            })
            .collect();
        let found = components(&places, 2.0);
        assert!(found.iter().zip(0..).all(|(&number, i)| number == i % 2), "by parity");
        assert_eq!(count(&components(&places, 2.1)), 1);
    }
}
