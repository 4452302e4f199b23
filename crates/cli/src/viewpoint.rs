//! The viewpoint of pictures: options for it, and the choice of a default.

use std::str::FromStr;

use clap::Args;
use nearmiss::Placed;
use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::slices::Up;
use nearmiss::surface::symmetric_eigen;
use nearmiss_draw::canvas::{Area, Camera};

/// Options of pictures of scans: the axis that points up, and the viewpoint.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct ViewArgs {
    /// Axis that points up in the picture: x, y, z, -x, -y or -z
    ///
    /// The default is z if the scan looks like a room, building or street: it has level floors and is
    /// wider than high. Other scans are drawn with their longest side horizontal.
    #[arg(
        long,
        value_name = "AXIS",
        allow_hyphen_values = true,
        requires = "image",
        help_heading = "Output"
    )]
    pub up: Option<Up>,
    /// Direction from which the picture is taken, in degrees
    ///
    /// With this option, the default of --up is z. The azimuth is counted anticlockwise as seen from
    /// above. With --up z, azimuth 0 looks from +x and 90 from +y; with --up y, 0 looks from +z and 90
    /// from +x; with --up x, 0 looks from +y and 90 from +z. Elevation 0 is a view from the side, 90
    /// from above.
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION",
        allow_hyphen_values = true,
        requires = "image",
        help_heading = "Output"
    )]
    pub view: Option<Angles>,
}

/// A direction towards the viewer, in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angles {
    /// Angle about the axis that points up, anticlockwise as seen from above.
    pub azimuth: f64,
    /// Angle above the horizon, from -90 to 90.
    pub elevation: f64,
}

impl FromStr for Angles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let read = || {
            let (azimuth, elevation) = text.split_once(',')?;
            let angles =
                Self { azimuth: azimuth.trim().parse().ok()?, elevation: elevation.trim().parse().ok()? };
            (angles.azimuth.is_finite() && (-90.0..=90.0).contains(&angles.elevation)).then_some(angles)
        };
        let expected = "expected AZIMUTH,ELEVATION in degrees, the elevation from -90 to 90, such as 30,20";
        read().ok_or_else(|| expected.into())
    }
}

/// A right-handed frame: two level directions, and the direction that points up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Upright([Vector3<f64>; 3]);

impl Upright {
    fn new(up: Up) -> Self {
        Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| up.from_map(axis).into()))
    }

    pub(crate) fn up(&self) -> Vector3<f64> {
        self.0[2]
    }

    /// Returns the axes of a camera in this direction: to the right, up, and towards the viewer.
    fn axes(&self, Angles { azimuth, elevation }: Angles) -> [Vector3<f64>; 3] {
        let [first, second, up] = self.0;
        let ((sin, cos), (rise, level)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        let toward = (first * cos + second * sin) * level + up * rise;
        let right = second * cos - first * sin;
        [right, toward.cross(&right), toward]
    }

    /// Returns the axes of a camera with the viewer in the direction `toward`, a unit vector.
    pub(crate) fn axes_towards(&self, toward: Vector3<f64>) -> [Vector3<f64>; 3] {
        let [x, y, z] = self.0.map(|axis| axis.dot(&toward));
        let azimuth = y.atan2(x).to_degrees();
        self.axes(Angles { azimuth, elevation: z.clamp(-1.0, 1.0).asin().to_degrees() })
    }
}

/// The range of elevations for upright pictures, as sines, and the preferred one.
const ELEVATIONS: std::ops::Range<f64> = 0.2..0.8;
const LIKED: f64 = 0.5;

/// The direction taken as up if no axis is known to point up.
const ABOUT_UP: [f64; 3] = [0.0, 0.7, 0.7];

/// A placed thing in a picture, as the choice of a viewpoint sees it.
pub(crate) trait Shown {
    /// Returns a sample of at most [`SAMPLE`] of its points in the world.
    fn points(&self) -> Vec<Vector3<f64>>;

    /// Returns the share of its surface with a normal along z.
    fn level_share(&self) -> f64;

    /// Returns its centre in the world.
    fn centre(&self) -> Vector3<f64>;
}

impl Shown for Placed<'_> {
    fn points(&self) -> Vec<Vector3<f64>> {
        (0..self.scan().len()).step_by(stride(self.scan().len())).map(|i| self.point(i).into()).collect()
    }

    fn level_share(&self) -> f64 {
        let normals = || self.scan().normals().iter().step_by(stride(self.scan().len()));
        let is_level =
            |normal: &&[f32; 3]| self.stored_to_world().rotate(normal.map(f64::from))[2].abs() > LEVEL;
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        let share = normals().filter(is_level).count() as f64 / normals().count() as f64;
        share
    }

    fn centre(&self) -> Vector3<f64> {
        self.stored_to_world().apply(self.scan().outline().discs.centre).into()
    }
}

impl ViewArgs {
    /// Returns the frame of an upright picture, or `None` if any orientation will do.
    pub(crate) fn upright<T: Shown>(&self, views: [&T; 2]) -> Option<Upright> {
        let by_default = || (self.view.is_some() || has_level_floors(views)).then_some(Up::Z);
        self.up.or_else(by_default).map(Upright::new)
    }

    /// Returns a camera that shows both scans without outliers, and the places `shown`. If no
    /// direction is given, the camera chooses one with little hidden and the scans beside each
    /// other. `hides` estimates how much is hidden by the given points in a direction towards the
    /// viewer.
    pub(crate) fn camera<T: Shown>(
        &self,
        views: [&T; 2],
        area: Area,
        shown: &[Vector3<f64>],
        hides: impl Fn(&[Vector3<f64>], &Vector3<f64>) -> f64,
    ) -> Camera {
        let points = sample(views);
        let ([long, wide], apart) = extent(&points, views);
        let cost = |toward: &Vector3<f64>| {
            let [long, wide, apart] = [long, wide, apart].map(|axis| toward.dot(&axis).abs());
            hides(&points, toward) + apart + 0.5 * long + 0.25 * wide
        };
        let axes = self.axes(views, cost).unwrap_or_else(|| {
            let cost = |toward: &Vector3<f64>| cost(toward) + below(toward);
            let toward = directions().min_by(|p, q| cost(p).total_cmp(&cost(q))).unwrap_or_else(Vector3::z);
            let right = long - toward * toward.dot(&long);
            let right = if right.norm() > 1e-3 * long.norm() { right.normalize() } else { across(toward) };
            let up = toward.cross(&right);
            if up.y + up.z < 0.0 { [-right, -up, toward] } else { [right, up, toward] }
        });
        fitted(axes, views, shown, area)
    }

    /// Returns a camera that shows `reach` to every side of `centre`. If no direction is given,
    /// `cost` is minimised.
    pub(crate) fn close_camera<T: Shown>(
        &self,
        views: [&T; 2],
        area: Area,
        (centre, reach): (Vector3<f64>, f64),
        cost: impl Fn(&Vector3<f64>) -> f64,
    ) -> Camera {
        let axes = self.axes(views, &cost).unwrap_or_else(|| {
            let cost = |toward: &Vector3<f64>| cost(toward) + 0.3 * below(toward);
            let toward = directions().min_by(|p, q| cost(p).total_cmp(&cost(q))).unwrap_or_else(Vector3::z);
            let up = Vector3::from(ABOUT_UP);
            let up = (up - toward * toward.dot(&up)).try_normalize(0.1).unwrap_or_else(|| across(toward));
            [up.cross(&toward), up, toward]
        });
        Camera { axes, centre, scale: scale_of(area, reach), area }
    }

    /// Returns the axes of an upright camera, or `None` if any orientation will do.
    fn axes<T: Shown>(
        &self,
        views: [&T; 2],
        cost: impl Fn(&Vector3<f64>) -> f64,
    ) -> Option<[Vector3<f64>; 3]> {
        let upright = self.upright(views)?;
        if let Some(angles) = self.view {
            return Some(upright.axes(angles));
        }
        let rise = |toward: &Vector3<f64>| toward.dot(&upright.up());
        let cost = |toward: &Vector3<f64>| cost(toward) + 0.5 * (rise(toward) - LIKED).abs();
        let ways = directions().filter(|toward| ELEVATIONS.contains(&rise(toward)));
        let toward = ways.min_by(|p, q| cost(p).total_cmp(&cost(q))).unwrap_or_else(Vector3::z);
        Some(upright.axes_towards(toward))
    }
}

/// Returns the fine pixels per unit of length if the smaller side of the area shows `2 * reach`.
#[expect(clippy::cast_precision_loss, reason = "pixels")]
pub(crate) fn scale_of(area: Area, reach: f64) -> f64 {
    0.5 * area.width.min(area.height) as f64 / reach
}

/// Returns the sine of the angle by which a direction looks from below, or 0 if it looks from
/// above, with [`ABOUT_UP`] as up.
fn below(toward: &Vector3<f64>) -> f64 {
    (-toward.dot(&Vector3::from(ABOUT_UP))).max(0.0)
}

/// Outliers: `OUTLYING` is the share of a scan's points at either end of an axis that may lie
/// outside the picture. They do so if the picture would otherwise spend more than `SPENT` of its
/// range on them.
const OUTLYING: f64 = 0.003;
const SPENT: f64 = 0.25;

/// Returns a camera with these axes that shows both scans without outliers, and all places `shown`.
fn fitted<T: Shown>(axes: [Vector3<f64>; 3], views: [&T; 2], shown: &[Vector3<f64>], area: Area) -> Camera {
    let mut camera = Camera { axes, centre: Vector3::zeros(), scale: 1.0, area };
    let across = |p: &Vector3<f64>, k: usize| axes[k].dot(p);
    let ranges = [0, 1].map(|k| {
        let of_view = |view: &T| usual(view.points().iter().map(|p| across(p, k)).collect());
        let places = shown.iter().map(|p| [across(p, k); 2]);
        let all = views.into_iter().map(of_view).chain(places);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], [l, h]| [low.min(l), high.max(h)])
    });
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let (width, height) = (area.width as f64, area.height as f64);
    let size = ranges.map(|[low, high]| (high - low).max(f64::MIN_POSITIVE));
    camera.scale = 0.92 * (width / size[0]).min(height / size[1]).min(f64::MAX);
    camera.centre = (0..2).map(|k| axes[k] * (0.5 * (ranges[k][0] + ranges[k][1]))).sum();
    camera
}

/// Returns the range of the values, without outliers if they take up too much of it.
fn usual(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_unstable_by(f64::total_cmp);
    let [Some(&low), Some(&high)] = [values.first(), values.last()] else {
        return [f64::INFINITY, f64::NEG_INFINITY];
    };
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a count"
    )]
    let outlying = (OUTLYING * values.len() as f64) as usize;
    let [least, most] = [values[outlying], values[values.len() - 1 - outlying]];
    let margin = 0.05 * (most - least);
    let inner = [(least - margin).max(low), (most + margin).min(high)];
    if inner[1] - inner[0] < (1.0 - SPENT) * (high - low) { inner } else { [low, high] }
}

/// Floors and ceilings: normals count as theirs if the component along z is at least `LEVEL`. The
/// share is 3 % for evenly spread normals, 12 to 50 % in rooms, buildings and streets, and 2 to 8 %
/// for single objects.
pub(crate) const LEVEL: f64 = 0.97;
const LEVEL_SHARE: f64 = 0.1;

/// Returns `true` if the normals of the larger thing show level floors and its height is not its
/// greatest extent.
fn has_level_floors<T: Shown>(views: [&T; 2]) -> bool {
    let sides = views.map(|view| extents(&view.points()));
    let size = |sides: [f64; 3]| sides.iter().map(|side| side * side).sum::<f64>();
    let (view, [x, y, z]) =
        if size(sides[1]) > size(sides[0]) { (views[1], sides[1]) } else { (views[0], sides[0]) };
    view.level_share() > LEVEL_SHARE && z < x.max(y)
}

/// Returns the sides of the bounding box of some points.
fn extents(points: &[Vector3<f64>]) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let range = points
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[k]), high.max(p[k])]);
        range[1] - range[0]
    })
}

/// The greatest number of points of a thing that are sampled to choose a view.
const SAMPLE: usize = 20_000;

/// Returns the step at which at most [`SAMPLE`] of `count` things are taken.
pub(crate) fn stride(count: usize) -> usize {
    count.div_ceil(SAMPLE).max(1)
}

/// Returns a sample of the points of both things.
pub(crate) fn sample<T: Shown>(views: [&T; 2]) -> Vec<Vector3<f64>> {
    views.into_iter().flat_map(T::points).collect()
}

/// Returns a camera for both scans, with a direction in which little is hidden by the estimate
/// `hides`.
pub(crate) fn whole_camera(
    views: [&Placed<'_>; 2],
    area: Area,
    hides: impl Fn(&[Vector3<f64>], &Vector3<f64>) -> f64,
) -> Camera {
    ViewArgs::default().camera(views, area, &[], hides)
}

/// Returns a camera for one scan.
pub(crate) fn scan_camera(view: &Placed<'_>, area: Area) -> Camera {
    whole_camera([view, view], area, |_, _| 0.0)
}

/// Returns the directions of the greatest and the second extent, and the unit vector from the
/// centre of the first scan to that of the second, or zero if they coincide.
fn extent<T: Shown>(points: &[Vector3<f64>], views: [&T; 2]) -> ([Vector3<f64>; 2], Vector3<f64>) {
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let mut s = [0.0; 6];
    for p in points {
        let [x, y, z]: [f64; 3] = (p - mean).into();
        for (sum, v) in s.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += v;
        }
    }
    let [ca, cb] = views.map(T::centre);
    let apart = (cb - ca).try_normalize(0.0).unwrap_or_default();
    let [_, wide, long] = symmetric_eigen(s).vectors;
    ([long, wide].map(Vector3::from), apart)
}

/// Returns a unit vector perpendicular to `v`.
pub(crate) fn across(v: Vector3<f64>) -> Vector3<f64> {
    let least = v.iamin();
    let axis = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
    v.cross(&axis).normalize()
}

/// Returns directions spread evenly over the sphere, on a Fibonacci spiral.
pub(crate) fn directions() -> impl Iterator<Item = Vector3<f64>> {
    const COUNT: u32 = 128;
    (0..COUNT).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(COUNT);
        let turn = f64::from(i) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let level = (1.0 - z * z).sqrt();
        Vector3::new(level * turn.cos(), level * turn.sin(), z)
    })
}

#[cfg(test)]
mod tests {
    use nearmiss::{BuildOptions, PointCloud, Pose, Scan};

    use super::*;

    const AREA: Area = Area { left: 0, top: 0, width: 400, height: 300 };

    fn scan(points: &[[f64; 3]]) -> Scan {
        Scan::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
    }

    /// Returns a room: a floor and two walls, `height` high.
    fn room(height: u32) -> Scan {
        let grid = |m: u32, n: u32| (0..m).flat_map(move |i| (0..n).map(move |j| [i, j].map(f64::from)));
        let floor = grid(40, 30).map(|[x, y]| [x, y, 0.0]);
        let wall = grid(40, height).map(|[x, z]| [x, 0.0, z + 1.0]);
        let side = grid(30, height).map(|[y, z]| [0.0, y, z + 1.0]);
        scan(&floor.chain(wall).chain(side).collect::<Vec<_>>())
    }

    #[test]
    fn an_upright_camera_maps_up_to_up() {
        let room = room(12);
        let view = room.at(&Pose::IDENTITY);
        for (name, up) in [
            ("x", [1.0, 0.0, 0.0]),
            ("-x", [-1.0, 0.0, 0.0]),
            ("y", [0.0, 1.0, 0.0]),
            ("-y", [0.0, -1.0, 0.0]),
            ("z", [0.0, 0.0, 1.0]),
            ("-z", [0.0, 0.0, -1.0]),
        ] {
            let args = ViewArgs { up: Some(name.parse().unwrap()), view: None };
            let camera = args.camera([&view, &view], AREA, &[], |_, _| 0.0);
            let [right, above, near] = camera.turn(up.into());
            assert!(right.abs() < 1e-12 && above > 0.5 && near > 0.1, "{name}: {right}, {above}, {near}");
            let [x, y, z] = camera.axes;
            assert!((x.cross(&y) - z).norm() < 1e-12, "right-handed");
        }
    }

    #[test]
    fn angles_say_where_the_viewer_is() {
        let room = room(12);
        let view = room.at(&Pose::IDENTITY);
        let toward = |up: Option<&str>, angles: &str| {
            let args = ViewArgs { up: up.map(|up| up.parse().unwrap()), view: Some(angles.parse().unwrap()) };
            args.camera([&view, &view], AREA, &[], |_, _| 0.0).axes
        };
        let half = 0.5_f64.sqrt();
        for (up, angles, expected) in [
            (None, "0,0", [1.0, 0.0, 0.0]),
            (Some("z"), "90,0", [0.0, 1.0, 0.0]),
            (Some("z"), "-90, 45", [0.0, -half, half]),
            (Some("y"), "0,0", [0.0, 0.0, 1.0]),
            (Some("y"), "90,0", [1.0, 0.0, 0.0]),
            (Some("x"), "0,0", [0.0, 1.0, 0.0]),
            (Some("-z"), "0,90", [0.0, 0.0, -1.0]),
        ] {
            let [_, _, toward] = toward(up, angles);
            assert!((toward - Vector3::from(expected)).norm() < 1e-12, "{up:?} {angles}: {toward}");
        }
        // From above and due south, north is up and east is to the right.
        let [right, above, _] = toward(Some("z"), "-90,90");
        assert!((right - Vector3::x()).norm() < 1e-12 && (above - Vector3::y()).norm() < 1e-12);
        for wrong in ["", "30", "30,91", "x,10", "30,20,10", "inf,0"] {
            assert!(wrong.parse::<Angles>().unwrap_err().contains("such as 30,20"), "{wrong}");
        }
    }

    #[test]
    fn outliers_are_left_out_and_places_that_count_are_not() {
        let mut values: Vec<f64> = (0..1000_u32).map(f64::from).collect();
        assert_eq!(usual(values.clone()), [0.0, 999.0]);
        values.push(1e5);
        let [low, high] = usual(values);
        assert!(low == 0.0 && (999.0..1100.0).contains(&high), "{low} to {high}");
        let room = room(12);
        let view = room.at(&Pose::IDENTITY);
        let far = Vector3::new(300.0, -200.0, 50.0);
        let camera = ViewArgs::default().camera([&view, &view], AREA, &[far], |_, _| 0.0);
        for p in [far, Vector3::zeros(), Vector3::new(39.0, 29.0, 0.0)] {
            let [x, y, _] = camera.project(p);
            assert!((0.0..=400.0).contains(&x) && (0.0..=300.0).contains(&y), "{p} at {x}, {y}");
        }
    }

    #[test]
    fn rooms_stand_upright_and_other_things_do_not() {
        let is_upright = |scan: &Scan| {
            let view = scan.at(&Pose::IDENTITY);
            ViewArgs::default().upright([&view, &view]).is_some_and(|upright| upright.up() == Vector3::z())
        };
        assert!(is_upright(&room(12)));
        assert!(!is_upright(&room(60)), "higher than wide");
        let on_edge: Vec<[f64; 3]> =
            (0..900_u32).map(|i| [f64::from(i % 30), 0.0, 0.5 * f64::from(i / 30)]).collect();
        assert!(!is_upright(&scan(&on_edge)), "no floor");
        // A small object in a room does not change the result.
        let (room, thing) = (room(12), scan(&on_edge));
        let small = Pose::from_row_major(
            &[0.1, 0.0, 0.0, 9.0, 0.0, 0.1, 0.0, 9.0, 0.0, 0.0, 0.1, 3.0, 0.0, 0.0, 0.0, 1.0],
            thing.bounds(),
            0.1,
        );
        let views = [room.at(&Pose::IDENTITY), thing.at(&small.unwrap())];
        for pair in [[&views[0], &views[1]], [&views[1], &views[0]]] {
            assert!(ViewArgs::default().upright(pair).is_some());
        }
    }
}
