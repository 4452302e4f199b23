//! Error messages of places, searches and routes.

use std::path::Path;

use nearmiss::slices::{Grid, RouteError, Standing, StartError, WalkError};

use crate::digits::{rounded, short};
use crate::error::CliError;

/// Formats a place as the options take it, to a hundredth of a pixel.
pub(super) fn told_place(place: [f64; 3], grid: &Grid) -> String {
    let told = place.map(|x| {
        let digits = rounded(x, 1e-2 * grid.pixel);
        let is_decimal = digits.contains('.') && !digits.contains('e');
        if is_decimal { digits.trim_end_matches('0').trim_end_matches('.').to_owned() } else { digits }
    });
    format!("[{}]", told.join(", "))
}

/// Returns the error of a place, which `what` names, for a map or a route in `path`.
pub(super) fn misplaced(path: &Path, what: &str, grid: &Grid, cause: &StartError) -> CliError {
    let unsuitable = |what: String| CliError::UnsuitableFile { path: path.to_owned(), what };
    match cause {
        StartError::Misplaced { place, cause, nearest: Some(Standing { position, distance }) } => {
            let [place, nearest] = [*place, *position].map(|place| told_place(place, grid));
            unsuitable(format!(
                "{what} {place} {cause}; nearest place to stand: {nearest}, {} away",
                short(*distance)
            ))
        }
        StartError::Misplaced { place, cause, nearest: None } => {
            let place = told_place(*place, grid);
            unsuitable(format!(
                "{what} {place} {cause}; this avatar can stand nowhere on the map; give a smaller one"
            ))
        }
        StartError::Walk(cause) => refused(path, cause),
        other => unsuitable(other.to_string()),
    }
}

/// Returns the error of a search.
pub(super) fn refused(path: &Path, cause: &WalkError) -> CliError {
    match cause {
        WalkError::TooManyPlaces { .. } | WalkError::TooMuchWork { .. } => CliError::Usage(cause.to_string()),
        _ => CliError::UnsuitableFile { path: path.to_owned(), what: cause.to_string() },
    }
}

/// Returns the error of a route.
pub(super) fn no_route(path: &Path, grid: &Grid, cause: &RouteError) -> CliError {
    match cause {
        RouteError::Start(cause) => misplaced(path, "start", grid, cause),
        RouteError::Goal(StartError::Misplaced { place, cause, nearest: Some(nearest) }) => {
            let [place, reached] = [*place, nearest.position].map(|place| told_place(place, grid));
            CliError::UnsuitableFile {
                path: path.to_owned(),
                what: format!(
                    "goal {place} {cause}; nearest place within reach of the start: {reached}, {} away",
                    short(nearest.distance)
                ),
            }
        }
        RouteError::Goal(cause) => misplaced(path, "goal", grid, cause),
        RouteError::NoRoute { from, to, nearest, away } => {
            let [from, to, nearest] = [*from, *to, *nearest].map(|place| told_place(place, grid));
            CliError::UnsuitableFile {
                path: path.to_owned(),
                what: format!(
                    "no route from {from} to {to}: the avatar gets as near as {} to the goal, at {nearest}; give \
                     another goal, a smaller avatar or a greater climb",
                    short(*away)
                ),
            }
        }
        RouteError::Walk(cause) => refused(path, cause),
        other => CliError::UnsuitableFile { path: path.to_owned(), what: other.to_string() },
    }
}
