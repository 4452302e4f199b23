//! A voxel filter for more points than fit into memory. Points are distributed over files by their
//! cells, and each file is filtered alone.

use std::path::{Path, PathBuf};

use nearmiss::io::Points;

use super::spill::Spill;
use crate::error::CliError;

/// The number of points per file that can be filtered in memory.
const POINTS_A_FILE: u64 = 1 << 21;

/// The largest number of open files.
const MOST_FILES: u64 = 256;

/// A bound of cell numbers, a little less than 2⁶³, so that numbers below it fit into 64 bits after
/// rounding.
const MOST_CELLS: f64 = 9.2e18;

type Cell = [i64; 3];

/// Points, distributed over files by the cells of a grid.
pub(super) struct Grid {
    size: f64,
    output: PathBuf,
    files: Vec<Spill>,
}

impl Grid {
    /// Creates a grid of cubes with edges of length `size`, for about `expected` points, if known.
    pub(super) fn new(size: f64, expected: Option<u64>, output: &Path) -> Result<Self, CliError> {
        let files = expected.map_or(MOST_FILES, |points| points.div_ceil(POINTS_A_FILE)).clamp(1, MOST_FILES);
        let files = (0..files).map(|_| Spill::new(output)).collect::<Result<_, _>>()?;
        Ok(Self { size, output: output.to_owned(), files })
    }

    /// Distributes points over the files. All points must be finite.
    pub(super) fn add(&mut self, points: &Points) -> Result<(), CliError> {
        let mut of_file = vec![Vec::new(); self.files.len()];
        for (i, p) in points.positions.iter().enumerate() {
            let file = mixed(self.cell(*p)?) % self.files.len() as u64;
            of_file[usize::try_from(file).unwrap_or_default()].push(i);
        }
        for (file, which) in self.files.iter_mut().zip(of_file) {
            file.add(points, which)?;
        }
        Ok(())
    }

    /// Keeps the point of each cell that is nearest to the mean of the cell's points, the first one
    /// if several are equally near. `change` may inspect and move the points that are kept.
    pub(super) fn thin(self, mut change: impl FnMut(&mut Points)) -> Result<Spill, CliError> {
        let mut kept = Spill::new(&self.output)?;
        let (cell, files) = (Cells { size: self.size }, self.files);
        for file in files {
            let file = file.finished()?;
            let mut points = Points::default();
            let mut cells: Vec<(Cell, u32)> =
                Vec::with_capacity(usize::try_from(file.len()).unwrap_or_default());
            file.each(|some| {
                cells.extend(
                    some.positions.iter().zip(points_from(points.len())).map(|(p, i)| (cell.of(*p), i)),
                );
                points.append(some);
                Ok(())
            })?;
            cells.sort_unstable();
            let mut stays = vec![false; points.len()];
            for of_cell in cells.chunk_by(|a, b| a.0 == b.0) {
                stays[most_central(&points.positions, of_cell)] = true;
            }
            points.retain(|i| stays[i]);
            change(&mut points);
            kept.add(&points, 0..points.len())?;
        }
        kept.finished()
    }

    fn cell(&self, p: [f64; 3]) -> Result<Cell, CliError> {
        if p.iter().all(|x| (x / self.size).abs() < MOST_CELLS) {
            return Ok(Cells { size: self.size }.of(p));
        }
        let size = self.size;
        Err(CliError::Usage(format!(
            "--voxel {size}: cells of this size cannot be numbered at {p:?}; use a larger size"
        )))
    }
}

/// Returns the numbers of points from `first` on.
fn points_from(first: usize) -> impl Iterator<Item = u32> {
    (first..).map(|i| u32::try_from(i).unwrap_or(u32::MAX))
}

#[derive(Clone, Copy)]
struct Cells {
    size: f64,
}

impl Cells {
    fn of(self, p: [f64; 3]) -> Cell {
        #[expect(clippy::cast_possible_truncation, reason = "checked when the point was added")]
        let cell = p.map(|x| (x / self.size).floor() as i64);
        cell
    }
}

/// Returns a hash of a cell.
fn mixed(cell: Cell) -> u64 {
    let [x, y, z] = cell.map(i64::cast_unsigned);
    let mixed = x.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f).rotate_left(21);
    let mixed =
        (mixed ^ z.wrapping_mul(0x1656_67b1_9e37_79f9).rotate_left(42)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    mixed ^ mixed >> 32
}

/// Returns the index of the point of a cell that is nearest to the mean of the cell's points.
fn most_central(positions: &[[f64; 3]], cell: &[(Cell, u32)]) -> usize {
    let first = positions[cell[0].1 as usize];
    // Relative to the first point, to keep precision far from the origin.
    let relative = |id: u32| [0, 1, 2].map(|k| positions[id as usize][k] - first[k]);
    #[expect(clippy::cast_precision_loss, reason = "a count of points")]
    let share = 1.0 / cell.len() as f64;
    let mut mean = [0.0; 3];
    for (_, id) in cell {
        let p = relative(*id);
        (0..3).for_each(|k| mean[k] += share * p[k]);
    }
    let d_sq = |id: u32| relative(id).iter().zip(mean).map(|(x, m)| (x - m) * (x - m)).sum::<f64>();
    let nearest =
        cell.iter().map(|&(_, id)| (d_sq(id), id)).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    nearest.map_or(0, |(_, id)| id as usize)
}
