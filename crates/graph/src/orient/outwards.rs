//! Decision which side of a component is the outside.

use nearmiss_lanes::id32;
use nearmiss_lanes::vector::{dot, sub};

use super::patches::Signed;
use super::sides::{Decision, OrientedPart, Sides};

/// Evidence for the current normals of a part, relative to its root.
#[derive(Debug, Clone, Copy, Default)]
struct Evidence {
    first: u32,
    points: u32,
    normals: f64,
    scanner: f64,
    volume: f64,
    /// Greatest possible volume, if every normal pointed away from the centre.
    extent: f64,
    /// Sums for the centre, and the sum of the normals.
    area: f64,
    position: [f64; 3],
    normal: [f64; 3],
}

impl Evidence {
    /// Volumes above this fraction of the greatest possible volume are significant. A plate 100
    /// times as wide as thick has 0.013; flat noise on a sheet has about 0.
    const VOLUME: f64 = 1e-3;

    /// Returns the decisive evidence, and whether the normals must be reversed.
    fn decide(&self) -> (Decision, bool) {
        if self.normals.abs() > 0.0 {
            return (Decision::Normals, self.normals < 0.0);
        }
        if self.scanner.abs() > 0.0 {
            return (Decision::Scanner, self.scanner < 0.0);
        }
        if self.volume.abs() > Self::VOLUME * self.extent {
            return (Decision::Volume, self.volume < 0.0);
        }
        let largest = self.normal.into_iter().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        (Decision::Convention, largest < 0.0)
    }
}

/// The parts, and for each point whether its normal must be reversed with its part.
pub(super) struct Outwards {
    pub(super) parts: Vec<OrientedPart>,
    pub(super) turned: Vec<bool>,
}

pub(super) fn outwards(
    roots: &[Signed],
    positions: &[[f32; 3]],
    radii: &[f32],
    sides: Sides<'_>,
    normals: &[[f32; 3]],
) -> Outwards {
    let mut part_of = vec![u32::MAX; roots.len()];
    let mut evidence: Vec<Evidence> = Vec::new();
    for (i, root) in roots.iter().enumerate() {
        let part = &mut part_of[root.point as usize];
        if *part == u32::MAX {
            *part = id32(evidence.len());
            evidence.push(Evidence { first: id32(i), ..Evidence::default() });
        }
        let sums = &mut evidence[*part as usize];
        let sign = if root.turned { -1.0 } else { 1.0 };
        let area = f64::from(radii[i]).powi(2);
        sums.points += 1;
        sums.area += area;
        for k in 0..3 {
            sums.position[k] += area * f64::from(positions[i][k]);
            sums.normal[k] += sign * f64::from(normals[i][k]);
        }
        let vote = |with: [f32; 3]| match dot(normals[i], with) {
            d if d > 0.0 => sign,
            d if d < 0.0 => -sign,
            _ => 0.0,
        };
        sums.normals += sides.normals.map_or(0.0, |given| vote(given[i]));
        sums.scanner += sides.scanner.map_or(0.0, |scanner| vote(sub(scanner.of(i), positions[i])));
    }
    for (i, root) in roots.iter().enumerate() {
        let sums = &mut evidence[part_of[root.point as usize] as usize];
        let area = f64::from(radii[i]).powi(2);
        let away = [0, 1, 2].map(|k| f64::from(positions[i][k]) - sums.position[k] / sums.area);
        let height: f64 = (0..3).map(|k| away[k] * f64::from(normals[i][k])).sum();
        sums.volume += if root.turned { -area * height } else { area * height };
        sums.extent += area * away.iter().map(|c| c * c).sum::<f64>().sqrt();
    }
    let decided: Vec<(Decision, bool)> = evidence.iter().map(Evidence::decide).collect();
    let parts = evidence.iter().zip(&decided).map(|(sums, &(decision, _))| OrientedPart {
        first: sums.first,
        points: sums.points,
        orientable: true,
        decision,
    });
    let turned = roots.iter().map(|root| decided[part_of[root.point as usize] as usize].1);
    Outwards { parts: parts.collect(), turned: turned.collect() }
}
