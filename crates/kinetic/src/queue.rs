//! `Queue`: the times of things that are numbered, the earliest first.

/// Children of a node of the heap.
const WIDTH: usize = 4;

/// The place of a thing that is not in the queue.
const NONE: u32 = u32::MAX;

/// A heap with four children a node that knows the place of each item. Equal times are in the order
/// of their items, so the order is total.
#[derive(Debug, Clone, Default)]
pub(crate) struct Queue {
    heap: Vec<(f64, u32)>,
    /// The place in `heap` of each item that was ever in it.
    places: Vec<u32>,
}

fn is_before(a: (f64, u32), b: (f64, u32)) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
}

impl Queue {
    /// Returns the earliest time and its item.
    pub(crate) fn first(&self) -> Option<(f64, u32)> {
        self.heap.first().copied()
    }

    /// Sets the time of `item`. An infinite time removes it.
    pub(crate) fn set(&mut self, item: u32, time: f64) {
        if self.places.len() <= item as usize {
            self.places.resize(item as usize + 1, NONE);
        }
        let place = self.places[item as usize];
        if time == f64::INFINITY {
            self.remove_at(place);
        } else if place == NONE {
            self.heap.push((time, item));
            self.rise(self.heap.len() - 1);
        } else {
            self.heap[place as usize].0 = time;
            self.settle(place as usize);
        }
    }

    /// Removes all items.
    pub(crate) fn clear(&mut self) {
        self.heap.clear();
        self.places.clear();
    }

    /// Returns the bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        self.heap.len() * size_of::<(f64, u32)>() + self.places.len() * size_of::<u32>()
    }

    fn remove_at(&mut self, place: u32) {
        if place == NONE {
            return;
        }
        let (_, item) = self.heap.swap_remove(place as usize);
        self.places[item as usize] = NONE;
        if (place as usize) < self.heap.len() {
            self.settle(place as usize);
        }
    }

    fn settle(&mut self, at: usize) {
        let at = self.rise(at);
        self.sink(at);
    }

    /// Moves an item up to its place; returns it.
    fn rise(&mut self, mut at: usize) -> usize {
        let entry = self.heap[at];
        while at > 0 {
            let parent = (at - 1) / WIDTH;
            if !is_before(entry, self.heap[parent]) {
                break;
            }
            self.put(at, self.heap[parent]);
            at = parent;
        }
        self.put(at, entry);
        at
    }

    fn sink(&mut self, mut at: usize) {
        let entry = self.heap[at];
        loop {
            let children = WIDTH * at + 1..(WIDTH * at + 1 + WIDTH).min(self.heap.len());
            let Some(least) =
                children.reduce(|a, b| if is_before(self.heap[b], self.heap[a]) { b } else { a })
            else {
                break;
            };
            if !is_before(self.heap[least], entry) {
                break;
            }
            self.put(at, self.heap[least]);
            at = least;
        }
        self.put(at, entry);
    }

    fn put(&mut self, at: usize, entry: (f64, u32)) {
        self.heap[at] = entry;
        self.places[entry.1 as usize] = nearmiss_lanes::id32(at);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;

    use super::*;

    #[test]
    fn the_earliest_is_first_whatever_changes() {
        let rng = &mut rng(1);
        let mut queue = Queue::default();
        let mut twin: BTreeMap<u32, f64> = BTreeMap::new();
        for _ in 0..20_000 {
            let item = rng.random_range(0..60);
            let time = f64::from(rng.random_range(0..40_u32));
            if time > 30.0 {
                queue.set(item, f64::INFINITY);
                twin.remove(&item);
            } else {
                queue.set(item, time);
                twin.insert(item, time);
            }
            let least = twin.iter().map(|(&item, &time)| (time, item));
            let least = least.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            assert_eq!(queue.first(), least, "after {item} at {time}");
        }
        queue.clear();
        assert_eq!(queue.first(), None, "cleared");
    }
}
