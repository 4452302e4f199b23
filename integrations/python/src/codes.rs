//! Codes of verdicts, evidence and reasons in records, and classes over records.
//!
//! In records a missing number is NaN, a missing index -1. Codes of verdicts: 1 touching (or an
//! impact), 0 apart (or free), -1 undecided. Of evidence: 1 certified, 0 estimated, -1 none.

use nearmiss::{Evidence, Reason, SweepReason};
use pyo3::PyErr;
use pyo3::exceptions::PyTypeError;

/// Names of the reasons, by their codes from 1.
const REASONS: [&str; 8] =
    ["budget", "undersampled", "ambiguous", "graph", "pose", "shape", "near", "geodesic"];

/// The code of the reason "budget".
pub(crate) const BUDGET: i8 = 1;

pub(crate) const fn reason_code(reason: Reason) -> i8 {
    match reason {
        Reason::Budget { .. } => BUDGET,
        Reason::Undersampled => 2,
        Reason::Ambiguous => 3,
        Reason::NoGraph => 4,
        Reason::Pose => 5,
        Reason::Shape => 6,
        _ => 0,
    }
}

pub(crate) const fn sweep_reason_code(reason: SweepReason) -> i8 {
    match reason {
        SweepReason::Near => 7,
        SweepReason::Budget => BUDGET,
        SweepReason::Pose => 5,
        SweepReason::Shape => 6,
        SweepReason::Geodesic => 8,
        _ => 0,
    }
}

pub(crate) const fn evidence_code(evidence: Evidence) -> i8 {
    match evidence {
        Evidence::Certified => 1,
        Evidence::Estimated => 0,
    }
}

pub(crate) fn evidence_name(code: i8) -> Option<&'static str> {
    match code {
        1 => Some("certified"),
        0 => Some("estimated"),
        _ => None,
    }
}

pub(crate) fn reason_name(code: i8) -> Option<&'static str> {
    usize::try_from(code).ok()?.checked_sub(1).and_then(|i| REASONS.get(i)).copied()
}

/// Returns the verdict in a word. `names` are the words for apart and touching.
pub(crate) const fn verdict_name(code: i8, names: [&'static str; 2]) -> &'static str {
    match code {
        0 => names[0],
        1 => names[1],
        _ => "undecided",
    }
}

/// Returns the verdict as a truth value: `Some(true)` for touching, `None` for undecided.
pub(crate) const fn is_touching(code: i8) -> Option<bool> {
    match code {
        1 => Some(true),
        0 => Some(false),
        _ => None,
    }
}

pub(crate) fn number(value: f64) -> Option<f64> {
    Some(value).filter(|value| !value.is_nan())
}

pub(crate) fn vector(value: [f64; 3]) -> Option<[f64; 3]> {
    Some(value).filter(|value| !value[0].is_nan())
}

pub(crate) fn index(value: i64) -> Option<i64> {
    Some(value).filter(|&value| value >= 0)
}

pub(crate) const NONE: f64 = f64::NAN;
pub(crate) const NOWHERE: [f64; 3] = [NONE; 3];

/// Defines a class over a record: a property for each field, and a representation.
macro_rules! answer {
    ($(#[$about:meta])* $class:ident of $record:ident by $repr:ident {
        $(@verdict $touches:ident: $names:expr,)?
        $($(#[$what:meta])* $field:ident: $of:ty = $read:expr),* $(,)?
    }) => {
        $(#[$about])*
        #[pyclass(frozen, module = "nearmiss")]
        #[derive(Debug, Clone, Copy)]
        pub(crate) struct $class(pub(crate) $record);

        #[pymethods]
        impl $class {
            $(
                /// The verdict in a word.
                #[getter]
                fn verdict(&self) -> &'static str {
                    verdict_name(self.0.verdict, $names)
                }

                /// True, False, or None if the question is undecided.
                #[getter]
                fn $touches(&self) -> Option<bool> {
                    is_touching(self.0.verdict)
                }
            )?

            $(
                $(#[$what])*
                #[getter]
                fn $field(&self) -> $of {
                    $read(self.0.$field)
                }
            )*

            fn __repr__(&self) -> String {
                format!("<{} {}>", stringify!($class), $repr(&self.0))
            }

            fn __reduce__<'py>(
                slf: &pyo3::Bound<'py, Self>,
            ) -> PyResult<(pyo3::Bound<'py, PyAny>, (pyo3::Bound<'py, pyo3::types::PyBytes>,))> {
                let bytes = pyo3::types::PyBytes::new(slf.py(), bytemuck::bytes_of(&slf.get().0));
                Ok((slf.get_type().getattr("_from_bytes")?, (bytes,)))
            }

            #[staticmethod]
            fn _from_bytes(data: &[u8]) -> PyResult<Self> {
                $crate::record::read(data).map(Self)
            }

            // Every object is true by default, also the answer that two things are apart.
            fn __bool__(&self) -> PyResult<bool> {
                let properties = [$(stringify!($touches),)? $(stringify!($field)),*];
                Err($crate::codes::no_truth_value(stringify!($class), properties[0]))
            }
        }
    };
}

pub(crate) use answer;

/// Returns the error of an answer that is used as a condition.
pub(crate) fn no_truth_value(class: &str, property: &str) -> PyErr {
    PyTypeError::new_err(format!("expected a condition, such as `answer.{property}`, got the {class} itself"))
}

/// Reads a field as it is.
pub(crate) const fn plain<T: Copy>(value: T) -> T {
    value
}

/// Returns evidence in words, with a comma before it.
pub(crate) fn shown(evidence: i8) -> String {
    evidence_name(evidence).map_or_else(String::new, |name| format!(", {name}"))
}

pub(crate) fn undecided(reason: i8) -> String {
    format!("undecided: {}", reason_name(reason).unwrap_or("unknown"))
}

/// Returns an answer about contact in words.
pub(crate) fn contact_in_words(verdict: i8, place: [f64; 3], evidence: i8, reason: i8) -> String {
    match verdict {
        1 => format!("touching at {place:?}{}", shown(evidence)),
        0 => format!("apart{}", shown(evidence)),
        _ => undecided(reason),
    }
}

/// Returns bounds of a distance in words.
pub(crate) fn bounds_in_words([lower, upper]: [f64; 2], evidence: i8) -> String {
    format!("between {lower} and {upper}{}", shown(evidence))
}

/// Reads a truth value.
pub(crate) const fn is_one(value: u8) -> bool {
    value == 1
}
