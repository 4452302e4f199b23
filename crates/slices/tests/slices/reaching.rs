//! Places to stand, reach and routes, compared with naive twins that use only [`Walker`].

use std::collections::BTreeMap;

use nearmiss_slices::{
    Avatar, AvatarOptions, Back, Ended, Misplaced, Pixel, Reach, Route, RouteError, SliceMap, SliceOptions,
    StartError, StepGrid, Up, WalkError, Walker, storey_of,
};
use nearmiss_testdata::arbitrary::rng;
use nearmiss_testdata::house::{STAIRS, STOREY, house, scanned};
use rand::RngExt;

use crate::built::built;

const PIXEL: f64 = 0.1;

/// A level patch of points, with a point in every pixel.
fn patch(x: [f64; 2], y: [f64; 2], z: f64) -> impl Iterator<Item = [f64; 3]> {
    let steps = |[from, to]: [f64; 2]| {
        (0..200_u8).map(move |i| from + 0.05 * f64::from(i)).take_while(move |x| *x < to)
    };
    steps(y).flat_map(move |y| steps(x).map(move |x| [x, y, z]))
}

/// A floor of 4 × 3 with walls, steps, tables, holes and a gallery, about half of it free.
fn random_map(seed: u64, up: Up) -> SliceMap {
    let rng = &mut rng(seed);
    let hole = [rng.random_range(0.5..3.0), rng.random_range(0.5..2.0)];
    let is_hole = |p: &[f64; 3]| (0..2).all(|k| hole[k] < p[k] && p[k] < hole[k] + 0.8);
    let mut points: Vec<[f64; 3]> = patch([0.0, 4.0], [0.0, 3.0], 0.0).filter(|p| !is_hole(p)).collect();
    points.extend(patch([0.0, 4.0], [0.0, 3.0], -1.5));
    for i in 0..rng.random_range(5..12_u8) {
        let [x, y] = [rng.random_range(0.0..3.8), rng.random_range(0.0..2.8)];
        let size = [rng.random_range(0.1..1.2), rng.random_range(0.1..0.6)];
        let (dx, dy) = if i % 2 == 0 { (size[0], size[1]) } else { (size[1], size[0]) };
        let block = |z: f64| patch([x, (x + dx).min(4.0)], [y, (y + dy).min(3.0)], z);
        match i % 4 {
            0 | 1 => points.extend((0..24_u8).flat_map(|k| block(0.1 * f64::from(k)))),
            2 => points.extend(block(rng.random_range(0.05..0.6))),
            _ => points.extend(block(rng.random_range(0.9..1.9))),
        }
    }
    // A flight of low steps to a gallery.
    for i in 1..9_u8 {
        let x = 0.2 * f64::from(i);
        points.extend(patch([x, x + 0.2], [0.0, 0.7], 0.2 * f64::from(i)));
    }
    points.extend(patch([1.8, 4.0], [0.0, 0.7], 1.7));
    points.push([0.0, 0.0, 3.6]);
    let turned: Vec<[f64; 3]> = points.iter().map(|p| up.from_map(*p)).collect();
    built(&turned, &SliceOptions::default().with_pixel(Pixel::Side(PIXEL)).with_up(up)).unwrap()
}

fn avatar() -> Avatar {
    Avatar::new(&AvatarOptions::default().with_box([0.3, 0.2], 1.2).with_climb(0.3).with_step(PIXEL)).unwrap()
}

/// Walks straight to a place, step by step.
fn naive_straight(map: &SliceMap, mut walker: Walker, to: [f64; 2], falls: bool) -> Option<Walker> {
    let grid = map.grid();
    let target = grid.up.across(to);
    let mut steps = 0;
    while !walker.is_at(grid, target) || walker.is_falling() {
        let step = walker.step(map, target, &Back).unwrap();
        let low = grid.up.to_map(step.position)[2] < grid.origin[2] - 0.5;
        steps += u32::from(!step.falling);
        if step.blocked || (step.falling && !falls) || low || steps > 9 {
            return None;
        }
    }
    Some(walker)
}

/// States of the walker by column and row, each with its distance from the start.
struct Naive<'a> {
    map: &'a SliceMap,
    lattice: StepGrid,
    falls: bool,
    found: BTreeMap<[i64; 2], Vec<(Walker, f64)>>,
}

impl<'a> Naive<'a> {
    fn place(&self, cell: [i64; 2]) -> Option<[f64; 2]> {
        let cell: Vec<u32> = cell.iter().filter_map(|i| u32::try_from(*i).ok()).collect();
        let is_there = cell.len() == 2 && (0..2).all(|k| u64::from(cell[k]) < self.lattice.counts[k]);
        is_there.then(|| self.lattice.place([cell[0], cell[1]]))
    }

    /// The lower corner of the cell that holds a place of the map's coordinates.
    fn cell(&self, p: [f64; 3]) -> [i64; 2] {
        #[expect(clippy::cast_possible_truncation, reason = "small")]
        [0, 1].map(|k| ((p[k] - self.lattice.origin[k]) / self.lattice.spacing).floor() as i64)
    }

    /// Relaxes all edges until no path gets shorter (Bellman–Ford).
    fn new(map: &'a SliceMap, start: &Walker, lattice: StepGrid, falls: bool) -> Self {
        let mut naive = Self { map, lattice, falls, found: BTreeMap::new() };
        let from = map.grid().up.to_map(start.position(map.grid()));
        let [column, row] = naive.cell(from);
        let mut open: Vec<([i64; 2], Walker, f64)> = Vec::new();
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            open.extend(naive.edge(start, 0.0, [column + i, row + j]));
        }
        while let Some((cell, walker, length)) = open.pop() {
            let here = naive.found.entry(cell).or_default();
            match here.iter_mut().find(|(known, _)| *known == walker) {
                Some((_, known)) if *known <= length + 1e-12 => continue,
                Some((_, known)) => *known = length,
                None => here.push((walker, length)),
            }
            for i in -1..=1 {
                for j in -1..=1 {
                    if (i, j) != (0, 0) {
                        open.extend(naive.edge(&walker, length, [cell[0] + i, cell[1] + j]));
                    }
                }
            }
            // The shortest last, so that it is next.
            open.sort_by(|a, b| b.2.total_cmp(&a.2));
        }
        naive
    }

    fn edge(&self, walker: &Walker, so_far: f64, cell: [i64; 2]) -> Option<([i64; 2], Walker, f64)> {
        let to = self.place(cell)?;
        let [x, y, _] = self.map.grid().up.to_map(walker.position(self.map.grid()));
        let arrived = naive_straight(self.map, *walker, to, self.falls)?;
        Some((cell, arrived, so_far + (to[0] - x).hypot(to[1] - y)))
    }

    /// Cells and heights.
    fn places(&self) -> Vec<([i64; 2], f64)> {
        let grid = self.map.grid();
        let height = |walker: &Walker| grid.up.to_map(walker.position(grid))[2];
        let all = self.found.iter();
        let mut places: Vec<_> =
            all.flat_map(|(cell, found)| found.iter().map(|(w, _)| (*cell, height(w)))).collect();
        places.sort_by(|(a, z), (b, w)| [a[1], a[0]].cmp(&[b[1], b[0]]).then(z.total_cmp(w)));
        places.dedup();
        places
    }

    /// Returns the length of the shortest path to a place where an avatar stands.
    fn length_to(&self, start: &Walker, goal: &Walker) -> Option<f64> {
        let grid = self.map.grid();
        let [from, to] = [start, goal].map(|walker| grid.up.to_map(walker.position(grid)));
        let [column, row] = self.cell(to);
        let corners = [[column, row], [column + 1, row], [column, row + 1], [column + 1, row + 1]];
        let known = corners.iter().flat_map(|cell| self.found.get(cell).into_iter().flatten());
        let direct = (self.cell(from) == self.cell(to)).then_some((*start, 0.0));
        let arriving = known.copied().chain(direct).filter_map(|(walker, length)| {
            let [x, y, _] = grid.up.to_map(walker.position(grid));
            let arrived = naive_straight(self.map, walker, [to[0], to[1]], self.falls)?;
            let off = (grid.up.to_map(arrived.position(grid))[2] - to[2]).abs();
            (off <= avatar().options().climb).then(|| length + (to[0] - x).hypot(to[1] - y))
        });
        arriving.min_by(f64::total_cmp)
    }
}

/// Random places where the avatar stands.
fn standing(map: &SliceMap, seed: u64, count: usize) -> Vec<([f64; 3], Walker)> {
    let rng = &mut rng(seed);
    let mut found = Vec::new();
    for _ in 0..10_000 {
        let z = [0.0, 0.2, 1.7, -1.5][rng.random_range(0..4_usize)];
        let place = [rng.random_range(0.1..3.9), rng.random_range(0.1..2.9), z];
        let place = map.grid().up.from_map(place);
        if let Ok(walker) = avatar().placed(map, place) {
            found.push((place, walker));
        }
        if found.len() == count {
            break;
        }
    }
    found
}

#[test]
fn reach_is_what_a_naive_fill_finds() {
    let (mut places, mut partial, mut more) = (0, 0, 0);
    for seed in 0..16 {
        let up = [Up::Z, Up::Y, Up::NegX, Up::X][usize::try_from(seed).unwrap() % 4];
        let map = random_map(seed, up);
        let lattice = StepGrid::new(map.grid(), &avatar(), PIXEL);
        for (_, start) in standing(&map, seed, 2) {
            let sizes = [false, true].map(|falls| {
                let reach = Reach::new(&map, &start, falls).unwrap();
                let found: Vec<_> = reach.cells().map(|(cell, z)| (cell.map(i64::from), z)).collect();
                assert_eq!(found, Naive::new(&map, &start, lattice, falls).places(), "map {seed}");
                assert_eq!(reach.lattice(), &lattice);
                let whole: u64 = reach.by_storey(&[]).iter().map(|covered| covered.places).sum();
                assert!(whole <= reach.len() as u64 && (whole == 0) == reach.is_empty());
                reach.len()
            });
            places += sizes[0];
            more += usize::from(sizes[1] > sizes[0]);
            partial += usize::from(sizes[0] < 800);
        }
    }
    assert!(
        places > 20_000 && partial > 1 && more > 4,
        "{places} places, {partial} parts, {more} with falls"
    );
}

#[test]
fn routes_are_shortest_and_are_walked_without_a_stop() {
    let (mut found, mut none, mut gained, mut climbed) = (0, 0, 0.0, 0);
    for seed in 100..130 {
        let up = [Up::Z, Up::NegY, Up::X][usize::try_from(seed).unwrap() % 3];
        let (map, falls) = (random_map(seed, up), seed % 4 == 3);
        let lattice = StepGrid::new(map.grid(), &avatar(), PIXEL);
        let places = standing(&map, seed, 5);
        let (from, start) = places[0];
        let naive = Naive::new(&map, &start, lattice, falls);
        for (to, goal) in &places {
            let told = format!("map {seed}, from {from:?} to {to:?}");
            let expected = naive.length_to(&start, goal);
            match Route::find(&map, &avatar(), [from, *to], falls) {
                Ok(route) => {
                    let shortest = expected.unwrap_or_else(|| panic!("{told}: nobody walks {route:?}"));
                    assert!((route.lattice_length - shortest).abs() < 1e-9, "{told}: {shortest}, {route:?}");
                    assert!(route.length <= route.lattice_length + 1e-9, "{told}: {route:?}");
                    let end = walked(&map, &route.route, falls, &told);
                    assert_eq!(end, route.end, "{told}");
                    found += 1;
                    gained += 1.0 - route.length / route.lattice_length.max(1e-9);
                    let rise = map.grid().up.to_map(end)[2] - map.grid().up.to_map(from)[2];
                    climbed += usize::from(rise.abs() > 1.0);
                }
                Err(RouteError::NoRoute { nearest, away, .. }) => {
                    assert_eq!(expected, None, "{told}");
                    let goal = map.grid().up.to_map(goal.position(map.grid()));
                    let away_of = |p: [f64; 3]| {
                        let p = map.grid().up.to_map(p);
                        (p[0] - goal[0]).hypot(p[1] - goal[1]).hypot(p[2] - goal[2])
                    };
                    let all = Reach::new(&map, &start, falls).unwrap();
                    let own = away_of(start.position(map.grid()));
                    let least = all.positions().map(away_of).fold(own, f64::min);
                    assert!((away - least).abs() < 1e-9 && (away_of(nearest) - away).abs() < 1e-9, "{told}");
                    none += 1;
                }
                Err(other) => panic!("{told}: {other}"),
            }
        }
    }
    assert!(found > 60 && none > 15 && climbed > 3, "{found} found, {climbed} up or down, {none} not");
    assert!(gained > 1.0, "{gained} of {found} lengths saved by shortcuts");
}

/// Walks a route; returns where it ends.
fn walked(map: &SliceMap, route: &Route, falls: bool, told: &str) -> [f64; 3] {
    let mut building = map;
    let mut end = route.stand(&mut building, &avatar()).unwrap().position(map.grid());
    let ended = route.walk(&mut building, &avatar(), &Back, |_, step| {
        assert!(!step.blocked && (falls || !step.falling), "{told}: {step:?}");
        end = step.position;
        Ok::<(), WalkError>(())
    });
    assert_eq!(ended, Ok(Ended::Arrived), "{told}");
    end
}

/// Searches every height of every place.
fn nearest_naive(map: &SliceMap, near: [f64; 3]) -> Option<f64> {
    let grid = map.grid();
    let lattice = StepGrid::new(grid, &avatar(), grid.pixel);
    let [x, y, z] = grid.up.to_map(near);
    let cells =
        (0..lattice.counts[1]).flat_map(|row| (0..lattice.counts[0]).map(move |column| [column, row]));
    let places = cells.map(|cell| lattice.place(cell.map(|i| u32::try_from(i).unwrap())));
    let mut best: Option<f64> = None;
    for [u, v] in places.chain([[x, y]]) {
        for s in 0..grid.counts[2] {
            for level in 0..255 {
                let height = grid.height(s, level);
                let away = (u - x).hypot(v - y).hypot(height - z);
                if best.is_some_and(|best| best <= away) {
                    continue;
                }
                let place = grid.up.from_map([u, v, height]);
                let stays = Walker::new(avatar(), map, place)
                    .is_ok_and(|walker| !walker.is_falling() && walker.position(grid) == place);
                if stays {
                    best = Some(away);
                }
            }
        }
    }
    best
}

#[test]
fn starts_that_do_not_serve_name_the_nearest_place() {
    let mut causes = BTreeMap::new();
    for seed in 0..12 {
        let up = [Up::Z, Up::Y, Up::NegZ][usize::try_from(seed).unwrap() % 3];
        let map = random_map(seed, up);
        let rng = &mut rng(seed);
        for _ in 0..6 {
            let place =
                [rng.random_range(-1.0..5.0), rng.random_range(-1.0..4.0), rng.random_range(-2.5..4.0)];
            let place = up.from_map(place);
            let told = format!("map {seed}, {place:?}");
            match avatar().placed(&map, place) {
                Ok(walker) => {
                    let off = up.to_map(walker.position(map.grid()))[2] - up.to_map(place)[2];
                    assert!(!walker.is_falling() && off.abs() <= avatar().options().climb + 1e-9, "{told}");
                }
                Err(StartError::Misplaced { place: asked, cause, nearest }) => {
                    let nearest = nearest.unwrap();
                    assert_eq!(asked, place, "{told}");
                    assert_eq!(Some(nearest.distance), nearest_naive(&map, place), "{told}: {nearest:?}");
                    let there = avatar().placed(&map, nearest.position).unwrap();
                    assert_eq!(there.position(map.grid()), nearest.position, "{told}");
                    *causes.entry(format!("{cause:?}")).or_insert(0) += 1;
                }
                Err(other) => panic!("{told}: {other}"),
            }
        }
    }
    assert!(causes.len() == 4 && causes.values().all(|count| *count > 1), "{causes:?}");
    // An avatar too large for the map.
    let giant = Avatar::new(&AvatarOptions::default().with_box([0.3; 2], 1.0).with_climb(0.05)).unwrap();
    let map = built(
        &[[0.0; 3], [0.0, 0.0, 0.3], [0.0, 0.0, 0.6], [1.0, 1.0, 0.9], [1.0, 1.0, 0.2]],
        &SliceOptions::default(),
    )
    .unwrap();
    let far = giant.nearest_standing(&map, [1e9, -1e9, 0.0]).unwrap();
    assert!(far.is_some_and(|far| far.distance > 1e9), "{far:?}");
    let refused = giant.placed(&map, [0.0, 0.0, f64::NAN]).unwrap_err();
    assert_eq!(refused, StartError::Walk(WalkError::NotFinite { index: 0 }));
    let refused = avatar().placed(&map, [9.0, 0.0, 0.0]).unwrap_err().to_string();
    assert!(refused.contains("is outside the map; nearest place to stand: ["), "{refused}");
}

#[test]
fn causes_are_told_apart() {
    let floor = patch([0.0, 4.0], [0.0, 3.0], 0.0);
    let wall = (0..24_u8).flat_map(|k| patch([2.0, 2.1], [0.0, 3.0], 0.1 * f64::from(k)));
    let table = patch([3.0, 4.0], [0.0, 3.0], 0.8);
    let points: Vec<[f64; 3]> = floor.chain(wall).chain(table).collect();
    let map = built(&points, &SliceOptions::default().with_pixel(Pixel::Side(PIXEL))).unwrap();
    for (place, expected) in [
        ([2.05, 1.0, 0.0], Misplaced::Obstacle),
        ([3.5, 1.0, 0.0], Misplaced::LowCeiling),
        ([1.0, 1.0, 1.0], Misplaced::Airborne),
        ([1.0, 9.0, 0.0], Misplaced::OffMap),
        ([1.0, 1.0, -9.0], Misplaced::OffMap),
    ] {
        let refused = avatar().placed(&map, place).unwrap_err();
        assert!(matches!(refused, StartError::Misplaced { cause, .. } if cause == expected), "{refused}");
    }
}

#[test]
fn a_house_is_reached_on_both_storeys_by_its_stairs() {
    let points = scanned(&house(), 0.025, 0.003, 11);
    let map = built(&points, &SliceOptions::default().with_pixel(Pixel::Side(0.05))).unwrap();
    let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
    let storeys = map.storeys(&avatar).unwrap();
    let start = avatar.roomy_start(&map, &storeys).unwrap().unwrap();
    let walker = avatar.placed(&map, start.position).unwrap();
    assert_eq!(walker.position(map.grid()), start.position);
    assert_eq!(storey_of(&storeys, start.position[2]), Some(0), "{start:?}");
    let reach = Reach::new(&map, &walker, false).unwrap();
    let covered = reach.by_storey(&storeys);
    assert!(covered.iter().all(|covered| covered.area > 20.0), "{covered:?}");
    let to = [14.0, 9.0, STOREY];
    let found = Route::find(&map, &avatar, [start.position, to], false).unwrap();
    assert!((found.end[2] - STOREY).abs() < 0.02, "{found:?}");
    let middle = 0.5 * (STAIRS[0] + STAIRS[1]);
    let [x, y, _] = start.position;
    let least = (x - 8.0).abs().max((y - middle).abs() - 1.0);
    assert!(found.length > least && found.length < 40.0, "{found:?}");
    assert!(found.route.points.len() < 40, "{} points", found.route.points.len());
}
