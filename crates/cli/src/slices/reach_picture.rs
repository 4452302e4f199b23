//! The picture of an avatar's reach from above, with a view for each storey.

use nearmiss::slices::{Avatar, Reach, SliceMap, Storey, storey_of};
use nearmiss_draw::canvas::Colour;
use nearmiss_draw::picture::Picture;

use super::labels::Labels;
use super::storey_view::{AIM, EMPTY, FLOOR, IN_THE_WAY, STEP, Sheet, window};
use crate::digits::{rounded, short};

const REACHED: Colour = [120, 176, 226];

/// Places to mark, in the frame of the input.
pub(super) struct Marks<'a> {
    /// The place of the feet at the start.
    pub(super) start: [f64; 3],
    /// Other places, with their names.
    pub(super) others: &'a [([f64; 3], &'a str)],
}

/// Draws a view for each storey that the avatar reaches or that has a mark, lowest first.
pub(super) fn paint(
    map: &SliceMap,
    avatar: &Avatar,
    storeys: &[Storey],
    reach: &Reach,
    marks: &Marks<'_>,
) -> Picture {
    let grid = map.grid();
    let storey = |height: f64| storey_of(storeys, height).unwrap_or(0);
    let mut places: Vec<Vec<[f64; 3]>> = vec![Vec::new(); storeys.len().max(1)];
    for place in reach.positions().map(|place| grid.up.to_map(place)) {
        places[storey(place[2])].push(place);
    }
    let start = grid.up.to_map(marks.start);
    let others: Vec<([f64; 3], &str)> =
        marks.others.iter().map(|(place, name)| (grid.up.to_map(*place), *name)).collect();
    let is_marked = |i: usize| storey(start[2]) == i || others.iter().any(|(place, _)| storey(place[2]) == i);
    let shown: Vec<usize> = (0..places.len()).filter(|i| !places[*i].is_empty() || is_marked(*i)).collect();
    let all = places.iter().flatten().chain(others.iter().map(|(place, _)| place)).chain([&start]);
    let window = window(map, avatar, all.map(|place| [place[0], place[1]]));
    let covered = reach.by_storey(storeys);
    let titles = shown.iter().map(|&i| {
        let area = short(covered[i].area);
        storeys.get(i).map_or_else(
            || format!("area {area}"),
            |storey| {
                let height = rounded(grid.up.coordinate(storey.height), grid.pixel);
                format!("floor at {} = {height}: area {area}", grid.up)
            },
        )
    });
    let titles: Vec<String> = titles.collect();
    let options = avatar.options();
    let told = format!(
        "reach of an avatar of {} x {} x {} that climbs {}, pixels of {}",
        options.base[0],
        options.base[1],
        options.height,
        options.climb,
        short(grid.pixel)
    );
    let entries = [
        (REACHED, "within reach of the feet"),
        (FLOOR, "floor"),
        (STEP, "steep, but low enough to climb"),
        (IN_THE_WAY, "in the way"),
        (EMPTY, "nothing at this height"),
        (AIM, if others.is_empty() { "start" } else { "start, goal, and the place nearest to it" }),
    ];
    let mut sheet = Sheet::new((map, avatar), window, (&told, &titles), &entries, 0);
    for (i, &storey_shown) in shown.iter().enumerate() {
        let view = sheet.view(i);
        let here = &places[storey_shown];
        let floor = storeys.get(storey_shown).map(|storey| [start[0], start[1], storey.height]);
        let fallback: Vec<[f64; 3]> = floor.into_iter().collect();
        view.ground(&mut sheet.canvas, if here.is_empty() { &fallback } else { here });
        for place in here {
            view.square(&mut sheet.canvas, [place[0], place[1]], reach.lattice().spacing, REACHED);
        }
        let mut labels = Labels::default();
        if storey(start[2]) == storey_shown {
            view.base(&mut sheet.canvas, &mut labels, [start[0], start[1]], "start");
        }
        for (place, name) in others.iter().filter(|(place, _)| storey(place[2]) == storey_shown) {
            view.goal(&mut sheet.canvas, &mut labels, [place[0], place[1]], name);
        }
    }
    sheet.picture()
}
