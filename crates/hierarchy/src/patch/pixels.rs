//! Normals, classes and borders of the points of a depth frame, from the pixels around each. The same
//! sums, tests and votes as for other points ([`crate::patch::surfels`], [`crate::patch::classes`]),
//! over windows of pixels in place of balls.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16};
use nearmiss_lanes::parallel::{change_runs, map_each};
use nearmiss_lanes::vector::tangents;
use nearmiss_lanes::wide::{Bits, Vectors, product};
use nearmiss_surface::{Moments, SideBySide, SurfacePlan};

use crate::patch::classes::corrected;
use crate::patch::sectors::Taken;
use crate::patch::surfels::{Fit, fitted};
use crate::point::disc::PointCode;
use crate::point::kind::PointKind;
use crate::point::raster::{Pixel, Raster, Sixteen, WIDTH};
use crate::point::spacing::Look;

/// Fits the surface at all points. Points whose spacing exceeds `reach` are sparse.
pub(crate) fn fit(raster: &Raster, plan: &SurfacePlan, reach: f32, fits: &mut [Fit]) {
    let level = Level::new();
    change_runs(fits, raster.width, |row, fits| {
        let (mut pixels, mut places, mut moments) = (Vec::new(), Vec::new(), Vec::new());
        for (here, there) in raster.row(row) {
            let sums = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || sums(simd, raster, plan, here),
            ));
            for lane in Bits(there) {
                pixels.push(here.pixel(lane));
                moments.push(sums[lane]);
            }
        }
        // Centroids are not asked for.
        places.resize(pixels.len(), [0.0; 3]);
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || Moments::evaluate_all(simd, plan, &places, &moments, |i, at| {
                let pixel = pixels[i];
                let look = if raster.spacing(pixel) > reach { Look::Sparse } else { Look::Area };
                fits[usize::from(pixel.column)] = fitted(&at, look);
            }),
        ));
    });
}

#[inline(always)]
fn sums<S: Simd>(simd: S, raster: &Raster, plan: &SurfacePlan, here: Sixteen) -> [Moments; WIDTH] {
    let mut sums = SideBySide::new(simd, plan);
    raster.around(
        simd,
        here,
        #[inline(always)]
        |d, support, decay| sums.add(simd, d, support, decay),
    );
    sums.moments()
}

/// Corrects the classes of single points by those of the eight pixels around, where some are noisy.
pub(crate) fn vote(raster: &Raster, fits: &mut [Fit]) {
    let before = &*fits;
    let changed = map_each(raster.height, |row| {
        let mut changed = Vec::new();
        for (here, there) in raster.row(row) {
            let pixels = || Bits(there).map(|lane| here.pixel(lane));
            let fit = |pixel: Pixel| &before[raster.number(pixel)];
            if pixels().any(|pixel| fit(pixel).kind() == PointKind::Noisy) {
                let known = (|pixel| raster.position(pixel), |pixel| raster.radius(pixel), fit);
                changed.extend(pixels().filter_map(|pixel| {
                    let corrected = corrected(pixel, raster.nearest(pixel), &known);
                    corrected.map(|fit| (raster.number(pixel), fit))
                }));
            }
        }
        changed
    });
    for (pixel, fit) in changed.into_iter().flatten() {
        fits[pixel] = fit;
    }
}

/// Sets the codes of all points: their classes, and the borders beside them.
pub(crate) fn find_borders(raster: &Raster, fits: &[Fit], codes: &mut [PointCode]) {
    let level = Level::new();
    change_runs(codes, raster.width, |row, codes| {
        for (here, there) in raster.row(row) {
            let number = |lane: usize| raster.number(here.pixel(lane));
            let (mut u, mut v) = ([[0.0; WIDTH]; 3], [[0.0; WIDTH]; 3]);
            for lane in Bits(there) {
                let (along, across) = tangents(fits[number(lane)].normal);
                for k in 0..3 {
                    (u[k][lane], v[k][lane]) = (along[k], across[k]);
                }
            }
            let gaps = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || gaps(simd, raster, here, (&u, &v)),
            ));
            for lane in Bits(there) {
                let kind = fits[number(lane)].kind();
                codes[usize::from(here.pixel(lane).column)] = PointCode::new(kind, gaps[lane]);
            }
        }
    });
}

/// Returns the widest gap between the neighbours of sixteen pixels, given their tangents.
#[inline(always)]
fn gaps<S: Simd>(
    simd: S,
    raster: &Raster,
    here: Sixteen,
    (u, v): (&[[f32; WIDTH]; 3], &[[f32; WIDTH]; 3]),
) -> [u32; WIDTH] {
    let load = |rows: &[[f32; WIDTH]; 3]| -> Vectors<S> {
        [0, 1, 2].map(|k| f32x16::load_array_ref(simd, &rows[k]))
    };
    let (u, v, mut taken) = (load(u), load(v), Taken::new(simd));
    raster.around(
        simd,
        here,
        #[inline(always)]
        |d, support, _| {
            let (d_sq, flat) = (product(d, d), [product(d, u), product(d, v)]);
            taken.add(simd, support, d_sq, flat);
        },
    );
    taken.gaps()
}
