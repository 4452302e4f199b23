//! Scans: preparing, opening, saving.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use nearmiss::{BuildOptions, CloudError, GraphOptions, PointCloud};

use crate::file::{check, unloadable, unreadable, unwritable};
use crate::handle::{Handle, free, get, make, opaque};
use crate::pointer::{fill, path, slice, write};
use crate::status::{Failure, Status, guard};

/// A prepared scan. Any number of threads may use one at the same time.
#[derive(Debug)]
pub struct Scan(Handle<nearmiss::Scan>);

opaque!(Scan of nearmiss::Scan as b"nm-scan.");

/// How a scan is prepared. Start from `nearmiss_prepare_options`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct PrepareOptions {
    /// The widest gap that is bridged, a length; 0 to estimate it.
    pub reach: f64,
    /// A point's spacing is the distance of this neighbour: 3 to 32, 6 by default.
    pub radius_neighbours: u32,
    /// Not 0: points that are not finite are dropped; otherwise they are refused.
    pub drop_invalid: i32,
    /// Not 0: a graph over the points turns the normals outwards. Takes as long again.
    pub graph: i32,
}

/// Facts about a scan. Lengths are in the units of its input.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ScanAbout {
    /// The number of points.
    pub points: u64,
    /// The least corner of the bounds of the points. The obstacle, and so a hit of a ray, may exceed them
    /// by up to `reach`.
    pub min: [f64; 3],
    /// The greatest corner of the bounds.
    pub max: [f64; 3],
    /// The 0.9-quantile of the local radii.
    pub sampling_radius: f64,
    /// The widest gap that is bridged.
    pub reach: f64,
    /// The input points that were dropped, as they were not finite.
    pub not_finite: u64,
    /// The input points that were dropped, as they repeat others.
    pub duplicate: u64,
    /// True if the normals point outwards.
    pub is_oriented: bool,
}

const DEFAULT: PrepareOptions =
    PrepareOptions { reach: 0.0, radius_neighbours: 6, drop_invalid: 0, graph: 0 };

/// Returns the default options. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_prepare_options() -> PrepareOptions {
    DEFAULT
}

/// Prepares a cloud.
pub(crate) fn prepare(cloud: &PointCloud, options: &PrepareOptions) -> Result<nearmiss::Scan, Failure> {
    let mut build = BuildOptions::default().with_radius_neighbours(options.radius_neighbours);
    if options.reach != 0.0 {
        build = build.with_reach(options.reach);
    }
    let scan = nearmiss::Scan::build(cloud, &build).map_err(Failure::argument)?;
    if options.graph == 0 {
        return Ok(scan);
    }
    scan.with_graph(cloud, &GraphOptions::default(), None).map_err(Failure::argument)
}

fn of_points<T: nearmiss::geometry::Coordinate>(
    points: &[[T; 3]],
    options: Option<&PrepareOptions>,
) -> Result<nearmiss::Scan, Failure> {
    let options = options.unwrap_or(&DEFAULT);
    let cloud = if options.drop_invalid == 0 {
        PointCloud::from_positions(points)
    } else {
        PointCloud::cleaned(points)
    };
    let cloud = cloud.map_err(|cause| match cause {
        CloudError::NotFinite { index } => Failure::argument(format_args!(
            "expected finite coordinates, got NaN or infinity (point {index}); drop such points with the option \
             `drop_invalid`"
        )),
        cause => Failure::argument(cause),
    })?;
    prepare(&cloud, options)
}

/// Prepares `count` points, three numbers each, and writes the handle to `out`. `options` may be null.
/// Takes about 1.5 s for a million points on two cores. Thread safety: any thread.
///
/// # Safety
/// `points` are `3 · count` numbers, and all pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_from_points(
    points: *const f64,
    count: usize,
    options: Option<&PrepareOptions>,
    out: Option<&mut MaybeUninit<*mut Scan>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the numbers; three in a row are one array.
            of_points(unsafe { slice(points.cast::<[f64; 3]>(), count, "points") }?, options)
        })
    })
}

/// Like `nearmiss_scan_from_points`, with numbers in single precision. Thread safety: any thread.
///
/// # Safety
/// As for `nearmiss_scan_from_points`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_from_floats(
    points: *const f32,
    count: usize,
    options: Option<&PrepareOptions>,
    out: Option<&mut MaybeUninit<*mut Scan>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the numbers; three in a row are one array.
            of_points(unsafe { slice(points.cast::<[f32; 3]>(), count, "points") }?, options)
        })
    })
}

/// Reads and prepares a file of points: PLY, PCD, LAS, LAZ, E57, NPY, OBJ, STL, OFF, glTF or text.
/// `options` may be null; invalid points are dropped. Thread safety: any thread.
///
/// # Safety
/// `file` is null or text that ends with a zero byte; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_read(
    file: *const c_char,
    options: Option<&PrepareOptions>,
    out: Option<&mut MaybeUninit<*mut Scan>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the text.
            let model = nearmiss::io::read(unsafe { path(file) }?, None).map_err(unreadable)?;
            prepare(&model.cloud, options.unwrap_or(&DEFAULT))
        })
    })
}

/// Opens a prepared file by mapping it; `checks` is a `NearmissChecks`. The file must not be changed in
/// place while it is open; saving over it is fine. Thread safety: any thread.
///
/// # Safety
/// `file` is null or text that ends with a zero byte; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_open(
    file: *const c_char,
    checks: i32,
    out: Option<&mut MaybeUninit<*mut Scan>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the text.
            nearmiss::Scan::open(unsafe { path(file) }?, check(checks)?).map_err(unloadable)
        })
    })
}

/// Loads a scan from the bytes of a prepared file, which are copied; `checks` is a `NearmissChecks`.
/// Thread safety: any thread.
///
/// # Safety
/// `bytes` are `length` bytes; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_from_bytes(
    bytes: *const u8,
    length: usize,
    checks: i32,
    out: Option<&mut MaybeUninit<*mut Scan>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the bytes.
            let bytes = unsafe { slice(bytes, length, "bytes") }?.to_vec();
            nearmiss::Scan::from_bytes(bytes, check(checks)?).map_err(unloadable)
        })
    })
}

/// Saves a scan to a prepared file, atomically. Thread safety: any thread.
///
/// # Safety
/// `file` is null or text that ends with a zero byte; `scan` is null or a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_save(scan: Option<&Scan>, file: *const c_char) -> Status {
    guard(|| {
        // SAFETY: the caller promises the text.
        get(scan, "scan")?.save(unsafe { path(file) }?).map(drop).map_err(unwritable)
    })
}

/// Writes the bytes of a prepared file to `buffer`, as many as its capacity holds, and their whole
/// number to `length`. Ask with a capacity of 0 first. Thread safety: any thread.
///
/// # Safety
/// `buffer` are `capacity` bytes that nothing else uses; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_to_bytes(
    scan: Option<&Scan>,
    buffer: *mut u8,
    capacity: usize,
    length: Option<&mut MaybeUninit<usize>>,
) -> Status {
    guard(|| {
        let mut bytes = Vec::new();
        get(scan, "scan")?.write_to(&mut bytes).map_err(unwritable)?;
        // SAFETY: the caller promises the buffer.
        unsafe { fill(bytes.into_iter(), (buffer, capacity), length) }
    })
}

/// Writes facts about a scan to `out`. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_scan_about(
    scan: Option<&Scan>,
    out: Option<&mut MaybeUninit<ScanAbout>>,
) -> Status {
    guard(|| {
        let scan = get(scan, "scan")?;
        let (bounds, dropped) = (scan.bounds(), scan.dropped());
        write(
            out,
            ScanAbout {
                points: scan.len() as u64,
                min: bounds.min,
                max: bounds.max,
                sampling_radius: scan.sampling_radius(),
                reach: scan.reach(),
                not_finite: dropped.not_finite as u64,
                duplicate: dropped.duplicate as u64,
                is_oriented: scan.is_oriented(),
            },
        )
    })
}

/// Frees a scan; null is fine. Worlds keep the scans that were inserted. Thread safety: no other call
/// may use the handle at the same time or later.
///
/// # Safety
/// `scan` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_free(scan: *mut Scan) -> Status {
    guard(|| free(scan))
}
