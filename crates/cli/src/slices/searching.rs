//! Progress of searches over the places of a map.

use std::fmt::Display;

use nearmiss::slices::{Avatar, SliceMap};

use crate::console::Console;
use crate::progress::{Counter, Told, Watch};

/// Shows the progress of a search over the places of a map, until the result is dropped. `count` is
/// the number of places so far.
///
/// The share is that of all places where the avatar can stand. A search may end earlier, because it
/// has found its goal, or because not all places are within reach. So the time left is an upper
/// estimate.
pub(super) fn watch(
    console: Console,
    what: impl Display,
    (map, avatar): (&SliceMap, &Avatar),
    count: &Counter,
) -> Watch {
    let most = if console.shows_bars() { avatar.estimated_places(map).ok() } else { None };
    let most = most.filter(|places| *places >= 1.0);
    let count = count.clone();
    console.watch(what, "places", move || {
        let count = count.get();
        #[expect(clippy::cast_precision_loss, reason = "a rough figure")]
        let share = most.map(|most| (count as f64 / most).min(MOST));
        Told { share, count, may_end_early: true }
    })
}

/// The greatest share that is shown, since the number of places is an estimate.
const MOST: f64 = 0.99;
