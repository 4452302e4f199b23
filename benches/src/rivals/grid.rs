//! A plain grid of points, as users would write for spheres of one radius. Its cells have that
//! radius, so a query visits 27 of them.

/// Points sorted by cell, and the index of each cell's first point.
#[derive(Debug, Clone)]
pub struct Grid {
    min: [f32; 3],
    per_cell: f32,
    size: [usize; 3],
    first: Vec<u32>,
    points: Vec<[f32; 3]>,
}

impl Grid {
    /// Sorts `points` into cells of this size.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "cells are counted in small numbers"
    )]
    pub fn new(points: &[[f32; 3]], cell: f32) -> Self {
        let least = |k: usize| points.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min);
        let most = |k: usize| points.iter().map(|p| p[k]).fold(f32::NEG_INFINITY, f32::max);
        let min = [0, 1, 2].map(least);
        let per_cell = 1.0 / cell;
        let size = [0, 1, 2].map(|k| ((most(k) - min[k]) * per_cell) as usize + 1);
        let mut grid = Self {
            min,
            per_cell,
            size,
            first: vec![0; size.iter().product::<usize>() + 1],
            points: Vec::new(),
        };
        let cells: Vec<usize> =
            points.iter().map(|&p| grid.number(grid.cell(p).map(|c| c as usize))).collect();
        for &cell in &cells {
            grid.first[cell + 1] += 1;
        }
        for i in 1..grid.first.len() {
            grid.first[i] += grid.first[i - 1];
        }
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_key(|&i| cells[i]);
        grid.points = order.into_iter().map(|i| points[i]).collect();
        grid
    }

    /// Returns `true` if a point lies within `radius` of `centre`. `radius` may be at most the cell
    /// size.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "cells are counted in small numbers"
    )]
    pub fn any_within(&self, centre: [f32; 3], radius: f32) -> bool {
        let cell = self.cell(centre);
        let range = |k: usize| {
            let from = (cell[k] - 1.0).max(0.0) as usize;
            from..((cell[k] + 2.0).max(0.0) as usize).min(self.size[k]).max(from)
        };
        let reach_sq = radius * radius;
        range(0).any(|x| {
            range(1).any(|y| {
                let row = range(2);
                if row.is_empty() {
                    return false;
                }
                // The cells of a row are contiguous.
                let (from, to) = (self.number([x, y, row.start]), self.number([x, y, row.end - 1]) + 1);
                let points = &self.points[self.first[from] as usize..self.first[to] as usize];
                points.iter().any(|p| {
                    let d = [p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]];
                    d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= reach_sq
                })
            })
        })
    }

    fn cell(&self, p: [f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|k| ((p[k] - self.min[k]) * self.per_cell).floor())
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.size[1] + y) * self.size[2] + z
    }
}
