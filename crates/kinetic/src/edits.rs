//! Changes of a running tree: other plans, and points and primitives that come and go.

use nearmiss_geometry::Aabb;

use crate::error::KineticError;
use crate::nodes::{FRESH, ROOT};
use crate::plan::FlightPlan;
use crate::primitives::NONE;
use crate::tree::KineticTree;

impl KineticTree {
    /// Gives a point another plan, from the clock on. The point may jump.
    ///
    /// Costs O(log n) for each primitive that has the point: only certificates in which it takes
    /// part are computed again. [`set_plans`](Self::set_plans) is faster for many points.
    ///
    /// # Errors
    /// [`KineticError::NoSuchPoint`] if there is no such point.
    pub fn set_plan(&mut self, point: u32, plan: FlightPlan) -> Result<(), KineticError> {
        self.set_plans([(point, plan)])
    }

    /// Gives many points other plans, from the clock on. Each node is computed at most once, so the
    /// cost is at most O(n). If one of the points does not exist, none after it is changed.
    ///
    /// # Errors
    /// [`KineticError::NoSuchPoint`] if there is no such point.
    pub fn set_plans(
        &mut self,
        plans: impl IntoIterator<Item = (u32, FlightPlan)>,
    ) -> Result<(), KineticError> {
        let mut result = Ok(());
        for (point, plan) in plans {
            result = self.check_point(point);
            if result.is_err() {
                break;
            }
            self.points.replace(point, plan, self.clock);
            self.counts.plans += 1;
            self.touch(point);
        }
        self.edits += 1;
        self.refresh();
        result
    }

    /// Adds a point and returns its index. It has no effect until a primitive uses it. The index
    /// may be that of a removed point.
    ///
    /// # Errors
    /// [`KineticError::TooMany`] if there are 2³¹ points.
    pub fn add_point(&mut self, plan: FlightPlan) -> Result<u32, KineticError> {
        self.points.add(plan, self.clock)
    }

    /// Removes a point that no primitive uses.
    ///
    /// # Errors
    /// [`KineticError::NoSuchPoint`], or [`KineticError::InUse`] if a primitive uses it.
    pub fn remove_point(&mut self, point: u32) -> Result<(), KineticError> {
        self.check_point(point)?;
        if let Some(primitive) = self.primitives.of(point).next() {
            return Err(KineticError::InUse { point, primitive });
        }
        self.points.remove(point);
        Ok(())
    }

    /// Inserts a primitive and returns its index, which may be that of a removed one.
    ///
    /// Costs O(log² n) on average over many: a part of the tree that has become lopsided is built
    /// again.
    ///
    /// # Errors
    /// [`KineticError::Arity`] if it has no or too many points, [`KineticError::NoSuchPoint`] if
    /// it has one that does not exist, [`KineticError::TooMany`] if there are 2³¹ corners.
    pub fn insert(&mut self, points: &[u32]) -> Result<u32, KineticError> {
        self.check_primitive(points)?;
        let primitive = self.primitives.add(points);
        self.counts.insertions += 1;
        let bounds = Aabb::of(points.iter().map(|&point| self.points.position(point, self.clock)));
        let leaf = self.best_leaf(&bounds);
        match self.resize(leaf, |size| size + 1) {
            Some(node) => {
                // The primitive is in no leaf yet.
                self.nodes.link_mut(leaf).size -= 1;
                self.rebuild(node, vec![primitive]);
            }
            None => {
                let place = self.nodes.link(leaf).size as usize - 1;
                let start = self.nodes.block_of(leaf) as usize * self.nodes.leaf_size;
                self.nodes.primitives[start + place] = primitive;
                self.primitives.leaves[primitive as usize] = leaf;
                self.nodes.mark(leaf, FRESH);
            }
        }
        self.edits += 1;
        self.refresh();
        Ok(primitive)
    }

    /// Removes a primitive. Its points stay. Costs O(log² n) on average over many.
    ///
    /// # Errors
    /// [`KineticError::NoSuchPrimitive`] if there is no such primitive.
    pub fn remove(&mut self, primitive: u32) -> Result<(), KineticError> {
        if !self.primitives.has(primitive) {
            return Err(KineticError::NoSuchPrimitive { primitive });
        }
        let leaf = self.primitives.leaves[primitive as usize];
        self.primitives.remove(primitive);
        self.counts.removals += 1;
        let start = self.nodes.get(leaf).block as usize * self.nodes.leaf_size;
        let end = start + self.nodes.link(leaf).size as usize;
        let list = &mut self.nodes.primitives[start..end];
        if let Some(place) = list.iter().position(|&other| other == primitive) {
            list[place..].rotate_left(1);
        }
        match self.resize(leaf, |size| size - 1) {
            Some(node) => self.rebuild(node, Vec::new()),
            None => self.nodes.mark(leaf, FRESH),
        }
        self.edits += 1;
        self.refresh();
        Ok(())
    }

    /// Returns the leaf that `bounds` enlarges least, child by child.
    fn best_leaf(&self, bounds: &Aabb) -> u32 {
        let mut at = ROOT;
        while !self.nodes.link(at).is_leaf() {
            let children = self.nodes.link(at).children;
            let [a, b] = [children, children + 1].map(|child| {
                let own = self.node_box(child);
                let grown = |k: usize| bounds.max[k].max(own.max[k]) - bounds.min[k].min(own.min[k]);
                let growth: f64 = (0..3).map(|k| grown(k) - (own.max[k] - own.min[k])).sum();
                (growth, self.nodes.link(child).size)
            });
            at = if b.0 < a.0 || (b.0 == a.0 && b.1 < a.1) { children + 1 } else { children };
        }
        at
    }

    /// Changes the sizes from `leaf` to the root. Returns the uppermost node that must be built
    /// again.
    fn resize(&mut self, leaf: u32, change: impl Fn(u32) -> u32) -> Option<u32> {
        let mut worst = None;
        let mut at = leaf;
        while at != NONE {
            let node = self.nodes.link_mut(at);
            node.size = change(node.size);
            let parent = node.parent;
            if self.nodes.is_unbalanced(at) {
                worst = Some(at);
            }
            at = parent;
        }
        worst
    }

    /// Builds the subtree at `node` again, with the primitives below it and these.
    fn rebuild(&mut self, node: u32, mut primitives: Vec<u32>) {
        self.nodes.gather(node, &mut primitives);
        self.nodes.mark(node, FRESH);
        self.grow(node, &primitives);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_with_an_unbalanced_node_is_refused() {
        let plans = (0..64_u8).map(|i| FlightPlan::at_rest(0.0, [f64::from(i), 0.0, 0.0]).unwrap());
        let mut tree = KineticTree::of_points(0.0, plans).unwrap();
        let load = |tree: &KineticTree| {
            let mut file = Vec::new();
            tree.write_to(&mut file).unwrap();
            KineticTree::from_bytes(file).map(|tree| tree.height())
        };
        assert!(load(&tree).is_ok(), "as it was built");
        // All but four points of the left half vanish, and the root is not built again, as in a file
        // that lies: its height could be that of a list.
        let [left, right] = [0, 1].map(|k| tree.nodes.link(ROOT).children + k);
        let mut all = Vec::new();
        tree.nodes.gather(left, &mut all);
        let gone = all.split_off(4);
        tree.nodes.mark(left, FRESH);
        tree.grow(left, &all);
        gone.into_iter().for_each(|primitive| tree.primitives.remove(primitive));
        tree.nodes.link_mut(ROOT).size = 4 + tree.nodes.link(right).size;
        tree.refresh();
        assert!(tree.nodes.is_unbalanced(ROOT), "32 of 36 points are on the right");
        let fault = load(&tree).unwrap_err();
        assert!(
            matches!(fault, KineticError::Damaged { what: "size of node", index } if index == ROOT as usize),
            "{fault}"
        );
    }
}
