//! The units of two scans: their options, and a warning if the sizes of the scans differ too much.

use std::fmt::Display;
use std::sync::Once;

use clap::ValueEnum;
use nearmiss::{Aabb, Placed};

use crate::console::{Console, warn};
use crate::digits::{rough, short};
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

/// The unit of lengths in the world, if known.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum WorldUnit {
    /// The unit of the input, whatever that is.
    #[default]
    OfFile,
    /// Metres: a unit was named for a scan.
    Metres,
}

impl WorldUnit {
    /// Returns a length with three significant digits, and its unit if that is known.
    pub(crate) fn length(self, length: f64) -> String {
        match self {
            Self::OfFile => short(length),
            Self::Metres => {
                // A length of 0 is so many metres.
                let scales = [(1.0, "m"), (0.01, "cm"), (0.001, "mm"), (1e-6, "µm")];
                let fits = |(metres, _): &&(f64, &str)| length.abs() >= 0.9995 * metres;
                let (metres, name) = scales.iter().find(fits).unwrap_or(&scales[0]);
                format!("{} {name}", short(length / metres))
            }
        }
    }

    /// Returns what follows lengths without a unit, if theirs is known.
    pub(crate) fn aside(self) -> &'static str {
        if self == Self::Metres { " (in metres)" } else { "" }
    }

    /// Returns what stands at a scale bar.
    pub(crate) fn scale(self, length: f64) -> String {
        match self {
            Self::OfFile => {
                let length = short(length);
                format!("{length} unit{} of the file", if length == "1" { "" } else { "s" })
            }
            Self::Metres => self.length(length),
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
        let size = |view: &Placed<'_>| {
            let scan = view.scan();
            diagonal(scan.bounds()) * view.stored_to_world().scale() / scan.frame().scale
        };
        self.compare_sizes(|| views.map(size));
    }

    /// As [`Self::compare`], for objects whose bounds have diagonals of these lengths in the world.
    pub(crate) fn compare_sizes(&self, sizes: impl FnOnce() -> [f64; 2]) {
        self.once.call_once(|| {
            if let Some(question) = question(sizes(), self.factors) {
                self.console.note(format_args!("warning: {question}"));
            }
        });
    }
}

/// Compares shapes or rays with a scan, and warns once if one of them seems to be in another unit.
#[derive(Debug)]
pub(crate) struct UnitCheck {
    /// The bounds of the scan and its sampling radius, in the world.
    scan: Option<(Aabb, f64)>,
    /// The advice that follows a doubt.
    remedy: &'static str,
}

impl UnitCheck {
    /// The scan has these bounds and this sampling radius in the world, and its unit may be named.
    pub(crate) fn new(bounds: Aabb, r: f64, unit: Option<UnitName>) -> Self {
        let remedy = match unit {
            Some(_) => "give it in metres, or check --units",
            None => "give it in the unit of the scan, or both in metres with --units",
        };
        Self { scan: Some((bounds, r)), remedy }
    }

    /// Compares a thing with these bounds, which is called `name`.
    pub(crate) fn compare(&mut self, bounds: &Aabb, name: impl Display) {
        let doubt = self.scan.as_ref().and_then(|(scan, r)| doubt(bounds, scan, *r));
        if let Some(doubt) = doubt {
            warn(format_args!("{name} {doubt}; {}", self.remedy));
            self.scan = None;
        }
    }
}

/// The reason to doubt that a thing is in the unit of a scan whose sampling radius is `r`, if there is one.
fn doubt(bounds: &Aabb, scan: &Aabb, r: f64) -> Option<String> {
    let ([p, q], size, whole) = ([bounds.centre(), scan.centre()], diagonal(bounds), diagonal(scan));
    let away = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
    if !(size.is_finite() && away.is_finite() && whole > 0.0) {
        return None;
    }
    let of_scan = format!("the scan is {} from corner to corner", short(whole));
    if size > SUSPICIOUS * whole {
        Some(format!("is {} from corner to corner, and {of_scan}", short(size)))
    } else if away > SUSPICIOUS * whole {
        Some(format!("is {} away, and {of_scan}", short(away)))
    // A single point may be meant; its bounds contain rounding.
    } else if size > 1e-9 * r && size < r / SUSPICIOUS {
        Some(format!("is {} from corner to corner, and the spacing of the scan is {}", short(size), short(r)))
    } else {
        None
    }
}

/// Returns the length of the diagonal of a box.
pub(crate) fn diagonal(bounds: &Aabb) -> f64 {
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
    fn lengths_carry_their_unit_if_it_is_known() {
        let all = |unit: WorldUnit| [0.0, 20.0, 1.0, 0.05, 0.002, 5e-6, -0.5].map(|x| unit.length(x));
        assert_eq!(
            all(WorldUnit::OfFile),
            ["0", "20", "1", "0.05", "0.002", "0.000005", "-0.5"].map(String::from)
        );
        assert_eq!(all(WorldUnit::Metres), ["0 m", "20 m", "1 m", "5 cm", "2 mm", "5 µm", "-50 cm"]);
        assert_eq!(WorldUnit::OfFile.scale(0.05), "0.05 units of the file");
        assert_eq!(WorldUnit::OfFile.scale(1.0), "1 unit of the file");
        assert_eq!(WorldUnit::Metres.scale(0.05), "5 cm");
    }

    #[test]
    fn units_scale_objects_and_leave_translations() {
        let matrix = [0.0, -1.0, 0.0, 5.0, 1.0, 0.0, 0.0, 6.0, 0.0, 0.0, 1.0, 7.0, 0.0, 0.0, 0.0, 1.0];
        let expected = [0.0, -0.5, 0.0, 5.0, 0.5, 0.0, 0.0, 6.0, 0.0, 0.0, 0.5, 7.0, 0.0, 0.0, 0.0, 1.0];
        assert_eq!(scaled(matrix, 0.5), expected);
    }
}
