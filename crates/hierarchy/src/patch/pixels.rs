//! Normals, classes and borders of the points of a depth frame, from the pixels around each. The same
//! sums, tests and votes as for other points ([`crate::patch::surfels`], [`crate::patch::classes`]),
//! over windows of pixels in place of balls.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, mask32x16};
use nearmiss_lanes::parallel::{change_runs, map_each};
use nearmiss_lanes::wide::{Bits, load, product, tangents};
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
        let (mut pixels, mut places) = (Vec::with_capacity(raster.width), Vec::new());
        let mut moments = Vec::with_capacity(raster.width);
        for (here, there) in raster.row(row) {
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || sums(simd, raster, plan, here).append_to(&mut moments, there),
            ));
            pixels.extend(Bits(there).map(|lane| here.pixel(lane)));
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
fn sums<'a, S: Simd>(simd: S, raster: &Raster, plan: &'a SurfacePlan, here: Sixteen) -> SideBySide<'a, S> {
    let mut sums = SideBySide::new(simd, plan);
    raster.around(
        simd,
        here,
        #[inline(always)]
        |d, support, decay| sums.add(simd, d, support, decay),
    );
    sums
}

/// Corrects the classes of single points by those of the eight pixels around, where some are noisy.
pub(crate) fn vote(raster: &Raster, fits: &mut [Fit]) {
    let before = &*fits;
    let changed = map_each(raster.height, |row| {
        let mut changed = Vec::new();
        for (here, there) in raster.row(row) {
            let pixels = || Bits(there).map(|lane| here.pixel(lane));
            let fit = |pixel: Pixel| before[raster.number(pixel)];
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
            let fit = |lane: usize| &fits[raster.number(here.pixel(lane))];
            let mut normals = [[0.0; WIDTH]; 3];
            for lane in Bits(there) {
                for k in 0..3 {
                    normals[k][lane] = fit(lane).normal[k];
                }
            }
            let gaps = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || gaps(simd, raster, (here, there), &normals),
            ));
            for lane in Bits(there) {
                let code = PointCode::new(fit(lane).kind(), gaps[lane].cast_unsigned());
                codes[usize::from(here.pixel(lane).column)] = code;
            }
        }
    });
}

/// Returns the widest gap between the neighbours of those of sixteen pixels that are `there`, given
/// their normals.
#[inline(always)]
fn gaps<S: Simd>(
    simd: S,
    raster: &Raster,
    (here, there): (Sixteen, u32),
    normals: &[[f32; WIDTH]; 3],
) -> [i32; WIDTH] {
    let ([u, v], mut taken) = (tangents(simd, load(simd, normals)), Taken::new(simd));
    raster.around(
        simd,
        here,
        #[inline(always)]
        |d, support, _| {
            let (d_sq, flat) = (product(d, d), [product(d, u), product(d, v)]);
            taken.add(simd, support, d_sq, flat);
        },
    );
    taken.gaps(simd, mask32x16::from_bitmask(simd, u64::from(there)))
}
