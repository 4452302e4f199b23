//! A picture of a graph: the distances of all points from one point, along the surface.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::graph::{GeodesicScratch, SurfaceGraph};
use nearmiss::{Pose, Scan};
use nearmiss_draw::canvas::{Area, Camera, Canvas, Colour, FINE};
use nearmiss_draw::legend;
use nearmiss_draw::picture::Picture;

use crate::digits::{count, short};
use crate::picture::{scale_bar, scan_camera, splat};

/// Sizes in fine pixels.
const PANEL: usize = 800 * FINE;
const GAP: usize = 12 * FINE;
const LINE: usize = legend::LINE;

const GROUND: Colour = [255, 255, 255];
const PANEL_GROUND: Colour = [238, 240, 243];
const INK: Colour = [30, 34, 40];
/// The colour of points that no path reaches.
const ELSEWHERE: Colour = [176, 180, 188];
const VIRTUAL: Colour = [214, 39, 40];
const PATH: Colour = [255, 255, 255];

/// Colours from near to far, distinguishable in grey as well.
const FAR: [Colour; 5] = [[253, 231, 37], [94, 201, 98], [33, 145, 140], [59, 82, 139], [68, 1, 84]];

/// The number of rings of equal distance.
const RINGS: f64 = 24.0;

/// Half width of the close view, in sampling radii.
const CLOSE: f64 = 14.0;

/// Share of its colour that a disc behind the edges of the close view keeps.
const PALE: f64 = 0.45;

/// Paints two views of `scan`. The first is coloured by the distance along the graph from point
/// `from`, in rings, with the shortest path to the furthest point. The second shows the edges about
/// point `from`, virtual ones in red.
///
/// Returns `None` if there is no graph or no such point.
#[must_use]
pub fn geodesic_picture(scan: &Scan, from: usize) -> Option<Picture> {
    let graph = scan.graph().filter(|_| from < scan.len())?;
    let ways = Ways::new(scan, graph, from);
    let mut canvas = Canvas::new(2 * PANEL + 3 * GAP, PANEL + 2 * GAP + 2 * LINE, GROUND);
    let area = |k: usize| Area { left: GAP + k * (PANEL + GAP), top: GAP, width: PANEL, height: PANEL };
    let view = scan.at(&Pose::IDENTITY);
    let source = Vector3::from(view.point(from));

    let whole = scan_camera(&view, area(0));
    let mut close = Camera { area: area(1), ..whole };
    close.centre = source;
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let half = 0.5 * PANEL as f64;
    close.scale = half / (CLOSE * scan.sampling_radius());
    for camera in [&whole, &close] {
        canvas.fill(camera.area, PANEL_GROUND);
    }
    for i in 0..scan.len() {
        canvas.splat(&whole, &splat(&view, i), ways.colour(i));
        let disc = splat(&view, i);
        let [x, y, _] = close.project(disc.centre);
        if is_in(close.area, [x, y]) {
            let pale = ways.colour(i).map(|c| blend(255, c, PALE));
            canvas.splat(&close, &disc, pale);
        }
    }
    for pair in ways.path.windows(2) {
        let ends = [pair[0], pair[1]].map(|i| Vector3::from(view.point(i as usize)));
        canvas.edge(&whole, ends, 5.0, PATH, 0.05 * scan.sampling_radius());
    }
    let lift = 0.5 * scan.sampling_radius();
    for (virtual_edges, edges) in [(false, graph.points().edges()), (true, graph.points().virtual_edges())] {
        for [i, j] in edges.edges() {
            let ends = [i, j].map(|i| Vector3::from(view.point(i as usize)));
            let near = ends.iter().any(|&p| {
                let [x, y, _] = close.project(p);
                is_in(close.area, [x, y])
            });
            if near {
                let colour =
                    if virtual_edges { VIRTUAL } else { ways.colour(i as usize).map(|c| blend(0, c, 0.8)) };
                canvas.edge(&close, ends, if virtual_edges { 5.0 } else { 3.0 }, colour, lift);
            }
        }
    }
    for camera in [&whole, &close] {
        let [x, y, _] = camera.project(source);
        canvas.line(camera.area, [[x, y]; 2], 16.0, INK);
        canvas.line(camera.area, [[x, y]; 2], 9.0, PATH);
        scale_bar(&mut canvas, camera);
    }
    let counts = graph.counts();
    let said = [
        [
            format!(
                "Distance from the dot along the surface; a ring each {}.",
                short(ways.furthest / RINGS * ways.unit)
            ),
            format!(
                "White: the shortest path to the furthest point, {} long. Grey: not connected.",
                short(ways.furthest * ways.unit)
            ),
        ],
        [
            "The graph around the dot; red: virtual edges.".to_owned(),
            format!(
                "{}, {} of them virtual; {}.",
                count(counts.edges as u64, "edge"),
                counts.virtual_edges,
                count(counts.components as u64, "component")
            ),
        ],
    ];
    for (k, lines) in said.iter().enumerate() {
        for (row, line) in lines.iter().enumerate() {
            let top = area(k).top + PANEL + GAP / 2 + row * LINE;
            legend::sentence(&mut canvas, [area(k).left, top], PANEL, line);
        }
    }
    Some(canvas.picture())
}

/// Distances along a graph, in stored units.
struct Ways {
    distances: Vec<f64>,
    furthest: f64,
    path: Vec<u32>,
    /// The length of a stored unit, in units of the input.
    unit: f64,
}

impl Ways {
    fn new(scan: &Scan, graph: &SurfaceGraph, from: usize) -> Self {
        let network = graph.network(scan.positions());
        let mut scratch = GeodesicScratch::default();
        let mut distances = vec![f64::INFINITY; scan.len()];
        let source = u32::try_from(from).unwrap_or(u32::MAX);
        let mut last = source;
        for reached in scratch.within(network, source, f32::INFINITY) {
            distances[reached.point as usize] = f64::from(reached.distance);
            last = reached.point;
        }
        let furthest = distances[last as usize].max(f64::MIN_POSITIVE);
        let mut path = Vec::new();
        scratch.path(network, source, last, &mut path);
        Self { distances, furthest, path, unit: scan.frame().scale }
    }

    fn colour(&self, i: usize) -> Colour {
        let share = self.distances[i] / self.furthest;
        if !share.is_finite() {
            return ELSEWHERE;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 3")]
        let step = (share * 4.0).clamp(0.0, 3.0) as usize;
        #[expect(clippy::cast_precision_loss, reason = "0 to 3")]
        let within = (share * 4.0 - step as f64).clamp(0.0, 1.0);
        let ring = (share * RINGS).fract();
        let light = if ring > 0.85 { 0.6 } else { 1.0 };
        std::array::from_fn(|k| blend(0, blend(FAR[step][k], FAR[step + 1][k], within), light))
    }
}

/// Interpolates between two components of a colour.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
fn blend(from: u8, to: u8, share: f64) -> u8 {
    (f64::from(from) + (f64::from(to) - f64::from(from)) * share).round().clamp(0.0, 255.0) as u8
}

#[expect(clippy::cast_precision_loss, reason = "pixels")]
fn is_in(area: Area, [x, y]: [f64; 2]) -> bool {
    let inside = |at: f64, first: usize, size: usize| at >= first as f64 && at <= (first + size) as f64;
    inside(x, area.left, area.width) && inside(y, area.top, area.height)
}

#[cfg(test)]
mod tests {
    use nearmiss::{BuildOptions, GraphOptions, PointCloud};

    use super::*;

    #[test]
    fn rings_of_many_colours_and_a_grey_part_where_no_way_leads() {
        let plate = |x: f64| (0..900_u32).map(move |i| [x + f64::from(i % 30), f64::from(i / 30), 0.0]);
        let cloud = PointCloud::from_positions(&plate(0.0).chain(plate(42.0)).collect::<Vec<_>>()).unwrap();
        let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
        assert!(geodesic_picture(&scan, 0).is_none(), "no graph");
        let scan = scan.with_graph(&cloud, &GraphOptions::default(), None).unwrap();
        assert!(geodesic_picture(&scan, scan.len()).is_none(), "no such point");
        let picture = geodesic_picture(&scan, 0).unwrap();
        let count = |is: fn(&[u8]) -> bool| picture.pixels.chunks(3).filter(|p| is(p)).count();
        assert!(count(|p| p[1] > p[2].saturating_add(60)) > 1000, "near: yellow to green");
        assert!(count(|p| p[2] > p[1].saturating_add(40)) > 1000, "far: blue to violet");
        let ways = Ways::new(&scan, scan.graph().unwrap(), 0);
        let apart = (0..scan.len()).filter(|&i| ways.colour(i) == ELSEWHERE).count();
        assert_eq!(apart, 900, "the other plate");
        assert!(ways.path.len() >= 14, "across the plate");
    }
}
