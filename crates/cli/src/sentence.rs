//! Answers as sentences, with as many digits as the sampling supports.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{
    Aabb, Answer, CollideOptions, Contact, Distance, Evidence, Method, Metric, Placed, PointKind, Reason,
    Semantics, Verdict,
};

use crate::advice;
use crate::digits::{bounds, percent, place, rough, short};
use crate::evidence::word;
use crate::picture::stored_index;

/// Returns the answer to a question with these `options`, as a sentence. It states a clearance only if
/// `distance` is given: the proven gap of a verdict may be much smaller than the distance.
pub(crate) fn sentence(
    answer: &Answer,
    views: [&Placed<'_>; 2],
    options: &CollideOptions,
    distance: Option<&Distance>,
) -> String {
    let unit = unit(views);
    let thickened = match options.semantics {
        Semantics::Thickened(radius) => Some(radius),
        _ => None,
    };
    let margin = (options.margin > 0.0).then(|| short(options.margin));
    match answer.verdict {
        Verdict::Intersecting { contact, evidence } => {
            let at = place(contact.point, unit);
            let apart = rough(points_apart(&contact, views));
            match (thickened, margin) {
                (Some(radius), Some(margin)) => format!(
                    "Balls of radius {} come within {margin} of each other at {at}; the two points are {apart} apart.",
                    short(radius)
                ),
                (Some(radius), None) => {
                    let verb = if radius > 0.0 { "overlap" } else { "meet" };
                    format!(
                        "Balls of radius {} {verb} at {at}; the two points are {apart} apart.",
                        short(radius)
                    )
                }
                (None, Some(margin)) => {
                    format!("They come within {margin} of each other at {at} ({}).", word(evidence))
                }
                (None, None) => format!(
                    "They touch at {at} ({}). The nearest measured points are {apart} apart; {}.",
                    word(evidence),
                    untold(answer.band)
                ),
            }
        }
        Verdict::Separated { gap, evidence } => no_contact((gap, evidence), options, distance, unit),
        Verdict::Undecided(reason) => format!("Cannot tell: {}.", why(reason, views, ["a", "b"], options)),
    }
}

/// Returns a separation as a sentence.
fn no_contact(
    (gap, evidence): (f64, Evidence),
    options: &CollideOptions,
    distance: Option<&Distance>,
    unit: f64,
) -> String {
    let of_points = matches!(options.semantics, Semantics::Thickened(_));
    let found = if gap > 0.0 { "" } else { " found" };
    let within =
        if options.margin > 0.0 { format!(" within {}", short(options.margin)) } else { String::new() };
    let apart = distance.map(|distance| {
        if distance.upper <= 0.0 {
            return "; no clearance is known".to_owned();
        }
        let distance = Distance { lower: distance.lower.max(gap).min(distance.upper), ..*distance };
        let near = if !of_points && distance.upper < distance.band {
            format!(", less than the local spacing of {}", rough(distance.band))
        } else {
            String::new()
        };
        format!("; {}{near}", bracket(&distance, unit))
    });
    format!("No contact{found}{within}{} ({}).", apart.unwrap_or_default(), word(evidence))
}

/// Returns the answer about a mesh and a scan as a sentence, as [`sentence`] does for two scans.
pub(crate) fn against_mesh(
    answer: &Answer,
    (letter, scan): (&str, &Placed<'_>),
    options: &CollideOptions,
    distance: Option<&Distance>,
) -> String {
    let unit = unit([scan; 2]);
    match answer.verdict {
        Verdict::Intersecting { contact, evidence } => {
            let at = place(contact.point, unit);
            let margin = (options.margin > 0.0).then(|| short(options.margin));
            match (options.semantics, margin) {
                (Semantics::Thickened(radius), Some(margin)) => {
                    format!("A ball of radius {} comes within {margin} of the mesh at {at}.", short(radius))
                }
                (Semantics::Thickened(radius), None) => {
                    format!("A ball of radius {} meets the mesh at {at}.", short(radius))
                }
                (_, Some(margin)) => {
                    format!("They come within {margin} of each other at {at} ({}).", word(evidence))
                }
                (_, None) => format!("They touch at {at} ({}); {}.", word(evidence), untold(answer.band)),
            }
        }
        Verdict::Separated { gap, evidence } => no_contact((gap, evidence), options, distance, unit),
        Verdict::Undecided(reason) => {
            format!("Cannot tell: {}.", why(reason, [scan; 2], [letter; 2], options))
        }
    }
}

/// Returns the distance as a clause. The lower bound is rounded down, the upper one up.
pub(crate) fn bracket(found: &Distance, unit: f64) -> String {
    if found.lower.to_bits() == found.upper.to_bits() {
        return format!("{} apart", short(found.upper));
    }
    let [lower, upper] = bounds([found.lower, found.upper], unit);
    if found.lower > 0.0 {
        format!("between {lower} and {upper} apart")
    } else {
        format!("at most {upper} apart")
    }
}

/// Returns a clause about the gaps that are too small to tell apart from contact.
pub(crate) fn untold(band: f64) -> String {
    format!("gaps below {} cannot be distinguished from contact", rough(band))
}

/// Returns the unit to which lengths are rounded: a hundredth of the smaller sampling radius.
pub(crate) fn unit(views: [&Placed<'_>; 2]) -> f64 {
    let [ra, rb] = views.map(world_radius);
    ra.min(rb) / 100.0
}

/// Returns the distance between the two measured points of a contact.
fn points_apart(contact: &Contact, views: [&Placed<'_>; 2]) -> f64 {
    let at = |k: usize| Vector3::from(views[k].point(stored_index(views[k], contact.sources[k])));
    (at(1) - at(0)).norm()
}

/// Returns a hint if the gap between two bounding boxes exceeds the size of both, which is rarely
/// intended.
pub(crate) fn far_apart([a, b]: [Aabb; 2]) -> Option<String> {
    let apart = (0..3).map(|k| (a.min[k] - b.max[k]).max(b.min[k] - a.max[k]).max(0.0).powi(2)).sum::<f64>();
    let apart = apart.sqrt();
    let size = [a, b].map(|bounds| 2.0 * bounds.half_extents().into_iter().fold(0.0, f64::max));
    (apart > size[0].max(size[1])).then(|| {
        format!("hint: the bounding boxes are {} apart; check the frames and poses of both", short(apart))
    })
}

/// Returns the bounds of a posed scan, in world units.
pub(crate) fn world_bounds(view: &Placed<'_>) -> Aabb {
    let frame = view.scan().frame();
    let to_stored = |p: [f64; 3]| [0, 1, 2].map(|k| (p[k] - frame.origin[k]) / frame.scale);
    Aabb::of(view.scan().bounds().corners().map(|p| view.stored_to_world().apply(to_stored(p))))
}

/// Returns the reason for an undecided answer, with remedies. `letters` name the scans.
pub(crate) fn why(
    reason: Reason,
    views: [&Placed<'_>; 2],
    letters: [&str; 2],
    options: &CollideOptions,
) -> String {
    // Obstacles are never undecided for lack of samples, because points that sample no surface are
    // balls.
    let first = match (options.method, options.metric) {
        (_, Some(Metric::Geodesic)) => None,
        (Method::Traversal, _) => Some("leave out --surface-only"),
        _ => Some("use --method traversal"),
    };
    let worse = |share: fn(&Placed<'_>) -> f64| {
        let [of_a, of_b] = views.map(share);
        if of_b > of_a { (letters[1], views[1], of_b) } else { (letters[0], views[0], of_a) }
    };
    let radius = views.map(world_radius).into_iter().fold(0.0, f64::max);
    match reason {
        Reason::Budget { likelihood } => {
            format!("the budget ran out (likelihood of contact {likelihood:.2}); raise --budget or --work")
        }
        Reason::Undersampled => {
            let lines = |v: &Placed<'_>| v.scan().share(PointKind::Line);
            let sparse = |v: &Placed<'_>| v.scan().share(PointKind::Line) + v.scan().share(PointKind::Stray);
            let (name, view, share) = worse(sparse);
            let how = if lines(view) >= 0.5 * share { "sampled as lines" } else { "sampled too sparsely" };
            let ways = advice::for_sparse(view, radius, first);
            let found = format!("{} of {name} is {how}", percent(share));
            if share < 0.2 {
                format!("the points are too sparse where the scans come close ({found}); {ways}")
            } else {
                format!("{found}; {ways}")
            }
        }
        Reason::Ambiguous => {
            let (name, _, share) = worse(|v| v.scan().share(PointKind::Noisy));
            let ways = advice::for_ambiguous(views, radius, first);
            format!(
                "where they meet, the points do not look like a single surface ({} of {name} do not); {ways}",
                percent(share)
            )
        }
        Reason::NoGraph => "the first scan has no graph; prepare it again with `--graph`".to_owned(),
        Reason::Pose => {
            "a pose is not finite, or makes one scan vanishingly small beside the other; check the poses"
                .to_owned()
        }
        _ => "the reason is unknown to this version; update nearmiss".to_owned(),
    }
}

/// Returns a scan's sampling radius, in world units.
pub(crate) fn world_radius(view: &Placed<'_>) -> f64 {
    view.scan().sampling_radius() * view.stored_to_world().scale() / view.scan().frame().scale
}
