//! A picture of levels of a hierarchy: a scan under the balls about the samples of all nodes at one depth.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Pose, Scan};

use crate::canvas::{Area, Canvas, Colour, FINE};
use crate::digits::short;
use crate::export::at_depth;
use crate::picture::{Picture, scale_bar, scan_camera, splat};
use crate::report;

/// In fine pixels.
const PANEL: usize = 620 * FINE;
const GAP: usize = 12 * FINE;
const LINE: usize = 22 * FINE;

const GROUND: Colour = [255, 255, 255];
const PANEL_GROUND: Colour = [238, 240, 243];
const INK: Colour = [30, 34, 40];
const OF_SCAN: Colour = [150, 156, 166];

/// Of neighbouring nodes, told apart by eyes that do not see all colours.
const OF_NODES: [Colour; 6] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0]];

/// How much of the scan a ball hides.
const OPACITY: f64 = 0.55;

/// The dot at a sample, in fine pixels.
const DOT: f64 = 4.5;

/// `scan` once for each of `depths`, the root's being 0, under the balls that cover the nodes there, and leaves above it:
/// each node has a colour, its samples are the dots, all its balls have its covering radius.
#[must_use]
pub fn level_picture(scan: &Scan, depths: &[u32]) -> Picture {
    let width = depths.len() * (PANEL + GAP) + GAP;
    let mut canvas = Canvas::new(width, PANEL + 2 * GAP + 3 * LINE, GROUND);
    for (k, &depth) in depths.iter().enumerate() {
        let area = Area { left: GAP + k * (PANEL + GAP), top: GAP, width: PANEL, height: PANEL };
        paint(&mut canvas, scan, depth, area);
    }
    canvas.picture()
}

fn paint(canvas: &mut Canvas, scan: &Scan, depth: u32, area: Area) {
    let view = scan.at(&Pose::IDENTITY);
    let mut camera = scan_camera(&view, area);
    // Room for balls that stick out.
    camera.scale *= 0.82;
    canvas.fill(area, PANEL_GROUND);
    for i in 0..scan.len() {
        canvas.splat(&camera, &splat(&view, i), OF_SCAN);
    }
    let slices = scan.slices();
    let scale = scan.frame().scale;
    let mut balls = Canvas::new(canvas.size().0, canvas.size().1, GROUND);
    let mut dots = Vec::new();
    let mut radii = Vec::new();
    let nodes: Vec<usize> = at_depth(scan, &report::depths(scan), Some(depth)).collect();
    for (k, &node) in nodes.iter().enumerate() {
        let radius = f64::from(slices.covering_radius(node)) * scale;
        let colour = OF_NODES[k % OF_NODES.len()];
        radii.push(radius / scan.sampling_radius());
        for i in slices.samples(node).iter() {
            let centre = Vector3::from(view.point(i));
            balls.ball(&camera, centre, radius, colour);
            dots.push(centre);
        }
    }
    canvas.veil(&balls, area, OPACITY);
    for &centre in &dots {
        let [x, y, _] = camera.project(centre);
        canvas.line(area, [[x, y]; 2], 2.0 * DOT, INK);
    }
    scale_bar(canvas, &camera);
    caption(canvas, depth, [nodes.len(), dots.len()], &mut radii, area);
}

fn caption(canvas: &mut Canvas, depth: u32, [nodes, samples]: [usize; 2], radii: &mut [f64], area: Area) {
    radii.sort_unstable_by(f64::total_cmp);
    let lines = [
        format!("DEPTH {depth}: {nodes} NODES"),
        format!("{samples} SAMPLES, THE DOTS; EACH NODE'S IN ITS COLOUR"),
        format!(
            "BALLS CONTAIN THE SURFACE: RADIUS {} R, THE MEDIAN NODE'S",
            radii.get(radii.len() / 2).map_or_else(String::new, |&r| short(r))
        ),
    ];
    for (k, line) in lines.iter().enumerate() {
        let top = area.top + area.height + GAP / 2 + k * LINE;
        canvas.text([area.left, top], 3 * FINE / 2, INK, line);
    }
}

#[cfg(test)]
mod tests {
    use nearmiss::{BuildOptions, PointCloud};

    use super::*;

    #[test]
    fn a_panel_for_each_depth_and_colours_of_several_nodes() {
        let points: Vec<[f64; 3]> =
            (0..40_u32).flat_map(|i| (0..40).map(move |j| [i, j, 0].map(f64::from))).collect();
        let scan =
            Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap();
        let [one, two] = [&[2][..], &[1, 3]].map(|depths| level_picture(&scan, depths));
        let panel = (PANEL + GAP) / FINE;
        assert_eq!(two.size().0, one.size().0 + panel);
        let reddish = |p: &Picture| p.pixels().chunks(3).filter(|p| p[0] > p[2] + 40).count();
        let bluish = |p: &Picture| p.pixels().chunks(3).filter(|p| p[2] > p[0] + 40).count();
        assert!(reddish(&one) > 1000 && bluish(&one) > 1000, "nodes of several colours");
    }
}
