//! Validation of a loaded graph. The structure, which keeps accesses within the arrays, is always
//! checked. The contents, which answers depend on, are checked on request.

use nearmiss_store::Flaw;

use crate::adjacency::Adjacency;
use crate::graph::PointGraph;

const EDGES: ListNames = ListNames { array: "edges", item: "the edges of point" };
const VIRTUAL: ListNames = ListNames { array: "virtual edges", item: "the virtual edges of point" };
const COMPONENT: &str = "the component of point";

/// The names of lists in error messages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ListNames {
    /// The name of the array.
    pub(crate) array: &'static str,
    /// The name of one list, before its index.
    pub(crate) item: &'static str,
}

impl Adjacency {
    /// Checks that there are lists for `points` points, each of them ascending and holding indices
    /// of other points in range. Takes one pass.
    pub(crate) fn check_structure(&self, points: usize, names: ListNames) -> Result<(), Flaw> {
        let wrong = |index| Err(Flaw::Value { what: names.item, index });
        Flaw::length(names.array, self.starts.len(), points + 1)?;
        let end = self.starts[points] as usize;
        if self.starts[0] != 0 || end != self.neighbours.len() {
            return Err(Flaw::Length { array: names.array, found: self.neighbours.len(), expected: end });
        }
        for i in 0..points {
            let (first, end) = (self.starts[i] as usize, self.starts[i + 1] as usize);
            let Some(list) = self.neighbours.get(first..end) else { return wrong(i) };
            let ascends = list.windows(2).all(|two| two[0] < two[1]);
            if !ascends || list.iter().any(|&j| j as usize >= points || j as usize == i) {
                return wrong(i);
            }
        }
        Ok(())
    }

    /// Checks that each edge is stored at both ends. Requires a valid structure. Takes one pass.
    fn check_symmetry(&self, what: &'static str) -> Result<(), Flaw> {
        // Ascending points i reach each list of their neighbours in the order of that list.
        let mut next: Vec<u32> = self.starts[..self.len()].to_vec();
        for (i, point) in (0..self.len()).zip(0_u32..) {
            for &j in self.of(i) {
                let place = &mut next[j as usize];
                if *place >= self.starts[j as usize + 1] || self.neighbours[*place as usize] != point {
                    return Err(Flaw::Value { what, index: i });
                }
                *place += 1;
            }
        }
        Ok(())
    }
}

impl PointGraph {
    /// Checks everything that keeps accesses within the arrays. Takes one pass over points and
    /// edges.
    pub(crate) fn check_structure(&self, points: usize) -> Result<(), Flaw> {
        let lengths = [
            ("radii of influence", self.radii.len()),
            ("longest edges", self.reaches.len()),
            ("components", self.components.len()),
            ("borders", self.borders.len()),
        ];
        for (array, found) in lengths {
            Flaw::length(array, found, points)?;
        }
        self.edges.check_structure(points, EDGES)?;
        self.virtual_edges.check_structure(points, VIRTUAL)?;
        // A component is named by its first point.
        let mut count = 0;
        for (i, &least) in self.components.iter().enumerate() {
            let named = self.components[..=i].get(least as usize);
            if named != Some(&least) {
                return Err(Flaw::Value { what: COMPONENT, index: i });
            }
            count += u32::from(least as usize == i);
        }
        if count != self.component_count {
            return Err(Flaw::Metadata { what: "the number of components" });
        }
        Ok(())
    }

    /// Checks everything else that answers depend on. Requires a valid structure. Takes one pass
    /// over points and edges.
    pub(crate) fn check_contents(&self) -> Result<(), Flaw> {
        let wrong = |what, index| Err(Flaw::Value { what, index });
        self.edges.check_symmetry(EDGES.item)?;
        self.virtual_edges.check_symmetry(VIRTUAL.item)?;
        let is_length = |length: f32| length.is_finite() && length >= 0.0;
        for i in 0..self.len() {
            if !is_length(self.radii[i]) {
                return wrong("the radius of influence of point", i);
            }
            if !is_length(self.reaches[i]) {
                return wrong("the longest edge of point", i);
            }
            if self.borders[i] > 1 {
                return wrong("the border flag of point", i);
            }
            let own = self.components[i];
            if self.edges.of(i).iter().any(|&j| self.components[j as usize] != own) {
                return wrong(COMPONENT, i);
            }
            if self.virtual_edges.of(i).iter().any(|j| self.edges.of(i).binary_search(j).is_ok()) {
                return wrong(VIRTUAL.item, i);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lists(lists: [&[u32]; 4]) -> Adjacency {
        let ends = lists.iter().scan(0, |end, list| {
            *end += u32::try_from(list.len()).unwrap();
            Some(*end)
        });
        let starts: Vec<u32> = std::iter::once(0).chain(ends).collect();
        Adjacency { starts: starts.into(), neighbours: lists.concat().into() }
    }

    #[test]
    fn lists_that_are_no_graph_are_refused() {
        fn structure(of: [&[u32]; 4]) -> bool {
            lists(of).check_structure(4, EDGES).is_ok()
        }
        assert!(structure([&[1, 2], &[0], &[0], &[]]), "a graph");
        for wrong in [[1, 1], [2, 1], [0, 1], [1, 4]] {
            assert!(!structure([&wrong, &[0], &[0], &[]]), "{wrong:?}");
        }
        let symmetric = |of| lists(of).check_symmetry(EDGES.item).is_ok();
        assert!(symmetric([&[1, 2], &[0], &[0, 3], &[2]]), "a graph");
        assert!(!symmetric([&[1], &[], &[3], &[2]]), "an edge with one end");
        assert!(!symmetric([&[1], &[2], &[3], &[0]]), "as many edges in as out");
    }

    #[test]
    fn starts_that_lead_astray_are_refused() {
        for starts in
            [vec![0, 2, 1, 2, 2], vec![1, 1, 1, 1, 2], vec![0, 3, 1, 1, 2], vec![0, 1, 2, 2], vec![]]
        {
            let adjacency = Adjacency { starts: starts.clone().into(), neighbours: vec![1, 0].into() };
            assert!(adjacency.check_structure(4, EDGES).is_err(), "{starts:?}");
        }
    }
}
