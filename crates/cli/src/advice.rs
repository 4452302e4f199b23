//! How well a scan is sampled, in words, and what to do if badly.

use nearmiss::{Bandwidth, BuildOptions, Placed, PointHierarchy, PointKind, Scan};

use crate::digits::{percent, rough, short, short_up};
use crate::health::Health;
use crate::report::median;

/// From these shares of the points on a scan gets advice.
const MANY_ON_LINES: f64 = 0.1;
const MANY_SPARSE: f64 = 0.05;
const MANY_OUTLIERS: f64 = 0.001;
const MANY_NOISY: f64 = 0.2;
const MANY_AT_BORDERS: f64 = 0.02;

/// A share in percent, with a digit after the point below one percent.
fn part(share: f64) -> String {
    let is_small = share > 0.0 && share < 0.0095;
    if is_small { format!("{} %", rough((100.0 * share).max(0.01))) } else { percent(share) }
}

/// A line about the scan's health, and some about what ails it.
pub(crate) fn health(scan: &Scan, health: &Health) -> Vec<String> {
    let spacing = f64::from(median(scan.radii())) * scan.frame().scale;
    let reach = short(scan.reach());
    let ball = rough(health.largest_ball);
    let mut kinds = [
        (PointKind::Noisy, "noisy".to_owned()),
        (PointKind::Sparse, format!("sparser than {reach}")),
        (PointKind::Line, "on lines".to_owned()),
        (PointKind::Stray, "strays".to_owned()),
    ]
    .map(|(kind, name)| (scan.share(kind), name));
    kinds.sort_by(|a, b| b.0.total_cmp(&a.0));
    let kinds = kinds.into_iter().filter(|(share, _)| *share > 0.0);
    let kinds: Vec<String> = kinds.map(|(share, name)| format!("{} {name}", part(share))).collect();
    let balls = match (health.balls > 0.0, kinds.is_empty()) {
        (false, _) => String::new(),
        (true, true) => format!(", {} stand for themselves as balls of up to {ball}", part(health.balls)),
        (true, false) => {
            let (balls, kinds) = (part(health.balls), kinds.join(", "));
            format!(", {balls} stand for themselves as balls of up to {ball} ({kinds})")
        }
    };
    let line = format!(
        "health     spacing {}, reach {reach}; {} of the points sample sheets, {} at their borders{balls}",
        short(spacing),
        percent(scan.sheet_share()),
        part(health.border)
    );
    let advice = [
        of_spacing(scan, health),
        of_borders(scan, health),
        of_holes(health),
        of_outliers(scan, health),
        of_lines(scan),
        of_noise(scan),
    ];
    let advice = advice.into_iter().flatten().map(|what| format!("advice     {what}"));
    std::iter::once(line).chain(advice).collect()
}

/// Where some points are much sparser than the rest, or sparser than the reach.
fn of_spacing(scan: &Scan, health: &Health) -> Option<String> {
    let joined = || format!("`preprocess --reach {}`", short_up(health.beyond_reach));
    let sparse = scan.share(PointKind::Sparse);
    let Some(uneven) = &health.uneven else {
        return (sparse > MANY_SPARSE).then(|| {
            format!(
                "{} of the points are sparser than the reach and stand for themselves: {} joins them to surfaces",
                part(sparse),
                joined()
            )
        });
    };
    let told = format!(
        "{} of the points, on about {} of the area, are {} times sparser than the rest, {} instead of {} apart",
        part(uneven.share),
        part(uneven.area),
        rough(uneven.times),
        rough(uneven.spacing),
        rough(uneven.median)
    );
    Some(if uneven.spacing > scan.reach() {
        format!("{told}, and stand for themselves: {} joins them to surfaces", joined())
    } else {
        let (even, less) = (short_up(0.5 * uneven.spacing), short_up(4.0 * uneven.median));
        format!(
            "{told}, so answers near them hold to {} only: try `preprocess --reach {less}`, which bridges less, or \
             `preprocess --voxel {even}`, which evens the spacing",
            rough(uneven.spacing)
        )
    })
}

/// Where sheets end.
fn of_borders(scan: &Scan, health: &Health) -> Option<String> {
    (health.border > MANY_AT_BORDERS).then(|| {
        format!(
            "{} of the points lie at borders of sheets, and space beyond them counts as free: keep clear of it with \
             `collide --margin {}`, or scan from more sides",
            part(health.border),
            short_up(scan.reach())
        )
    })
}

/// Where sheets have holes.
fn of_holes(health: &Health) -> Option<String> {
    let holes = health.holes.as_ref()?;
    let [least, median, most] = holes.widths;
    Some(format!(
        "{} of the points face holes wider than the reach, {} to {} across, which count as free: if they are not \
         open, `collide --thickened {}` closes half of them",
        part(holes.share),
        rough(least),
        rough(most),
        short_up(0.5 * median)
    ))
}

/// Where points lie alone beside much denser ones.
fn of_outliers(scan: &Scan, health: &Health) -> Option<String> {
    (health.outliers > MANY_OUTLIERS).then(|| {
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let count = (health.outliers * scan.len() as f64).round();
        format!(
            "{} of the points, about {count}, are strays far from much denser points, each a ball of up to {}: \
             `preprocess --remove-outliers 8,2` drops them",
            part(health.outliers),
            rough(health.largest_ball)
        )
    })
}

/// Where points lie on lines.
fn of_lines(scan: &Scan) -> Option<String> {
    let share = scan.share(PointKind::Line);
    (share > MANY_ON_LINES).then(|| {
        let wider = wider_along_lines(scan).map_or(String::new(), |option| format!("{option}, or "));
        format!(
            "{} of the points lie on lines, as a spinning LiDAR's do, and stand for themselves: try {wider}`preprocess \
             --reach {}`, or merge several frames before preparing",
            percent(share),
            short_up(2.0 * scan.reach())
        )
    })
}

/// Where no single sheet fits the points.
fn of_noise(scan: &Scan) -> Option<String> {
    let share = scan.share(PointKind::Noisy);
    (share > MANY_NOISY).then(|| {
        let wider = if has_local_bandwidth(scan.plan().options().bandwidth) {
            let h = f64::from(scan.plan().bandwidth(median(scan.radii()))) * scan.frame().scale;
            format!("`preprocess --bandwidth {}` averages over noise", short_up(2.0 * h))
        } else {
            format!("`collide {}` compares balls alone", thickened(scan.sampling_radius()))
        };
        format!(
            "{} of the points do not look like one sheet (noise, thin walls, foliage) and stand for themselves: {wider}",
            percent(share)
        )
    })
}

/// Balls that close the gaps between points `radius` apart.
fn thickened(radius: f64) -> String {
    format!("--thickened {}", short_up(0.5 * radius))
}

/// A larger number of neighbours, where that helps against lines: beside sheets, lines are mostly
/// rings jagged by noise, in which the first few neighbours spread by chance. A scan of little but
/// lines was already searched to 256 neighbours.
fn wider_along_lines(scan: &PointHierarchy) -> Option<String> {
    (scan.share(PointKind::Line) < scan.usable()).then(|| more_neighbours(scan.radius_neighbours())).flatten()
}

/// A larger number of neighbours, worth trying once.
fn more_neighbours(now: u32) -> Option<String> {
    let twice = 2 * BuildOptions::default().radius_neighbours;
    (now < twice).then(|| format!("--radius-neighbours {twice}"))
}

/// Returns `true` if no bandwidth was chosen.
fn has_local_bandwidth(bandwidth: Bandwidth) -> bool {
    matches!(bandwidth, Bandwidth::Local)
}

/// Remedies where points of `view` that sample no sheet leave surfaces in doubt. `radius` is the greater
/// sampling radius of both scans in the world; `first` comes first.
pub(crate) fn for_sparse(view: &Placed<'_>, radius: f64, first: Option<&str>) -> String {
    let scan = view.scan();
    let mut ways: Vec<String> = first.map(Into::into).into_iter().collect();
    if scan.share(PointKind::Line) >= scan.share(PointKind::Stray) {
        ways.extend(wider_along_lines(scan));
        ways.push(thickened(radius));
        ways.push("merge several frames before preparing".to_owned());
    } else {
        ways.extend(
            more_neighbours(scan.radius_neighbours()).map(|option| format!("preprocess with {option}")),
        );
        ways.push(thickened(radius));
        ways.push("a denser scan".to_owned());
    }
    ways.join(", or ")
}

/// Remedies where the points of `views` do not look like one sheet.
pub(crate) fn for_ambiguous(views: [&Placed<'_>; 2], radius: f64, first: Option<&str>) -> String {
    let is_local = views.iter().any(|v| has_local_bandwidth(v.scan().plan().options().bandwidth));
    let mut ways: Vec<String> = first.map(Into::into).into_iter().collect();
    if is_local {
        ways.push("preprocess with a --bandwidth that suits the noise".to_owned());
    }
    ways.push(thickened(radius));
    ways.join(", or ")
}
