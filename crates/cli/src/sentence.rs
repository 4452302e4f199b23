//! Answers for people, with as many digits as the sampling carries.

use nearmiss::{Aabb, Answer, CollideOptions, Evidence, PointKind, Reason, ScanView, Semantics, Verdict};

use crate::advice;
use crate::digits::{percent, place, rough, rounded, rounded_down, short};
use crate::report::word;

/// The answer, to a question with these `options`, as a sentence.
pub(crate) fn sentence(answer: &Answer, views: [&ScanView<'_>; 2], options: &CollideOptions) -> String {
    let [ra, rb] = views.map(world_radius);
    let unit = ra.min(rb) / 100.0;
    let thickened = match options.semantics {
        Semantics::Thickened(radius) => Some(radius),
        _ => None,
    };
    let margin = (options.margin > 0.0).then(|| short(options.margin));
    match answer.verdict {
        Verdict::Intersecting { contact, evidence } => {
            let at = place(contact.point, unit);
            if let Some(radius) = thickened {
                let apart = 2.0 * contact.residual;
                if let Some(margin) = margin {
                    return format!(
                        "Balls of radius {} come within {margin} of each other at {at}; the two points are {} apart.",
                        short(radius),
                        short(apart)
                    );
                }
                let verb = if radius > 0.0 { "overlap" } else { "meet" };
                return format!(
                    "Balls of radius {} {verb} at {at}; the two points are {} apart.",
                    short(radius),
                    short(apart)
                );
            }
            if let Some(margin) = margin {
                return format!("They come within {margin} of each other at {at} ({}).", word(evidence));
            }
            let within = match evidence {
                Evidence::Certified => rough(contact.residual),
                Evidence::Estimated => rounded(contact.residual.max(unit), unit),
            };
            format!("They touch at {at}, within {within} ({}).", word(evidence))
        }
        Verdict::Separated { gap, evidence } if gap > 0.0 => {
            format!("No contact; at least {} apart ({}).", rounded_down(gap, unit), word(evidence))
        }
        Verdict::Separated { evidence, .. } => {
            let within = margin.map_or(String::new(), |margin| format!(" within {margin}"));
            format!("No contact found{within} ({}).", word(evidence))
        }
        Verdict::Undecided(reason) => {
            format!("Cannot tell: {}.", doubt(reason, views, thickened.is_some()))
        }
    }
}

/// Two scans further from each other than they are large are rarely meant to be.
pub(crate) fn hint(answer: &Answer, views: [&ScanView<'_>; 2]) -> Option<String> {
    if !answer.verdict.is_separated() {
        return None;
    }
    let [a, b] = views.map(world_bounds);
    let apart = (0..3).map(|k| (a.min[k] - b.max[k]).max(b.min[k] - a.max[k]).max(0.0).powi(2)).sum::<f64>();
    let apart = apart.sqrt();
    let size = [a, b].map(|bounds| 2.0 * bounds.half_extents().into_iter().fold(0.0, f64::max));
    (apart > size[0].max(size[1]))
        .then(|| format!("hint: their bounds are {} apart; are both in the same frame?", short(apart)))
}

/// Bounds, in the world, of the bounds of a scan.
fn world_bounds(view: &ScanView<'_>) -> Aabb {
    let frame = view.scan().frame();
    let to_stored = |p: [f64; 3]| [0, 1, 2].map(|k| (p[k] - frame.origin[k]) / frame.scale);
    Aabb::of(view.scan().bounds().corners().map(|p| view.placed().apply(to_stored(p))))
}

/// Why there is no verdict, and what would help.
fn doubt(reason: Reason, views: [&ScanView<'_>; 2], thickened: bool) -> String {
    let worse = |share: fn(&ScanView<'_>) -> f64| {
        let [of_a, of_b] = views.map(share);
        if of_b > of_a { ("b", views[1], of_b) } else { ("a", views[0], of_a) }
    };
    let radius = views.map(world_radius).into_iter().fold(0.0, f64::max);
    match reason {
        Reason::Budget { likelihood } => {
            format!(
                "the budget ran out first, contact has a likelihood of about {likelihood:.2}; try a greater --budget or --work"
            )
        }
        Reason::Undersampled => {
            let lines = |v: &ScanView<'_>| v.scan().share(PointKind::Line);
            let sparse =
                |v: &ScanView<'_>| v.scan().share(PointKind::Line) + v.scan().share(PointKind::Stray);
            let (name, view, share) = worse(sparse);
            let how = if lines(view) >= 0.5 * share { "sampled as lines" } else { "sampled too sparsely" };
            let ways = advice::for_sparse(view, radius, thickened);
            let near = if share < 0.2 {
                "they come near each other only where points say too little, and "
            } else {
                ""
            };
            format!("{near}{} of {name} is {how}; try {ways}", percent(share))
        }
        Reason::Ambiguous => {
            let (name, _, share) = worse(|v| v.scan().share(PointKind::Noisy));
            let ways = advice::for_ambiguous(views, radius, thickened);
            format!(
                "where they meet the points do not look like one sheet, as do {} of {name}; try {ways}",
                percent(share)
            )
        }
        Reason::NoGraph => {
            "the first scan has no graph to search along; prepare it without --no-graph".to_owned()
        }
        Reason::Pose => "a pose is not finite or makes one object vanish beside the other".to_owned(),
        _ => "for a reason that this program does not know; update it".to_owned(),
    }
}

/// A scan's sampling radius in the world.
pub(crate) fn world_radius(view: &ScanView<'_>) -> f64 {
    view.scan().sampling_radius() * view.placed().scale() / view.scan().frame().scale
}
