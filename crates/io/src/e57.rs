//! E57 (ASTM E2807): scans of terrestrial scanners, decoded by the crate `e57`.
//!
//! Spherical coordinates are converted to Cartesian ones, and the pose of each scan is applied.
//! Points marked as invalid become NaN, so that indices in the file stay valid.

use std::io::Read;
use std::ops::ControlFlow;

use ::e57::{CartesianCoordinate, E57Reader, PointCloud, PointCloudReaderSimple};

use nearmiss_geometry::Scanner;

use crate::columns::{Holds, Row};
use crate::error::{Broken, Fault};
use crate::guard::guarded;
use crate::input::{Input, Reader, Stop};
use crate::points::Points;
use crate::text::counted;

/// Bytes of the header.
const HEADER: usize = 48;

/// Offset in the header of the length of the XML.
const XML: usize = 32;

/// Offset in the header of the length of a page.
const PAGE: usize = 40;

/// Maximum length of a page in bytes. The standard prescribes 1024.
const LONGEST_PAGE: u64 = 1 << 20;

/// Maximum length of the XML in bytes, as the decoder keeps several copies in memory.
const LONGEST_XML: u64 = 1 << 26;

/// Bytes of a block for each point: a block of `n` bytes is read as `n / 32` points.
const BYTES_A_POINT: usize = 32;

/// Returns the number of points that the file declares.
pub(crate) fn count(input: Input<'_>) -> Option<u64> {
    Some(open(input).ok()?.pointclouds().iter().map(|cloud| cloud.records).sum())
}

/// Returns the scanner position and the points of each scan that has a pose.
pub(crate) fn scanners(input: Input<'_>) -> Result<Vec<Scanner>, Stop> {
    let mut first = 0;
    let mut scanners = Vec::new();
    for cloud in open(input)?.pointclouds() {
        let records = usize::try_from(cloud.records).unwrap_or(usize::MAX);
        let points = first..records.saturating_add(first);
        first = points.end;
        if let Some(pose) = cloud.transform {
            let at = pose.translation;
            scanners.push(Scanner { position: [at.x, at.y, at.z], points });
        }
    }
    Ok(scanners)
}

/// Passes all points of all scans to `take`, in blocks.
pub(crate) fn each(
    input: Input<'_>,
    block: usize,
    take: &mut dyn FnMut(&Points) -> ControlFlow<()>,
) -> Result<(), Stop> {
    let mut reader = open(input)?;
    let clouds = reader.pointclouds();
    // Attributes are kept only if all scans have them.
    let all = |has: fn(&PointCloud) -> bool| !clouds.is_empty() && clouds.iter().all(has);
    let holds = Holds {
        colours: all(PointCloud::has_color),
        intensities: all(PointCloud::has_intensity),
        ..Holds::default()
    };
    let together = (block / BYTES_A_POINT).max(1);
    let mut points = Points::default();
    let mut done = 0;
    for cloud in &clouds {
        if !cloud.has_cartesian() && !cloud.has_spherical() {
            let what = "Cartesian or spherical coordinates of each scan";
            return Err(Fault::Undeclared { what }.at_byte(HEADER).into());
        }
        let wrong = |cause: String| damaged(cause).within("point", done);
        let mut simple = reader.pointcloud_simple(cloud).map_err(|cause| wrong(cause.to_string()))?;
        simple.intensity_to_color(false);
        simple.normalize_intensity(false);
        let mut left = cloud.records;
        while left > 0 {
            points.clear();
            let many = usize::try_from(left).unwrap_or(usize::MAX).min(together);
            // Damaged data may make the decoder panic.
            guarded(|| fill(&mut simple, many, holds, &mut points))
                .unwrap_or_else(|| Err("the decoder panicked".into()))
                .map_err(|cause| damaged(cause).within("point", done + points.len() as u64))?;
            if take(&points).is_break() {
                return Ok(());
            }
            left -= many as u64;
            done += many as u64;
        }
    }
    Ok(())
}

fn damaged(cause: String) -> Broken {
    Fault::Decoder { cause: cause.into() }.at_byte(HEADER)
}

/// Reads the next `many` points of a scan.
fn fill(
    simple: &mut PointCloudReaderSimple<'_, Reader<'_>>,
    many: usize,
    holds: Holds,
    points: &mut Points,
) -> Result<(), String> {
    for _ in 0..many {
        let point = simple.next().ok_or("the scan ends before its last point")?;
        let point = point.map_err(|cause| cause.to_string())?;
        let mut row: Row = [0.0; 11];
        let place = match point.cartesian {
            CartesianCoordinate::Valid { x, y, z } => [x, y, z],
            CartesianCoordinate::Direction { .. } | CartesianCoordinate::Invalid => [f64::NAN; 3],
        };
        row[..3].copy_from_slice(&place);
        if let Some(colour) = point.color {
            row[6..9].copy_from_slice(&[colour.red, colour.green, colour.blue].map(|c| f64::from(c) * 255.0));
        }
        row[9] = point.intensity.map_or(0.0, f64::from);
        points.push(holds, &row);
    }
    Ok(())
}

/// Opens a file after checking the lengths in its header against the length of the file.
fn open(input: Input<'_>) -> Result<E57Reader<Reader<'_>>, Stop> {
    let length = input.length()?;
    let mut header = Vec::new();
    input.reader(0)?.take(HEADER as u64).read_to_end(&mut header)?;
    let number =
        |at: usize| header.get(at..at + 8).and_then(<[u8]>::first_chunk).map(|n| u64::from_le_bytes(*n));
    let (Some(xml), Some(page)) = (number(XML), number(PAGE)) else {
        return Err(Fault::PastEnd.at_byte(header.len()).into());
    };
    for (found, most, at, expected) in [
        (xml, length.min(LONGEST_XML), XML, "XML within the file, of at most 64 MiB"),
        (page, LONGEST_PAGE, PAGE, "pages of at most 1 MiB"),
    ] {
        if found > most {
            return Err(Fault::Expected { expected, found: found.to_string().into() }.at_byte(at).into());
        }
    }
    let source = input.reader(0)?;
    let reader = guarded(|| E57Reader::new(source))
        .ok_or_else(|| damaged("the decoder panicked".into()))?
        .map_err(|cause| damaged(cause.to_string()))?;
    // A point takes at least one bit, unless all points are equal.
    let mut left = u128::from(length) * 8;
    for cloud in reader.pointclouds() {
        let Some(rest) = left.checked_sub(cloud.records.into()) else {
            let points = counted(cloud.records, "point", "points");
            let cause = format!("expected scans that fit into {length} bytes, got {points} in one");
            return Err(damaged(cause).into());
        };
        left = rest;
    }
    Ok(reader)
}
