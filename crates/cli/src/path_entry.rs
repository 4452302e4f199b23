//! An answer along a path of poses.

use crate::digits::place;

/// The answer for one pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PathEntry {
    /// The number of the line of the pose, counted from 1.
    pub(crate) line: u64,
    pub(crate) time: Option<f64>,
    pub(crate) verdict: PathVerdict,
    pub(crate) evidence: Option<&'static str>,
    pub(crate) reason: Option<&'static str>,
    /// Bounds of the distance, lower and upper, in world units.
    pub(crate) clearance: Option<[f64; 2]>,
    /// Bounds of the penetration, lower and upper, if it was asked for and the things overlap.
    pub(crate) penetration: Option<[f64; 2]>,
    /// `true` if the surfaces are separate, and one is inside the other, which is solid.
    pub(crate) is_nested: bool,
    /// The witness of a contact, or else the nearest point on a.
    pub(crate) place: Option<[f64; 3]>,
    pub(crate) micros: f64,
}

/// A verdict, in ascending order of severity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PathVerdict {
    Separated,
    Undecided,
    Intersecting,
}

impl PathVerdict {
    /// Returns the verdict in tables and JSON.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Separated => "separated",
            Self::Undecided => "undecided",
            Self::Intersecting => "intersecting",
        }
    }
}

impl PathEntry {
    pub(crate) fn where_found(&self, unit: f64) -> String {
        let time = self.time.map_or(String::new(), |time| format!(", time {time}"));
        let at = self.place.map_or(String::new(), |at| format!(", at {}", place(at, unit)));
        format!("line {}{time}{at}", self.line)
    }

    /// Returns the two columns of the penetration, with a comma before each. They are empty without a
    /// penetration.
    pub(crate) fn penetration_columns(&self) -> String {
        self.penetration.map_or(",,".to_owned(), |[lower, upper]| format!(",{lower},{upper}"))
    }

    /// Returns the other columns of the table; unknown values are empty.
    pub(crate) fn row(&self) -> String {
        let number = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
        let [lower, upper] = [0, 1].map(|k| number(self.clearance.map(|bounds| bounds[k])));
        let [x, y, z] = [0, 1, 2].map(|k| number(self.place.map(|p| p[k])));
        format!(
            "{},{},{},{},{},{lower},{upper},{x},{y},{z},{:.1}",
            self.line,
            number(self.time),
            self.verdict.word(),
            self.evidence.unwrap_or_default(),
            self.reason.unwrap_or_default(),
            self.micros,
        )
    }
}
