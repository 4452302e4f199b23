//! The filters of `preprocess`, which remove points before anything else is done.

use std::fmt::Display;
use std::path::Path;

use clap::Args;
use nearmiss::PointCloud;
use nearmiss::filter::{self, FilterError};
use serde::Serialize;

use crate::console::Console;
use crate::digits::{grouped, grouped_count};
use crate::error::CliError;
use crate::input::pieces;

/// Options that remove points, in the order in which they are applied.
#[derive(Debug, Clone, Default, Args)]
pub struct FilterArgs {
    /// Keep the points within a box, given by its lower and upper corner
    ///
    /// Coordinates are in the units of the input. Filters are applied in the order --crop,
    /// --class, --voxel, --remove-outliers, --min-neighbours.
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", allow_hyphen_values = true, value_parser = parse_crop, help_heading = "Filters")]
    pub crop: Option<CropBox>,
    /// Keep the points of these LAS classes; 2 is ground, 6 is buildings
    #[arg(long, value_name = "C,C,...", value_parser = parse_classes, help_heading = "Filters")]
    pub class: Option<ClassList>,
    /// Keep one point for each cube with edges of this length
    ///
    /// The point nearest to the mean of the cube's points is kept.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = parse_length, help_heading = "Filters")]
    pub voxel: Option<f64>,
    /// Remove isolated points; common values are 16,2
    ///
    /// A point is removed if its mean distance to its K nearest neighbours exceeds the average
    /// of that distance by more than SIGMA standard deviations.
    #[arg(long, value_name = "K,SIGMA", allow_hyphen_values = true, value_parser = parse_outliers, help_heading = "Filters")]
    pub remove_outliers: Option<Outliers>,
    /// Keep the points that have at least N others within the distance R
    #[arg(long, value_name = "N,R", allow_hyphen_values = true, value_parser = parse_neighbours, help_heading = "Filters")]
    pub min_neighbours: Option<LeastNeighbours>,
}

/// A box, given by two corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CropBox {
    /// The lower corner.
    pub min: [f64; 3],
    /// The upper corner.
    pub max: [f64; 3],
}

/// A list of classes of points, by number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClassList(pub Vec<u8>);

/// Parameters of the statistical outlier filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outliers {
    /// Number of neighbours.
    pub k: usize,
    /// Number of standard deviations.
    pub sigma: f64,
}

/// Parameters of the filter of points with few neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeastNeighbours {
    /// Number of neighbours.
    pub n: usize,
    /// Radius within which neighbours count.
    pub radius: f64,
}

/// The number of points that each filter removed; `None` for filters that were not applied.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Filtered {
    #[serde(skip_serializing_if = "Option::is_none")]
    crop: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    class: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    voxel: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    outliers: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    few_neighbours: Option<usize>,
}

impl Filtered {
    /// Creates the counts of the filters that look at single points.
    pub(crate) fn by_point(crop: Option<usize>, class: Option<usize>) -> Self {
        Self { crop, class, ..Self::default() }
    }
}

/// A function that returns the indices of the points to keep.
type Keep<'a> = &'a dyn Fn(&PointCloud) -> Result<Vec<u32>, FilterError>;

impl FilterArgs {
    /// Returns `true` if there is no filter.
    pub(crate) fn is_empty(&self) -> bool {
        let Self { crop, class, voxel, remove_outliers, min_neighbours } = self;
        crop.is_none()
            && class.is_none()
            && voxel.is_none()
            && remove_outliers.is_none()
            && min_neighbours.is_none()
    }

    /// Returns `true` if all filters look at single points, independently of the others.
    pub(crate) fn is_by_point(&self) -> bool {
        let Self { voxel, remove_outliers, min_neighbours, .. } = self;
        voxel.is_none() && remove_outliers.is_none() && min_neighbours.is_none()
    }

    /// Applies the filters to `cloud`, which was read from `path`, on `threads` threads; 0 for all
    /// cores.
    pub(crate) fn apply(
        &self,
        path: &Path,
        cloud: &mut PointCloud,
        threads: usize,
        console: Console,
    ) -> Result<Filtered, CliError> {
        if self.is_empty() {
            return Ok(Filtered::default());
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.or(Err(CliError::Threads(threads)))?.install(|| self.apply_here(path, cloud, console))
    }

    fn apply_here(
        &self,
        path: &Path,
        cloud: &mut PointCloud,
        console: Console,
    ) -> Result<Filtered, CliError> {
        let mut step = |option: String, keep: Keep<'_>| -> Result<usize, CliError> {
            let before = cloud.len();
            let bar = console.spinner(format_args!("{option} of {}", grouped_count(before as u64, "point")));
            let unsuitable = |what: &dyn Display| CliError::UnsuitableFile {
                path: path.to_owned(),
                what: format!("{option}: {what}"),
            };
            let kept = keep(cloud).map_err(|cause| unsuitable(&cause))?;
            *cloud = cloud.select(&kept).map_err(|cause| unsuitable(&cause))?;
            drop(bar);
            let removed = before - cloud.len();
            let (shown, of) = (grouped(removed as u64), grouped_count(before as u64, "point"));
            console.note(format_args!("{option} removed {shown} of {of}"));
            Ok(removed)
        };
        let mut filtered = Filtered::default();
        if let Some(CropBox { min, max }) = self.crop {
            let corners: Vec<String> = min.iter().chain(&max).map(f64::to_string).collect();
            let option = format!("--crop {}", corners.join(","));
            filtered.crop = Some(step(option, &|cloud| filter::crop(cloud, min, max))?);
        }
        if let Some(ClassList(wanted)) = &self.class {
            let numbers: Vec<String> = wanted.iter().map(u8::to_string).collect();
            let option = format!("--class {}", numbers.join(","));
            filtered.class = Some(step(option, &|cloud| filter::classes(cloud, wanted))?);
        }
        if let Some(size) = self.voxel {
            filtered.voxel = Some(step(format!("--voxel {size}"), &|cloud| filter::voxel(cloud, size))?);
        }
        if let Some(Outliers { k, sigma }) = self.remove_outliers {
            let option = format!("--remove-outliers {k},{sigma}");
            filtered.outliers = Some(step(option, &|cloud| filter::remove_outliers(cloud, k, sigma))?);
        }
        if let Some(LeastNeighbours { n, radius }) = self.min_neighbours {
            let option = format!("--min-neighbours {n},{radius}");
            filtered.few_neighbours = Some(step(option, &|cloud| filter::min_neighbours(cloud, n, radius))?);
        }
        Ok(filtered)
    }
}

fn positive(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite())
}

fn parse_length(text: &str) -> Result<f64, String> {
    positive(text).ok_or_else(|| "expected a length of more than zero, in the units of the input".into())
}

pub(crate) fn parse_crop(text: &str) -> Result<CropBox, String> {
    let expected = || "expected six numbers x0,y0,z0,x1,y1,z1, the lower corner first".to_owned();
    let numbers: Option<Vec<f64>> = pieces(text).map(|piece| piece.parse().ok()).collect();
    let numbers = <[f64; 6]>::try_from(numbers.ok_or_else(expected)?).map_err(|_other_count| expected())?;
    let [x0, y0, z0, x1, y1, z1] = numbers;
    let (min, max) = ([x0, y0, z0], [x1, y1, z1]);
    if numbers.iter().any(|x| x.is_nan()) {
        return Err(expected());
    }
    match (0..3).find(|&k| min[k] > max[k]) {
        None => Ok(CropBox { min, max }),
        Some(k) => Err(format!(
            "expected {axis}0 ≤ {axis}1, got {} and {}",
            min[k],
            max[k],
            axis = ["x", "y", "z"][k]
        )),
    }
}

pub(crate) fn parse_classes(text: &str) -> Result<ClassList, String> {
    let classes: Option<Vec<u8>> = pieces(text).map(|piece| piece.parse().ok()).collect();
    let classes = classes.filter(|classes| !classes.is_empty());
    classes.map(ClassList).ok_or_else(|| "expected numbers from 0 to 255, such as 2,6".into())
}

/// Parses a whole number of at least 1, and a positive number.
fn parse_two(text: &str) -> Option<(usize, f64)> {
    let mut pieces = pieces(text);
    let count = pieces.next()?.parse().ok().filter(|n: &usize| *n > 0)?;
    let number = positive(pieces.next()?)?;
    pieces.next().is_none().then_some((count, number))
}

fn parse_outliers(text: &str) -> Result<Outliers, String> {
    let expected =
        "expected K,SIGMA, a number of neighbours of 1 or more and a number of more than zero, such as 16,2";
    parse_two(text).map(|(k, sigma)| Outliers { k, sigma }).ok_or_else(|| expected.into())
}

fn parse_neighbours(text: &str) -> Result<LeastNeighbours, String> {
    let expected =
        "expected N,R, a number of neighbours of 1 or more and a length of more than zero, such as 4,0.1";
    parse_two(text).map(|(n, radius)| LeastNeighbours { n, radius }).ok_or_else(|| expected.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_read_or_refused() {
        let cropped = CropBox { min: [-1.0, 0.0, 0.5], max: [1.0, f64::INFINITY, 2.5] };
        assert_eq!(parse_crop("-1,0,.5,1,inf,2.5"), Ok(cropped));
        for text in ["", "1,2,3", "0,0,0,1,1,nan", "0,0,0,1,1,1,1", "0,0,0,1,-1,1", "a,0,0,1,1,1"] {
            assert!(parse_crop(text).is_err(), "{text}");
        }
        assert_eq!(parse_outliers("16,2.5"), Ok(Outliers { k: 16, sigma: 2.5 }));
        assert_eq!(parse_neighbours("4, 1e-3"), Ok(LeastNeighbours { n: 4, radius: 1e-3 }));
        for text in ["", "4", "0,1", "4,0", "4,-1", "-4,1", "4,inf", "4,nan", "4,1,1", "1.5,1"] {
            assert!(parse_outliers(text).is_err() && parse_neighbours(text).is_err(), "{text}");
        }
        for text in ["0", "-1", "inf", "nan", "1m"] {
            assert!(parse_length(text).is_err(), "{text}");
        }
    }
}
