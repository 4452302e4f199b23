//! Slice maps of buildings.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use nearmiss::Aabb;
use nearmiss::slices::{
    Floor, Obstacle, Pixel, SliceBuilder, SliceFolder, SliceMap as Map, SliceOptions, SlicePlan, StoreError,
    Unloaded,
};

use crate::answer::NONE;
use crate::handle::{Handle, free, get, make, opaque};
use crate::pointer::{path, required, slice, text, write};
use crate::status::{Failure, Status, guard};

/// A building as a stack of images. Any number of threads may use one at the same time.
#[derive(Debug)]
pub struct SliceMap(Handle<Map>);

opaque!(SliceMap of Map as b"nm-slice");

/// How a map is built. Start from `nearmiss_map_options`. Lengths are in the units of the points.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct MapOptions {
    /// The side of a pixel; 0 for 700 pixels along the longer side.
    pub pixel: f64,
    /// The height of a slice; 0 for three pixels.
    pub slice_height: f64,
    /// Steeper than this, in degrees, is an obstacle.
    pub max_slope: f64,
    /// The height that a level floor spans; negative to estimate it.
    pub noise: f64,
    /// The axis that points up: "x", "y", "z", "-x", "-y" or "-z". Null for z.
    pub up: *const c_char,
}

/// The content of a box.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Occupancy {
    /// True if anything is in the box.
    pub collides: bool,
    /// True if an obstacle is in the box.
    pub obstacle: bool,
    /// The number of occupied pixels.
    pub pixels: u64,
    /// The height of the floor below the box; NaN if there is none.
    pub floor: f64,
}

/// Returns the default options: z points up, obstacles are steeper than 45 degrees. Thread safety: any
/// thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_map_options() -> MapOptions {
    MapOptions { pixel: 0.0, slice_height: 0.0, max_slope: 45.0, noise: -1.0, up: std::ptr::null() }
}

pub(crate) fn unloaded(cause: Unloaded) -> Failure {
    Failure::new(Status::Data, cause)
}

fn unstored(cause: StoreError) -> Failure {
    let is_of_system =
        matches!(cause, StoreError::Folder { .. } | StoreError::Write(_) | StoreError::Busy { .. });
    Failure::new(if is_of_system { Status::Io } else { Status::Data }, cause)
}

/// Builds a map from `count` points, three numbers each. `options` may be null. Thread safety: any
/// thread.
///
/// # Safety
/// `points` are `3 · count` numbers; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_map_from_points(
    points: *const f64,
    count: usize,
    options: Option<&MapOptions>,
    out: Option<&mut MaybeUninit<*mut SliceMap>>,
) -> Status {
    guard(|| {
        make(out, || {
            let given = options.copied().unwrap_or_else(|| nearmiss_map_options());
            // SAFETY: the caller promises the numbers; three in a row are one array.
            let points = unsafe { slice(points.cast::<[f64; 3]>(), count, "points") }?;
            let noise = if given.noise < 0.0 { None } else { Some(given.noise) };
            let mut options = SliceOptions::default()
                .with_obstacle(Obstacle::Slope { degrees: given.max_slope, noise })
                .with_slice_height(Some(given.slice_height).filter(|&height| height != 0.0));
            if given.pixel != 0.0 {
                options = options.with_pixel(Pixel::Side(given.pixel));
            }
            if !given.up.is_null() {
                // SAFETY: the caller promises the text.
                options =
                    options.with_up(unsafe { text(given.up, "up") }?.parse().map_err(Failure::argument)?);
            }
            let finite = points.iter().filter(|p| p.iter().all(|c| c.is_finite())).copied();
            let plan = SlicePlan::new(&options, &Aabb::of(finite)).map_err(Failure::argument)?;
            let mut builder = SliceBuilder::new(&plan).map_err(Failure::argument)?;
            builder.add(points);
            Ok(builder.finish())
        })
    })
}

/// Loads all slices of a folder. Thread safety: any thread.
///
/// # Safety
/// `folder` is null or text that ends with a zero byte; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_map_open(
    folder: *const c_char,
    out: Option<&mut MaybeUninit<*mut SliceMap>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the text.
            let opened = SliceFolder::open(unsafe { path(folder) }?).map_err(unstored)?;
            let (map, mut faults) = opened.load_all();
            if faults.is_empty() { Ok(map) } else { Err(unstored(faults.remove(0))) }
        })
    })
}

/// Saves a map to a folder. Thread safety: any thread.
///
/// # Safety
/// `folder` is null or text that ends with a zero byte; `map` is null or a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_map_save(map: Option<&SliceMap>, folder: *const c_char) -> Status {
    guard(|| {
        // SAFETY: the caller promises the text.
        get(map, "map")?.save(unsafe { path(folder) }?).map(drop).map_err(unstored)
    })
}

/// Frees a map; null is fine. Thread safety: no other call may use the handle at the same time or later.
///
/// # Safety
/// `map` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_map_free(map: *mut SliceMap) -> Status {
    guard(|| free(map))
}

/// Tells what is in the box from `min` to `max`, and how high the floor below it is. Thread safety: any
/// thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_map_query(
    map: Option<&SliceMap>,
    min: Option<&[f64; 3]>,
    max: Option<&[f64; 3]>,
    out: Option<&mut MaybeUninit<Occupancy>>,
) -> Status {
    guard(|| {
        let (map, min, max) = (get(map, "map")?, *required(min, "min")?, *required(max, "max")?);
        if !(0..3).all(|k| min[k] <= max[k]) {
            return Err(Failure::argument(format_args!("expected min ≤ max, got {min:?} and {max:?}")));
        }
        let found = map.query(&Aabb { min, max }, Floor::Max).map_err(unloaded)?;
        let floor = found.floor.unwrap_or(NONE);
        write(
            out,
            Occupancy { collides: found.collides, obstacle: found.obstacle, pixels: found.pixels, floor },
        )
    })
}
