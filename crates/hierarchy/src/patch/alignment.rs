//! Normals of a leaf that point to one side, as those of one patch of a surface do.

use fearless_simd::{Level, Simd, dispatch};
use nearmiss_lanes::parallel::change_runs;
use nearmiss_lanes::vector::dot;
use nearmiss_surface::{EigenBlock, MatrixBlock, symmetric_eigen, symmetric_eigen_batch};

/// Flips the normals of each leaf to one side.
pub(crate) fn align_leaves(normals: &mut [[f32; 3]], leaf_size: usize) {
    const LEAVES_AT_ONCE: usize = 4 * MatrixBlock::WIDTH;
    let level = Level::new();
    change_runs(normals, LEAVES_AT_ONCE * leaf_size, |_, some| {
        for leaves in some.chunks_mut(MatrixBlock::WIDTH * leaf_size) {
            let (mut sums, mut solved) = (MatrixBlock::default(), EigenBlock::default());
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || for (lane, leaf) in leaves.chunks(leaf_size).enumerate() {
                    sums.put(lane, products(leaf));
                },
            ));
            symmetric_eigen_batch(level, &[sums], std::slice::from_mut(&mut solved));
            for (lane, leaf) in leaves.chunks_mut(leaf_size).enumerate() {
                flip(leaf, solved.get(lane).vectors[2]);
            }
        }
    });
}

/// Flips a leaf's `normals` to one side: that of their main axis, whose largest component is
/// positive.
pub(crate) fn align(normals: &mut [[f32; 3]]) {
    let main = symmetric_eigen(products(normals)).vectors[2];
    flip(normals, main);
}

/// Returns the sums of the products of components, as xx xy xz yy yz zz.
#[inline(always)]
fn products(normals: &[[f32; 3]]) -> [f64; 6] {
    let mut sums = [0.0; 6];
    for n in normals {
        let [x, y, z] = n.map(f64::from);
        for (sum, product) in sums.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += product;
        }
    }
    sums
}

/// Flips normals to the side of an axis, taken in the direction in which its largest component is
/// positive.
fn flip(normals: &mut [[f32; 3]], main: [f64; 3]) {
    let largest = main.iter().fold(0.0_f64, |m, x| if x.abs() > m.abs() { *x } else { m });
    #[expect(clippy::cast_possible_truncation, reason = "as normals are stored")]
    let axis = main.map(|c| (c * largest.signum()) as f32);
    for n in normals {
        if dot(*n, axis) < 0.0 {
            *n = n.map(|x| -x);
        }
    }
}
