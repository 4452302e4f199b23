//! The sampling quality of a scan in words, and advice on how to improve it.

use nearmiss::{Bandwidth, BuildOptions, Placed, PointHierarchy, PointKind, Scan};

use crate::digits::{percent, rough, short, short_up};
use crate::health::Health;
use crate::report::median;

/// Least shares of the points for which advice is given.
const MANY_ON_LINES: f64 = 0.1;
const MANY_SPARSE: f64 = 0.05;
const MANY_OUTLIERS: f64 = 0.0003;
const MANY_NOISY: f64 = 0.2;
const MANY_AT_BORDERS: f64 = 0.02;

/// Returns a share in percent, with two significant digits below one percent, and with a decimal just
/// below 100 percent.
fn part(share: f64) -> String {
    match share {
        ..0.0095 if share > 0.0 => format!("{} %", rough((100.0 * share).max(0.01))),
        0.995..0.9995 => format!("{:.1} %", 100.0 * share),
        _ => percent(share),
    }
}

/// Returns the health line of a scan, followed by lines of advice.
pub(crate) fn health(scan: &Scan, health: &Health) -> Vec<String> {
    let spacing = f64::from(median(scan.radii())) * scan.frame().scale;
    let reach = short(scan.reach());
    let ball = rough(health.largest_ball);
    let mut kinds = [
        (PointKind::Noisy, "noisy".to_owned()),
        (PointKind::Sparse, "sparser than the reach".to_owned()),
        (PointKind::Line, "on lines".to_owned()),
        (PointKind::Stray, "stray".to_owned()),
    ]
    .map(|(kind, name)| (scan.share(kind), name));
    kinds.sort_by(|a, b| b.0.total_cmp(&a.0));
    let kinds = kinds.into_iter().filter(|(share, _)| *share > 0.0);
    let kinds: Vec<String> = kinds.map(|(share, name)| format!("{} {name}", part(share))).collect();
    let kinds = if kinds.is_empty() { String::new() } else { format!(" ({})", kinds.join(", ")) };
    let border = format!("{} lie at its border", part(health.border));
    let balls = format!("{} count as balls of radius up to {ball}{kinds}", part(health.balls));
    let sheets = format!("{} sample a surface", part(scan.sheet_share()));
    let parts = [(scan.sheet_share(), sheets), (health.border, border), (health.balls, balls)];
    let parts = parts.into_iter().filter(|(share, _)| *share > 0.0).map(|(_, text)| text);
    let parts = parts.collect::<Vec<_>>().join(", ").replacen(" %", " % of the points", 1);
    let line = format!("health     spacing {}, reach {reach}; {parts}", short(spacing));
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

/// Returns advice if some points are much sparser than the rest, or sparser than the reach.
fn of_spacing(scan: &Scan, health: &Health) -> Option<String> {
    let joined = || {
        format!(
            "count as balls; to join them to a surface, use `preprocess --reach {}`",
            short_up(health.beyond_reach)
        )
    };
    let sparse = scan.share(PointKind::Sparse);
    let Some(uneven) = &health.uneven else {
        return (sparse > MANY_SPARSE)
            .then(|| format!("{} of the points are sparser than the reach and {}", part(sparse), joined()));
    };
    let told = format!(
        "{} of the points, on about {} of the area, are {} times sparser than the rest (spacing {} instead of {})",
        part(uneven.share),
        part(uneven.area),
        rough(uneven.times),
        rough(uneven.spacing),
        rough(uneven.median)
    );
    Some(if uneven.spacing > scan.reach() {
        format!("{told} and {}", joined())
    } else {
        let (even, less) = (short_up(0.5 * uneven.spacing), short_up(4.0 * uneven.median));
        format!(
            "{told}, so answers near them are accurate to {} only; use `preprocess --reach {less}` to bridge no \
             wider gaps, or `preprocess --voxel {even}` to even out the spacing",
            rough(uneven.spacing)
        )
    })
}

/// Returns advice if many points lie at borders of surfaces.
fn of_borders(scan: &Scan, health: &Health) -> Option<String> {
    (health.border > MANY_AT_BORDERS).then(|| {
        format!(
            "{} of the points lie at borders of surfaces, and the space beyond counts as free; keep clear of it with \
             `collide --margin {}`, or scan from more sides",
            part(health.border),
            short_up(scan.reach())
        )
    })
}

/// Returns advice if surfaces have holes.
fn of_holes(health: &Health) -> Option<String> {
    let holes = health.holes.as_ref()?;
    let [least, median, most] = holes.widths;
    Some(format!(
        "{} of the points lie at holes wider than the reach ({} to {}), which count as free; if the scanned object \
         has no holes there, `collide --thickened {}` closes half of them",
        part(holes.share),
        rough(least),
        rough(most),
        short_up(0.5 * median)
    ))
}

/// Returns advice if there are outliers: isolated points near much denser ones, or scattered in space.
fn of_outliers(scan: &Scan, health: &Health) -> Option<String> {
    (health.outliers > MANY_OUTLIERS).then(|| {
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let count = (health.outliers * scan.len() as f64).round();
        format!(
            "{} of the points (about {count}) are outliers: far from others, and in no surface with them. They count as \
             balls of radius up to {}; to remove them, use `preprocess --remove-outliers 8,2`",
            part(health.outliers),
            rough(health.largest_ball)
        )
    })
}

/// Returns advice if many points lie on lines.
fn of_lines(scan: &Scan) -> Option<String> {
    let share = scan.share(PointKind::Line);
    (share > MANY_ON_LINES).then(|| {
        let wider = wider_along_lines(scan).map(|option| format!("use `preprocess {option}`"));
        let joined = format!("use `preprocess --reach {}`", short_up(2.0 * scan.reach()));
        let remedies = wider.into_iter().chain([joined, MERGE.to_owned()]).collect();
        format!(
            "{} of the points lie on lines, like those of a spinning LiDAR, and count as balls; {}",
            percent(share),
            alternatives(remedies)
        )
    })
}

/// Returns advice if many points do not look like a single surface.
fn of_noise(scan: &Scan) -> Option<String> {
    let share = scan.share(PointKind::Noisy);
    (share > MANY_NOISY).then(|| {
        let wider = if has_local_bandwidth(scan.plan().options().bandwidth) {
            let h = f64::from(scan.plan().bandwidth(median(scan.radii()))) * scan.frame().scale;
            format!("if that is noise, use `preprocess --bandwidth {}` to average over it", short_up(2.0 * h))
        } else {
            format!("use `collide {}` to compare balls instead of surfaces", thickened(scan.sampling_radius()))
        };
        format!(
            "{} of the points do not look like a single surface (noise, thin walls, foliage) and count as balls; {wider}",
            percent(share)
        )
    })
}

/// The advice to merge frames, for points on lines.
const MERGE: &str = "merge several frames before `preprocess`";

/// Joins remedies to "x, y, or z".
fn alternatives(mut remedies: Vec<String>) -> String {
    match remedies.pop() {
        Some(last) if !remedies.is_empty() => format!("{}, or {last}", remedies.join(", ")),
        last => last.unwrap_or_default(),
    }
}

/// Returns the option for balls that close the gaps between points `radius` apart.
fn thickened(radius: f64) -> String {
    format!("--thickened {}", short_up(0.5 * radius))
}

/// Returns the option for more neighbours, if that helps against lines. It does in a scan with
/// surfaces, where noise makes the first few neighbours on a ring spread to both sides by chance.
/// In a scan of little but lines, up to 256 neighbours were searched already.
fn wider_along_lines(scan: &PointHierarchy) -> Option<String> {
    (scan.share(PointKind::Line) < scan.usable()).then(|| more_neighbours(scan.radius_neighbours())).flatten()
}

/// Returns the option for twice the default number of neighbours, if fewer were used.
fn more_neighbours(now: u32) -> Option<String> {
    let twice = 2 * BuildOptions::default().radius_neighbours;
    (now < twice).then(|| format!("--radius-neighbours {twice}"))
}

/// Returns `true` if the bandwidth follows the local spacing, which is the default.
fn has_local_bandwidth(bandwidth: Bandwidth) -> bool {
    matches!(bandwidth, Bandwidth::Local)
}

/// Returns remedies for an undecided answer caused by points of `view` that sample no surface.
/// `radius` is the larger sampling radius of both scans, in world units. The remedy `first` is
/// named first.
pub(crate) fn for_sparse(view: &Placed<'_>, radius: f64, first: Option<&str>) -> String {
    let scan = view.scan();
    let mut ways: Vec<String> = first.map(Into::into).into_iter().collect();
    if scan.share(PointKind::Line) >= scan.share(PointKind::Stray) {
        ways.extend(wider_along_lines(scan).map(|option| format!("use `preprocess {option}`")));
        ways.push(format!("set {}", thickened(radius)));
        ways.push(MERGE.to_owned());
    } else {
        ways.extend(
            more_neighbours(scan.radius_neighbours()).map(|option| format!("use `preprocess {option}`")),
        );
        ways.push(format!("set {}", thickened(radius)));
        ways.push("use a denser scan".to_owned());
    }
    alternatives(ways)
}

/// Returns remedies for an undecided answer caused by points of `views` that do not look like a
/// single surface.
pub(crate) fn for_ambiguous(views: [&Placed<'_>; 2], radius: f64, first: Option<&str>) -> String {
    let is_local = views.iter().any(|v| has_local_bandwidth(v.scan().plan().options().bandwidth));
    let mut ways: Vec<String> = first.map(Into::into).into_iter().collect();
    if is_local {
        ways.push("use `preprocess --bandwidth` with a length that averages over the noise".to_owned());
    }
    ways.push(format!("set {}", thickened(radius)));
    alternatives(ways)
}
