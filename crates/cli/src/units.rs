//! The units of two scans: their options, and a warning if the sizes of the scans differ too much.

use std::sync::Once;

use clap::ValueEnum;
use nearmiss::{Aabb, Placed};

use crate::console::Console;
use crate::digits::rough;
use crate::matrix::Matrix;

/// Scans are suspected to be in different units if the diagonals of their bounds differ by more
/// than this factor. An object in a room is commonly 1 to 30 times smaller than the room; the
/// factors from inches, centimetres and millimetres to metres are 39, 100 and 1000.
const SUSPICIOUS: f64 = 30.0;

/// A unit of length, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UnitName {
    /// Millimetres
    Mm,
    /// Centimetres
    Cm,
    /// Metres
    M,
    /// Inches, 0.0254 metres
    In,
    /// Feet, 0.3048 metres
    Ft,
}

impl UnitName {
    /// Returns the length of the unit in metres.
    pub(crate) fn metres(self) -> f64 {
        match self {
            Self::Mm => 0.001,
            Self::Cm => 0.01,
            Self::M => 1.0,
            Self::In => 0.0254,
            Self::Ft => 0.3048,
        }
    }
}

/// Returns the pose that scales an object by `factor` before `matrix` is applied.
pub(crate) fn scaled(mut matrix: Matrix, factor: f64) -> Matrix {
    for row in matrix.chunks_exact_mut(4).take(3) {
        for entry in &mut row[..3] {
            *entry *= factor;
        }
    }
    matrix
}

/// Compares the sizes of two scans, and warns about their units once if the sizes differ too much.
#[derive(Debug)]
pub(crate) struct SizeCheck {
    console: Console,
    /// The units in metres, if at least one is given.
    factors: Option<[f64; 2]>,
    once: Once,
}

impl SizeCheck {
    pub(crate) fn new(console: Console, factors: Option<[f64; 2]>) -> Self {
        Self { console, factors, once: Once::new() }
    }

    /// Warns if the first views compared differ too much in size.
    pub(crate) fn compare(&self, views: [&Placed<'_>; 2]) {
        self.once.call_once(|| {
            let size = |view: &Placed<'_>| {
                let scan = view.scan();
                diagonal(scan.bounds()) * view.placed().scale() / scan.frame().scale
            };
            if let Some(question) = question(views.map(size), self.factors) {
                self.console.note(format_args!("warning: {question}"));
            }
        });
    }
}

fn diagonal(bounds: &Aabb) -> f64 {
    2.0 * bounds.half_extents().iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns the warning, if one is due. The scan with the larger numbers is the one in the smaller
/// unit. Once the user has named a unit, a warning is due only if that makes the sizes differ more.
fn question(sizes: [f64; 2], factors: Option<[f64; 2]>) -> Option<String> {
    let ratio = |[a, b]: [f64; 2]| (a / b).max(b / a);
    let (large, small) = if sizes[0] > sizes[1] { ("a", "b") } else { ("b", "a") };
    let now = ratio(sizes);
    // NaN is not suspicious.
    let is_suspicious = now > SUSPICIOUS;
    let said = format!("{large} is {} times larger than {small}", rough(now));
    match factors {
        _ if !is_suspicious => None,
        None => Some(format!(
            "{said}; if {large} is in millimetres and {small} in metres, add `--units-{large} mm`, otherwise add \
             `--units-{large} m` to confirm the sizes"
        )),
        Some([a, b]) if now > 1.001 * ratio([sizes[0] / a, sizes[1] / b]) => {
            Some(format!("{said} in the units given; check --units-a and --units-b"))
        }
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_name_the_scan_with_the_larger_numbers() {
        assert_eq!(question([1.0, 30.0], None), None);
        assert_eq!(question([30.0, 1.0], None), None);
        assert_eq!(question([f64::NAN, 1.0], None), None);
        let said = question([1.0, 41.2], None).unwrap();
        assert!(said.starts_with("b is 41 times larger than a; if b is in millimetres"), "{said}");
        assert!(said.contains("--units-b mm"), "{said}");
    }

    #[test]
    fn whoever_names_a_unit_is_asked_only_where_it_makes_things_worse() {
        assert_eq!(question([1.0, 41.0], Some([1.0, 1.0])), None, "--units-b m");
        assert_eq!(question([0.04, 41.0], Some([0.001, 0.001])), None, "both in millimetres");
        let said = question([0.04, 41.0], Some([0.001, 1.0])).unwrap();
        assert_eq!(said, "b is 1025 times larger than a in the units given; check --units-a and --units-b");
    }

    #[test]
    fn units_scale_objects_and_leave_translations() {
        let matrix = [0.0, -1.0, 0.0, 5.0, 1.0, 0.0, 0.0, 6.0, 0.0, 0.0, 1.0, 7.0, 0.0, 0.0, 0.0, 1.0];
        let expected = [0.0, -0.5, 0.0, 5.0, 0.5, 0.0, 0.0, 6.0, 0.0, 0.0, 0.5, 7.0, 0.0, 0.0, 0.0, 1.0];
        assert_eq!(scaled(matrix, 0.5), expected);
    }
}
