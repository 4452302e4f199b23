//! Walks through scanned buildings outside the repository, in the folder that an environment
//! variable names.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nearmiss_geometry::{Aabb, TriangleMesh};
use nearmiss_slices::{
    Avatar, AvatarOptions, Back, Ended, Obstacle, Pixel, Response, Route, SliceBuilder, SliceMap,
    SliceOptions, SlicePlan, Slide, Step, Up, WalkError,
};
use nearmiss_testdata::arbitrary::rng;
use nearmiss_testdata::scenes::{DUNGEON, GALLERY, NAV_TEST, SPONZA, Scene, TWO_STOREYS};
use rand::RngExt;

/// A scene as read, with points on its surface by square metre.
struct Read {
    scene: Scene,
    model: nearmiss_io::Model,
    columns: BTreeMap<[i64; 2], Vec<[f64; 3]>>,
}

impl Read {
    /// Reads the scene. Returns `None`, with a note, if the folder or the file is missing.
    fn new(scene: &Scene) -> Option<Self> {
        let folder = std::env::var_os("NEARMISS_DATA").map(PathBuf::from);
        let Some(path) = folder.map(|folder| folder.join(scene.file)).filter(|path| path.is_file()) else {
            eprintln!("left out: NEARMISS_DATA names no folder with {}", scene.file);
            return None;
        };
        let model = nearmiss_io::read(&path, None).unwrap();
        let up: Up = scene.up.parse().unwrap();
        let points = match &model.mesh {
            Some(mesh) => samples(mesh),
            None => (0..model.cloud.len()).map(|i| model.cloud.point(i)).collect(),
        };
        let mut columns: BTreeMap<[i64; 2], Vec<[f64; 3]>> = BTreeMap::new();
        for p in points.into_iter().map(|p| up.to_map(p)) {
            columns.entry([metre(p[0]), metre(p[1])]).or_default().push(p);
        }
        Some(Self { scene: *scene, model, columns })
    }

    fn route(&self) -> Route {
        serde_json::from_str(self.scene.route).unwrap()
    }

    fn map(&self, pixel: Pixel) -> SliceMap {
        let noise = self.model.mesh.as_ref().map(|_| 0.0);
        let options = SliceOptions::default()
            .with_pixel(pixel)
            .with_up(self.scene.up.parse().unwrap())
            .with_obstacle(Obstacle::Slope { degrees: 45.0, noise });
        let bounds = match &self.model.mesh {
            Some(mesh) => Aabb::of(mesh.triangles().iter().flatten().map(|&v| mesh.vertices()[v as usize])),
            None => self.model.cloud.bounds(),
        };
        let mut builder = SliceBuilder::new(&SlicePlan::new(&options, &bounds).unwrap()).unwrap();
        match &self.model.mesh {
            Some(mesh) => assert!(builder.add_mesh(mesh) > 1_000_000, "samples"),
            None => builder.add_cloud(&self.model.cloud),
        }
        builder.finish()
    }

    /// Walks the route. Checks after every step that the avatar is inside nothing, by the map and
    /// by the points.
    fn walk(&self, pixel: Pixel, route: &Route, response: &dyn Response) -> Walked {
        self.walk_as(&AvatarOptions::default(), &self.map(pixel), route, response)
    }

    /// The same for an avatar of this size.
    fn walk_as(
        &self,
        options: &AvatarOptions,
        map: &SliceMap,
        route: &Route,
        response: &dyn Response,
    ) -> Walked {
        let grid = map.grid();
        let options = options.with_climb(self.scene.climb).with_step(grid.pixel);
        let avatar = Avatar::new(&options).unwrap();
        let mut steps: Vec<Step> = Vec::new();
        let ended = route.walk(&mut &*map, &avatar, response, |_, step| {
            steps.push(*step);
            Ok::<(), WalkError>(())
        });
        let level = grid.slice_height / 255.0;
        let mut near = 0;
        for step in &steps {
            let Aabb { min, max } = avatar.bounds(grid, step.position);
            let Aabb { min: low, max: high } = Aabb::of([min, max].map(|corner| grid.up.to_map(corner)));
            // Between the slice of the feet and that of the head.
            let inner = [low[2], high[2]].map(|z| ((z - grid.origin[2]) / grid.slice_height).floor());
            let wall = |slices: f64, off: f64| grid.origin[2] + slices * grid.slice_height + off;
            let between =
                [[low[0], low[1], wall(inner[0] + 1.0, 1e-9)], [high[0], high[1], wall(inner[1], -1e-9)]];
            let body = Aabb::of(between.map(|corner| grid.up.from_map(corner)));
            assert!(!map.touches(&body).unwrap(), "{}: something in the body at {step:?}", self.scene.file);
            for x in metre(low[0])..=metre(high[0]) {
                for y in metre(low[1])..=metre(high[1]) {
                    let points = self.columns.get(&[x, y]).into_iter().flatten();
                    for p in points.filter(|p| (0..2).all(|k| low[k] < p[k] && p[k] < high[k])) {
                        near += 1;
                        let is_inside = p[2] > low[2] + level && p[2] < high[2] - level;
                        assert!(!is_inside, "{}: {p:?} in the body at {step:?}", self.scene.file);
                    }
                }
            }
        }
        assert!(near > 100 * steps.len(), "{near} points above or below {} steps", steps.len());
        Walked {
            ended: ended.unwrap(),
            heights: steps.iter().map(|step| grid.up.to_map(step.position)[2]).collect(),
            end: steps.last().unwrap().position,
            blocked: steps.iter().filter(|step| step.blocked).count(),
            falling: steps.iter().filter(|step| step.falling).count(),
        }
    }
}

struct Walked {
    ended: Ended,
    heights: Vec<f64>,
    end: [f64; 3],
    blocked: usize,
    falling: usize,
}

impl Walked {
    fn highest(&self) -> f64 {
        self.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    fn lowest(&self) -> f64 {
        self.heights.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Asserts that the walk arrived here without being blocked.
    fn assert_free(&self, end: [f64; 3], off: f64) {
        assert_eq!(self.ended, Ended::Arrived, "ended at {:?}", self.end);
        assert_eq!((self.blocked, self.falling), (0, 0), "blocked and falling");
        assert!((0..3).all(|k| (self.end[k] - end[k]).abs() < off), "ended at {:?}, not {end:?}", self.end);
    }
}

#[expect(clippy::cast_possible_truncation, reason = "buildings are far smaller")]
fn metre(x: f64) -> i64 {
    x.floor() as i64
}

/// Samples points on a mesh evenly by area, some four hundred a square metre.
fn samples(mesh: &TriangleMesh) -> Vec<[f64; 3]> {
    let rng = &mut rng(8);
    let mut points = Vec::new();
    let mut due = 0.0;
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|v| mesh.vertices()[v as usize]);
        let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        due += 200.0 * n.iter().map(|x| x * x).sum::<f64>().sqrt();
        while due >= 1.0 {
            due -= 1.0;
            let (mut s, mut t) = (rng.random::<f64>(), rng.random::<f64>());
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            points.push([0, 1, 2].map(|k| a[k] + s * u[k] + t * v[k]));
        }
    }
    points
}

#[test]
fn an_avatar_climbs_the_real_staircase_and_comes_down_again() {
    let Some(read) = Read::new(&TWO_STOREYS) else { return };
    for pixel in [0.03, 0.04, 0.05, 0.06] {
        let walked = read.walk(Pixel::Side(pixel), &read.route(), &Back);
        walked.assert_free([-9.79, -4.4, -1.28], 0.05);
        assert!((4.4..4.55).contains(&walked.highest()), "pixels of {pixel}: up to {}", walked.highest());
    }
}

/// By the points alone, boxes of these widths fit up to these heights (`anjos2012`, `headroom`).
#[test]
fn who_is_too_high_is_stopped_under_the_ceiling_of_the_real_staircase() {
    let Some(read) = Read::new(&TWO_STOREYS) else { return };
    let map = read.map(Pixel::Side(0.04));
    let mut route = read.route();
    route.points.truncate(route.points.len() / 2);
    for (width, room) in [(0.3, 1.81), (0.4, 1.75), (0.5, 1.61), (0.6, 1.57)] {
        let body = |height: f64| AvatarOptions::default().with_box([width; 2], height);
        let fits = read.walk_as(&body(room - 0.05), &map, &route, &Back);
        fits.assert_free([-9.0, -3.0, 4.47], 0.03);
        let stopped = read.walk_as(&body(room + 0.01), &map, &route, &Back);
        // On the way to the head of the second flight, on its first steps.
        assert!(matches!(stopped.ended, Ended::Stuck { point: 4 | 5 }), "{width} wide, at {:?}", stopped.end);
        assert_eq!((stopped.blocked, stopped.falling), (1, 0), "{width} wide");
        assert!((1.2..2.1).contains(&stopped.end[2]), "{width} wide, at {:?}", stopped.end);
    }
}

/// Half the width of a level patch around a pixel, in pixels; its greatest rise; and the free
/// height above a floor.
const PATCH: i64 = 2;
const LEVEL: f64 = 0.05;
const ROOM: f64 = 1.0;

#[test]
fn few_pixels_of_a_real_floor_are_taken_for_obstacles() {
    let Some(read) = Read::new(&TWO_STOREYS) else { return };
    let map = read.map(Pixel::Side(0.04));
    let grid = map.grid();
    let index = |p: &[f64; 3]| [0, 1].map(|k| metre((p[k] - grid.origin[k]) / grid.pixel));
    let mut heights: BTreeMap<[i64; 2], Vec<f64>> = BTreeMap::new();
    for p in read.columns.values().flatten() {
        heights.entry(index(p)).or_default().push(p[2]);
    }
    let (mut floor, mut obstacles) = (0_u32, 0_u32);
    for ([column, row], own) in &heights {
        // The spread of its own points does not decide whether it is floor.
        let others = (-PATCH..=PATCH).flat_map(|dx| (-PATCH..=PATCH).map(move |dy| [dx, dy]));
        let others = others.filter(|at| *at != [0, 0]).map(|[dx, dy]| [column + dx, row + dy]);
        let others: Vec<&Vec<f64>> = others.filter_map(|at| heights.get(&at)).collect();
        let around = |low: f64, high: f64| {
            others.iter().filter(move |z| z.iter().any(|z| low < *z && *z < high)).count()
        };
        let mut seen = Vec::new();
        for &z in own {
            let voxel = metre((z - grid.origin[2]) / grid.slice_height);
            let is_floor = around(z - LEVEL, z + LEVEL) >= 12
                && around(z + LEVEL, z + ROOM) == 0
                && around(z - 4.0 * LEVEL, z - LEVEL) == 0
                && !own.iter().any(|other| z + 3.0 * LEVEL < *other && *other < z + ROOM);
            if is_floor && !seen.contains(&voxel) {
                seen.push(voxel);
                let [column, row, slice] = [*column, *row, voxel].map(|i| u32::try_from(i).unwrap());
                floor += 1;
                obstacles += u32::from(map.slice(slice).unwrap().pixel(column, row).unwrap().is_obstacle);
            }
        }
    }
    assert!(floor > 100_000, "{floor} pixels of floor");
    assert!(f64::from(obstacles) < 0.02 * f64::from(floor), "{obstacles} of {floor} are obstacles");
}

#[test]
fn an_avatar_goes_to_and_fro_between_the_columns_of_a_court() {
    let Some(read) = Read::new(&SPONZA) else { return };
    for pixel in [Pixel::Side(0.03), Pixel::Count(700), Pixel::Side(0.08)] {
        let walked = read.walk(pixel, &read.route(), &Back);
        walked.assert_free([14.0, 0.09, 0.0], 0.05);
        let (low, high) = (walked.lowest(), walked.highest());
        assert!(high - low < 0.1, "{pixel:?}: a level floor, from {low} to {high}");
    }
}

#[test]
fn an_avatar_goes_around_the_gallery() {
    let Some(read) = Read::new(&GALLERY) else { return };
    let walked = read.walk(Pixel::Count(700), &read.route(), &Back);
    walked.assert_free([0.0, 4.82, 5.5], 0.05);
    // The parapet keeps the avatar from falling into the court.
    let aside = Route { points: vec![[0.0, 0.0]], ..read.route() };
    let walked = read.walk(Pixel::Count(700), &aside, &Back);
    assert_eq!(walked.ended, Ended::Stuck { point: 0 }, "ended at {:?}", walked.end);
    assert_eq!((walked.blocked, walked.falling), (1, 0), "ended at {:?}", walked.end);
    assert!(walked.end[2] > 2.5 && walked.lowest() > 4.7, "ended at {:?}", walked.end);
}

#[test]
fn an_avatar_slides_around_a_column() {
    let Some(read) = Read::new(&SPONZA) else { return };
    // Aslant against the column about (-6.6, -3).
    let past = Route { start: [-9.0, 0.2, -3.3], points: vec![[-4.4, -1.8]] };
    let back = read.walk(Pixel::Count(700), &past, &Back);
    assert_eq!((back.ended, back.blocked), (Ended::Stuck { point: 0 }, 1), "ended at {:?}", back.end);
    let slide = read.walk(Pixel::Count(700), &past, &Slide);
    assert_eq!(
        (slide.ended, slide.blocked, slide.falling),
        (Ended::Arrived, 31, 0),
        "ended at {:?}",
        slide.end
    );
    assert!((slide.end[1] - 0.09).abs() < 0.05, "ended at {:?}", slide.end);
}

#[test]
fn an_avatar_climbs_the_stairs_of_a_dungeon_and_comes_down_again() {
    let Some(read) = Read::new(&DUNGEON) else { return };
    for pixel in [Pixel::Side(0.06), Pixel::Side(0.08), Pixel::Side(0.1)] {
        let walked = read.walk(pixel, &read.route(), &Back);
        walked.assert_free([-12.0, 0.0, 1.0], 0.05);
        assert!((14.9..15.1).contains(&walked.highest()), "{pixel:?}: up to {}", walked.highest());
    }
}

#[test]
fn an_avatar_climbs_a_ramp_and_comes_down_again() {
    let Some(read) = Read::new(&NAV_TEST) else { return };
    for pixel in [Pixel::Side(0.06), Pixel::Side(0.1), Pixel::Count(700)] {
        let walked = read.walk(pixel, &read.route(), &Back);
        walked.assert_free([56.0, -3.3, -4.0], 0.15);
        assert!((7.7..7.9).contains(&walked.highest()), "{pixel:?}: up to {}", walked.highest());
    }
}
