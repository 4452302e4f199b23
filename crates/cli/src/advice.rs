//! How well a scan is sampled, and what to do if badly.

use nearmiss::{Bandwidth, BuildOptions, PointHierarchy, PointKind, Scan, ScanView};

use crate::digits::{percent, short, short_up};
use crate::report::median;

/// From these shares on a scan gets advice.
const MANY_ON_LINES: f64 = 0.1;
const MANY_ISOLATED: f64 = 0.05;
const MANY_AMBIGUOUS: f64 = 0.2;

/// A line about the scan's health, and some about what ails it.
pub(crate) fn health(scan: &Scan) -> Vec<String> {
    let [lines, ambiguous, isolated] =
        [PointKind::Line, PointKind::Noisy, PointKind::Stray].map(|kind| scan.share(kind));
    let spacing = f64::from(median(scan.radii())) * scan.frame().scale;
    let mut said = vec![format!(
        "health     spacing {}; {} of the points usable ({} at borders), {} sampled as lines, {} ambiguous, \
         {} isolated",
        short(spacing),
        percent(scan.usable()),
        percent(scan.share(PointKind::Edge)),
        percent(lines),
        percent(ambiguous),
        percent(isolated)
    )];
    let mut advise = |what: String| said.push(format!("advice     {what}"));
    let balls = thickened(scan.sampling_radius());
    if lines > MANY_ON_LINES {
        let wider = wider_along_lines(scan).map_or(String::new(), |option| format!("{option}, or "));
        advise(format!(
            "{} of the points lie on lines, as a spinning LiDAR's do: try {wider}`collide {balls}`, or merge \
             several frames before preparing",
            percent(lines)
        ));
    }
    if isolated > MANY_ISOLATED {
        let wider = more_neighbours(scan.radius_neighbours());
        let wider = wider.map_or(String::new(), |option| format!("try {option}, or "));
        advise(format!(
            "{} of the points have too few neighbours: {wider}remove outliers first",
            percent(isolated)
        ));
    }
    if ambiguous > MANY_AMBIGUOUS {
        let wider = if has_local_bandwidth(scan.plan().options().bandwidth) {
            let h = f64::from(scan.plan().bandwidth(median(scan.radii()))) * scan.frame().scale;
            format!("--bandwidth {}, or ", short_up(2.0 * h))
        } else {
            String::new()
        };
        advise(format!(
            "{} of the points do not look like one sheet (noise, thin walls, foliage): try {wider}`collide \
             {balls}`",
            percent(ambiguous)
        ));
    }
    said
}

/// Balls that close the gaps between points `radius` apart.
fn thickened(radius: f64) -> String {
    format!("--thickened {}", short_up(0.5 * radius))
}

/// A larger number of neighbours, where that helps against lines. Among usable points lines are rings jagged by noise,
/// in which the first few neighbours spread by chance and radii stay small; a scan of little but lines has been
/// searched to 256 neighbours already.
fn wider_along_lines(scan: &PointHierarchy) -> Option<String> {
    (scan.share(PointKind::Line) < scan.usable()).then(|| more_neighbours(scan.radius_neighbours())).flatten()
}

/// A larger number of neighbours, worth trying once.
fn more_neighbours(now: u32) -> Option<String> {
    let twice = 2 * BuildOptions::default().radius_neighbours;
    (now < twice).then(|| format!("--radius-neighbours {twice}"))
}

/// Whoever has chosen a bandwidth need not be told to choose one.
fn has_local_bandwidth(bandwidth: Bandwidth) -> bool {
    matches!(bandwidth, Bandwidth::Local)
}

/// What would help where `view`, called `name`, has too few points, a `share` of which are lines or isolated.
/// `radius` is the greater sampling radius of both scans in the world.
pub(crate) fn for_sparse(view: &ScanView<'_>, radius: f64, thickened_already: bool) -> String {
    let scan = view.scan();
    let mut ways = Vec::new();
    let balls = (!thickened_already).then(|| thickened(radius));
    if scan.share(PointKind::Line) >= scan.share(PointKind::Stray) {
        ways.extend(wider_along_lines(scan));
        ways.extend(balls);
        ways.push("merge several frames before preparing".to_owned());
    } else {
        ways.extend(
            more_neighbours(scan.radius_neighbours()).map(|option| format!("preprocess with {option}")),
        );
        ways.extend(balls);
        ways.push("a denser scan".to_owned());
    }
    ways.join(", or ")
}

/// What would help where the points of `views` do not look like one sheet.
pub(crate) fn for_ambiguous(views: [&ScanView<'_>; 2], radius: f64, thickened_already: bool) -> String {
    let is_local = views.iter().any(|v| has_local_bandwidth(v.scan().plan().options().bandwidth));
    let mut ways = Vec::new();
    if is_local {
        ways.push("preprocess with a --bandwidth that suits the noise".to_owned());
    }
    if !thickened_already {
        ways.push(thickened(radius));
    }
    if ways.is_empty() {
        ways.push("a scan with less noise".to_owned());
    }
    ways.join(", or ")
}
