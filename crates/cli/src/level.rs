//! A picture of levels of a hierarchy: a scan under the covering balls of all nodes at one depth.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Pose, Scan};
use nearmiss_draw::canvas::{Area, Canvas, Colour, FINE};
use nearmiss_draw::legend;
use nearmiss_draw::picture::Picture;

use crate::digits::{count, short};
use crate::export::at_depth;
use crate::picture::{scale_bar, scan_camera, splat};
use crate::report;

/// Sizes in fine pixels.
const PANEL: usize = 620 * FINE;
const GAP: usize = 12 * FINE;
const LINE: usize = legend::LINE;

const GROUND: Colour = [255, 255, 255];
const PANEL_GROUND: Colour = [238, 240, 243];
const INK: Colour = [30, 34, 40];
const OF_SCAN: Colour = [150, 156, 166];

/// Colours of nodes, distinguishable by colour-blind readers.
const OF_NODES: [Colour; 6] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0]];

/// Opacity of the balls over the scan.
const OPACITY: f64 = 0.55;

/// Width of the dot at a sample, in fine pixels. It is halved if there are more than `MANY` dots.
const DOT: f64 = 9.0;
const MANY: usize = 1000;

/// Paints `scan` once for each of `depths`; the root has depth 0. The covering balls of the nodes
/// at that depth, and of leaves above it, lie over the scan. Each node has a colour. Its samples
/// are dots, and all its balls have its covering radius.
#[must_use]
pub fn level_picture(scan: &Scan, depths: &[u32]) -> Picture {
    let width = depths.len() * (PANEL + GAP) + GAP;
    let mut canvas = Canvas::new(width, PANEL + 2 * GAP + 3 * LINE, GROUND);
    let all = report::depths(scan.topology());
    let levels = depths.iter().map(|&depth| (depth, at_depth(scan, &all, Some(depth)).collect()));
    let levels: Vec<(u32, Vec<usize>)> = levels.collect();
    let nodes = levels.iter().flat_map(|(_, nodes)| nodes);
    let most = nodes.map(|&node| radius(scan, node)).fold(0.0, f64::max);
    for (k, (depth, nodes)) in levels.iter().enumerate() {
        let area = Area { left: GAP + k * (PANEL + GAP), top: GAP, width: PANEL, height: PANEL };
        canvas.fill(area, PANEL_GROUND);
        paint(&mut canvas, scan, nodes, most, area);
        caption(&mut canvas, scan, *depth, nodes, area);
    }
    canvas.picture()
}

/// Returns the covering radius of a node, in the units of the input.
fn radius(scan: &Scan, node: usize) -> f64 {
    f64::from(scan.arrays().covering_radius(node)) * scan.frame().scale
}

/// Paints the scan and the balls of `nodes`, with a margin for balls of radius `most`.
fn paint(canvas: &mut Canvas, scan: &Scan, nodes: &[usize], most: f64, area: Area) {
    let view = scan.at(&Pose::IDENTITY);
    let mut camera = scan_camera(&view, area);
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let width = PANEL as f64;
    camera.scale *= width / (width + 2.0 * most * camera.scale);
    for i in 0..scan.len() {
        canvas.splat(&camera, &splat(&view, i), OF_SCAN);
    }
    let (columns, rows) = canvas.size();
    let mut balls = Canvas::new(columns, rows, GROUND);
    let mut dots = Vec::new();
    for (k, &node) in nodes.iter().enumerate() {
        for i in scan.arrays().samples(node).iter() {
            let centre = Vector3::from(view.point(i));
            balls.ball(&camera, centre, radius(scan, node), OF_NODES[k % OF_NODES.len()]);
            dots.push(centre);
        }
    }
    canvas.veil(&balls, area, OPACITY);
    let dot = if dots.len() > MANY { 0.5 * DOT } else { DOT };
    for centre in dots {
        let [x, y, _] = camera.project(centre);
        canvas.line(area, [[x, y]; 2], dot, INK);
    }
    scale_bar(canvas, &camera);
}

fn caption(canvas: &mut Canvas, scan: &Scan, depth: u32, nodes: &[usize], area: Area) {
    let mut radii: Vec<f64> = nodes.iter().map(|&node| radius(scan, node) / scan.sampling_radius()).collect();
    radii.sort_unstable_by(f64::total_cmp);
    let median = radii.get(radii.len() / 2).map_or_else(String::new, |&r| short(r));
    let samples: usize = nodes.iter().map(|&node| scan.arrays().samples(node).len()).sum();
    let lines = [
        format!("{} at depth {depth}, each in a colour", count(nodes.len() as u64, "node")),
        format!("dots: their {}", count(samples as u64, "sample")),
        format!("balls: covering radii, median {median} sampling radii"),
    ];
    for (k, line) in lines.iter().enumerate() {
        let top = area.top + area.height + GAP / 2 + k * LINE;
        legend::sentence(canvas, [area.left, top], area.width, line);
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
        let reddish = |p: &Picture| p.pixels.chunks(3).filter(|p| p[0] > p[2].saturating_add(40)).count();
        let bluish = |p: &Picture| p.pixels.chunks(3).filter(|p| p[2] > p[0].saturating_add(40)).count();
        assert!(reddish(&one) > 1000 && bluish(&one) > 1000, "nodes of several colours");
    }
}
