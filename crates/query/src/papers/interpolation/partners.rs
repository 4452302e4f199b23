//! Drawn points in a grid, which finds the nearest earlier point on the other side.

use super::sides::Side;

/// A drawn point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrawnPoint {
    pub(crate) point: u32,
    pub(crate) place: [f32; 3],
    pub(crate) side: Side,
    /// The previous point in the same list.
    next: u32,
}

const NONE: u32 = u32::MAX;

/// Drawn points in lists by the cells of a grid. Cells whose hashes agree share a list.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drawn {
    points: Vec<DrawnPoint>,
    heads: Vec<u32>,
    per_cell: f32,
    reach_sq: f32,
    /// The numbers of points outside and inside.
    sides: [u32; 2],
}

impl Drawn {
    /// Prepares for `count` points and partners within `reach` of each other.
    pub(crate) fn begin(&mut self, count: u32, reach: f32) {
        self.points.clear();
        self.heads.clear();
        self.heads.resize((2 * count as usize).next_power_of_two(), NONE);
        self.per_cell = 1.0 / reach;
        self.reach_sq = reach * reach;
        self.sides = [0; 2];
    }

    /// The greatest distance of partners.
    pub(crate) fn reach(&self) -> f32 {
        self.reach_sq.sqrt()
    }

    pub(crate) fn points(&self) -> &[DrawnPoint] {
        &self.points
    }

    #[expect(clippy::cast_possible_truncation, reason = "it saturates")]
    fn cell(&self, place: [f32; 3]) -> [i32; 3] {
        place.map(|x| (x * self.per_cell).floor() as i32)
    }

    /// The list of a cell.
    #[expect(clippy::cast_sign_loss, reason = "bits to mix")]
    fn list(&self, cell: [i32; 3]) -> usize {
        let [x, y, z] = cell.map(|c| u64::from(c as u32));
        let mixed = x.wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ y.wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ z.wrapping_mul(0x1656_67B1_9E37_79F9);
        (mixed >> 20) as usize & (self.heads.len() - 1)
    }

    /// The nearest drawn point on the other side within reach; among equals the first.
    pub(crate) fn partner(&self, place: [f32; 3], side: &Side) -> Option<&DrawnPoint> {
        if !side.is_known || self.sides[usize::from(side.distance >= 0.0)] == 0 {
            return None;
        }
        let middle = self.cell(place);
        let mut nearest: Option<(f32, u32)> = None;
        for offset in 0..27 {
            let about = [offset % 3 - 1, offset / 3 % 3 - 1, offset / 9 - 1];
            let cell = [0, 1, 2].map(|k: usize| middle[k].saturating_add(about[k]));
            let mut at = self.heads[self.list(cell)];
            while let Some(drawn) = self.points.get(at as usize) {
                let away = (0..3).map(|k| (drawn.place[k] - place[k]).powi(2)).sum::<f32>();
                if away <= self.reach_sq
                    && side.is_opposite(&drawn.side)
                    && nearest.is_none_or(|best| (away, at) < best)
                {
                    nearest = Some((away, at));
                }
                at = drawn.next;
            }
        }
        nearest.map(|(_, at)| &self.points[at as usize])
    }

    pub(crate) fn add(&mut self, point: u32, place: [f32; 3], side: Side) {
        self.sides[usize::from(side.distance < 0.0)] += u32::from(side.is_known);
        let list = self.list(self.cell(place));
        let number = u32::try_from(self.points.len()).unwrap_or(NONE);
        let next = std::mem::replace(&mut self.heads[list], number);
        self.points.push(DrawnPoint { point, place, side, next });
    }
}

#[cfg(test)]
mod tests {
    use super::Drawn;
    use crate::papers::interpolation::sides::Side;

    /// Compared with a search over all pairs, including points outside the range of the grid's
    /// integers.
    #[test]
    fn partners_are_the_nearest_of_all() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from(u16::try_from(state >> 16).unwrap_or(0)) / 65_536.0
        };
        for (reach, spread) in [(0.1, 1.0), (0.01, 1.0), (3.0, 1.0), (1e-9, 1e3)] {
            let mut drawn = Drawn::default();
            drawn.begin(500, reach);
            let mut all: Vec<([f32; 3], Side)> = Vec::new();
            let mut found = 0;
            for i in 0..500 {
                let place = [0; 3].map(|_| spread * (random() - 0.5));
                let distance = f64::from(random() - 0.5);
                let side = Side { distance, near: 0, away: 0.0, is_known: i % 7 > 0 };
                let away = |p: [f32; 3]| (0..3).map(|k| (p[k] - place[k]).powi(2)).sum::<f32>();
                let expected = (0_u32..)
                    .zip(&all)
                    .filter(|(_, (p, other))| away(*p) <= reach * reach && side.is_opposite(other))
                    .map(|(k, (p, _))| (away(*p), k))
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                let partner = drawn.partner(place, &side).map(|partner| partner.point);
                assert_eq!(partner, expected.map(|(_, k)| k), "point {i}");
                found += u32::from(partner.is_some());
                drawn.add(i, place, side);
                all.push((place, side));
            }
            assert!(reach < 0.1 || found > 100, "{found} partners within {reach}");
        }
    }
}
