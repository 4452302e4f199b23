//! Poses as text, on the command line and in files, in the formats that robots and trackers write.

use nearmiss::Pose;
use serde::Deserialize;

use crate::input::pieces;
use crate::json_lines::json_fault;
use crate::matrix::Matrix;

/// Quaternions whose norm differs more than this from 1 are not in the order x y z w, or not quaternions.
const NORM_TOLERANCE: f64 = 0.01;

/// The forms of a pose, for messages.
pub(crate) const FORMS: &str =
    "16 numbers (a row-major 4×4 matrix), 12 (its first three rows) or 7 (x y z qx qy qz qw)";

/// The formats of a file of poses, for messages.
pub(crate) const FILE_FORMS: &str = r#"a line is {"a":[…],"b":[…]} (either may be left out) or the pose of b alone: 16, 12 or 7 numbers, or 8 with the time first (TUM), or columns named x,y,z,qx,qy,qz,qw"#;

/// Returns the matrix given by 16, 12 or 7 numbers.
pub(crate) fn from_numbers(numbers: &[f64]) -> Result<Matrix, String> {
    if let Ok(matrix) = numbers.try_into() {
        return Ok(matrix);
    }
    if let Ok(rows) = <&[f64; 12]>::try_from(numbers) {
        let mut matrix = Pose::IDENTITY.to_row_major();
        matrix[..12].copy_from_slice(rows);
        return Ok(matrix);
    }
    if let Ok(&[x, y, z, qx, qy, qz, qw]) = <&[f64; 7]>::try_from(numbers) {
        return from_quaternion([x, y, z], [qx, qy, qz, qw]);
    }
    Err(format!("expected {FORMS}, got {}", numbers.len()))
}

fn from_quaternion(translation: [f64; 3], quaternion: [f64; 4]) -> Result<Matrix, String> {
    let norm = quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
    // The comparison also rejects NaN.
    if (norm - 1.0).abs() <= NORM_TOLERANCE {
        return Ok(Pose::new(translation, quaternion).to_row_major());
    }
    Err(format!("expected a unit quaternion in the order qx qy qz qw, got one of norm {norm:.3}"))
}

/// Parses one pose: 16, 12 or 7 numbers separated by spaces, commas or semicolons, with optional
/// brackets.
pub(crate) fn parse(text: &str) -> Result<Matrix, String> {
    from_numbers(&numbers(&text.replace(['[', ']'], " "))?)
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    pieces(text).map(number).collect()
}

fn number(piece: &str) -> Result<f64, String> {
    piece.parse().map_err(|_not_a_number| format!("expected a number, got `{}`", excerpt(piece)))
}

/// Returns the beginning of a text, for messages.
fn excerpt(text: &str) -> String {
    text.chars().take(40).flat_map(char::escape_debug).collect()
}

/// The poses of a query as given on one line of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseRow {
    /// The matrices of a and b; `None` for those that the line leaves out.
    pub(crate) matrices: [Option<Matrix>; 2],
    /// The time of the pose, in the unit of the file.
    pub(crate) time: Option<f64>,
}

impl PoseRow {
    fn of_b(matrix: Matrix, time: Option<f64>) -> Self {
        Self { matrices: [None, Some(matrix)], time }
    }
}

/// The format of a file of poses, detected from its first line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PoseFormat {
    /// A JSON object or array on each line.
    Json,
    /// This number of numbers on each line; of 8 numbers, the first is the time.
    Numbers(usize),
    /// Named columns; the first line is the header.
    Columns(Columns),
}

impl PoseFormat {
    /// Detects the format from the first line that is neither blank nor a comment.
    pub(crate) fn of(first: &str) -> Result<Self, String> {
        if first.starts_with(['{', '[']) {
            return Ok(Self::Json);
        }
        match numbers(first) {
            Ok(numbers) if matches!(numbers.len(), 7 | 8 | 12 | 16) => Ok(Self::Numbers(numbers.len())),
            Ok(numbers) => {
                Err(format!("expected 7, 8, 12 or 16 numbers, got {}; {FILE_FORMS}", numbers.len()))
            }
            Err(not_a_number) => Columns::of(first).map(Self::Columns).map_err(|missing| {
                // A word in a row of numbers is more likely a typing error than the name of a column.
                let words = pieces(first).filter(|piece| piece.parse::<f64>().is_err()).count();
                let is_header = 2 * words > pieces(first).count();
                format!("{}; {FILE_FORMS}", if is_header { missing } else { not_a_number })
            }),
        }
    }

    /// Returns `true` if the first line names columns.
    pub(crate) fn has_header(&self) -> bool {
        matches!(self, Self::Columns(_))
    }

    /// Parses a line of this format.
    pub(crate) fn read(&self, line: &str) -> Result<PoseRow, String> {
        let is_json = line.starts_with(['{', '[']);
        match self {
            Self::Json if is_json => json(line),
            Self::Json => {
                Err(format!("expected JSON as on the first line, got `{}`; {FILE_FORMS}", excerpt(line)))
            }
            _ if is_json => Err(format!("expected numbers as on the first line, got JSON; {FILE_FORMS}")),
            Self::Numbers(count) => {
                let numbers = numbers(line)?;
                if numbers.len() != *count {
                    return Err(format!(
                        "expected {count} numbers as on the first line, got {}",
                        numbers.len()
                    ));
                }
                match &numbers[..] {
                    [time, pose @ ..] if *count == 8 => Ok(PoseRow::of_b(from_numbers(pose)?, Some(*time))),
                    pose => Ok(PoseRow::of_b(from_numbers(pose)?, None)),
                }
            }
            Self::Columns(columns) => columns.read(line),
        }
    }
}

/// The numbers of a pose in JSON, flat or in rows.
#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected the numbers of a pose: [16, 12 or 7 numbers], or 4 or 3 rows of 4")]
pub(crate) enum JsonPose {
    Flat(Vec<f64>),
    Rows(Vec<[f64; 4]>),
}

impl JsonPose {
    pub(crate) fn matrix(&self) -> Result<Matrix, String> {
        match self {
            Self::Flat(numbers) => from_numbers(numbers),
            Self::Rows(rows) => from_numbers(rows.as_flattened()),
        }
    }
}

/// A line of JSON. Other fields are ignored.
#[derive(Debug, Deserialize)]
#[serde(expecting = "an object or an array")]
struct JsonRow {
    a: Option<JsonPose>,
    b: Option<JsonPose>,
    #[serde(alias = "t", alias = "timestamp", alias = "stamp")]
    time: Option<f64>,
}

fn json(line: &str) -> Result<PoseRow, String> {
    let faulty = |cause: serde_json::Error| format!("{}; {FILE_FORMS}", json_fault(&cause));
    if line.starts_with('[') {
        let pose: JsonPose = serde_json::from_str(line).map_err(faulty)?;
        return Ok(PoseRow::of_b(pose.matrix()?, None));
    }
    let row: JsonRow = serde_json::from_str(line).map_err(faulty)?;
    let matrix = |name: &str, pose: &Option<JsonPose>| {
        pose.as_ref().map(JsonPose::matrix).transpose().map_err(|what| format!("`{name}`: {what}"))
    };
    let matrices = [matrix("a", &row.a)?, matrix("b", &row.b)?];
    if matrices == [None, None] {
        return Err(format!("expected `a`, `b` or both, got neither; {FILE_FORMS}"));
    }
    Ok(PoseRow { matrices, time: row.time })
}

/// The positions of the columns in a table of poses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Columns {
    divider: Option<char>,
    count: usize,
    /// The positions of x, y, z, qx, qy, qz and qw.
    pose: [usize; 7],
    time: Option<usize>,
}

/// The columns of a pose, in the order of its numbers.
const POSE_COLUMNS: [&str; 7] = ["x", "y", "z", "qx", "qy", "qz", "qw"];

impl Columns {
    /// Finds the columns by their names in a header.
    fn of(header: &str) -> Result<Self, String> {
        // Empty cells exist only if the separator is not white space.
        let divider = [',', ';', '\t'].into_iter().find(|&divider| header.contains(divider));
        let names: Vec<Option<&str>> = split(header, divider).map(meaning).collect();
        let find = |name: &str| names.iter().position(|found| *found == Some(name));
        let missing: Vec<&str> = POSE_COLUMNS.into_iter().filter(|&column| find(column).is_none()).collect();
        if !missing.is_empty() {
            return Err(format!(
                "expected columns x, y, z, qx, qy, qz and qw, got none for {}",
                missing.join(", ")
            ));
        }
        let pose = POSE_COLUMNS.map(|column| find(column).unwrap_or_default());
        Ok(Self { divider, count: names.len(), pose, time: find("time") })
    }

    fn read(&self, line: &str) -> Result<PoseRow, String> {
        let cells: Vec<&str> = split(line, self.divider).collect();
        if cells.len() != self.count {
            return Err(format!("expected {} columns as in the header, got {}", self.count, cells.len()));
        }
        let mut pose = [0.0; 7];
        for ((slot, &column), name) in pose.iter_mut().zip(&self.pose).zip(POSE_COLUMNS) {
            *slot = number(cells[column]).map_err(|what| format!("column {name}: {what}"))?;
        }
        // A time that is not a number, such as a date, is ignored.
        let time = self.time.and_then(|column| cells[column].parse().ok());
        Ok(PoseRow::of_b(from_numbers(&pose)?, time))
    }
}

/// Returns the cells of a line.
fn split(line: &str, divider: Option<char>) -> impl Iterator<Item = &str> {
    let by_divider = divider.map(|divider| line.split(divider));
    let by_space = divider.is_none().then(|| line.split_whitespace());
    by_divider
        .into_iter()
        .flatten()
        .chain(by_space.into_iter().flatten())
        .map(|cell| cell.trim().trim_matches('"'))
}

/// Returns the column that a name stands for. Names may be `x`, `tx`, `pos_x`, `pose.position.x`,
/// `qx`, `rot_x`, `pose.orientation.x` and the like.
fn meaning(name: &str) -> Option<&'static str> {
    let name = name.to_ascii_lowercase();
    let words: Vec<&str> =
        name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty()).collect();
    let [before @ .., last] = &words[..] else { return None };
    let is_turn = before
        .iter()
        .any(|word| ["orientation", "rotation", "quaternion", "quat", "rot", "q"].contains(word));
    Some(match (*last, is_turn) {
        ("x" | "tx" | "px", false) => "x",
        ("y" | "ty" | "py", false) => "y",
        ("z" | "tz" | "pz", false) => "z",
        ("qx", _) | ("x", true) => "qx",
        ("qy", _) | ("y", true) => "qy",
        ("qz", _) | ("z", true) => "qz",
        ("qw", _) | ("w", _) => "qw",
        ("t" | "time" | "timestamp" | "stamp" | "secs" | "seconds", false) => "time",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

    /// A quarter turn about z and a shift, row-major.
    const QUARTER: Matrix = [0.0, -1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0];

    #[track_caller]
    fn is_quarter(row: &PoseRow, time: Option<f64>) {
        let [None, Some(found)] = row.matrices else { panic!("{row:?}") };
        assert!(found.iter().zip(QUARTER).all(|(x, y)| (x - y).abs() < 1e-12), "{found:?}");
        assert_eq!(row.time, time);
    }

    #[test]
    fn one_pose_in_every_format() {
        let rows = "0 -1 0 1 1 0 0 2 0 0 1 3";
        let turn = format!("1 2 3 0 0 {HALF} {HALF}");
        for (text, time) in [
            (format!("{rows} 0 0 0 1"), None),
            (rows.to_owned(), None),
            (turn.clone(), None),
            (format!("1305031102.17 {turn}"), Some(1_305_031_102.17)),
            (format!("[{}]", turn.replace(' ', ",")), None),
            (format!("{{\"b\":[{}],\"time\":0.5,\"other\":1}}", turn.replace(' ', ",")), Some(0.5)),
            ("[[0,-1,0,1],[1,0,0,2],[0,0,1,3],[0,0,0,1]]".to_owned(), None),
            ("{\"b\":[[0,-1,0,1],[1,0,0,2],[0,0,1,3]]}".to_owned(), None),
        ] {
            is_quarter(&PoseFormat::of(&text).unwrap().read(&text).unwrap(), time);
        }
        assert_eq!(parse("[1, 2, 3, 0, 0, 0, 1]").unwrap()[3], 1.0);
    }

    #[test]
    fn columns_are_found_by_their_names() {
        let headers = [
            ("time,x,y,z,qx,qy,qz,qw", "7,1,2,3,0,0,S,S", Some(7.0)),
            (
                "%time;field.pose.position.x;field.pose.position.y;field.pose.position.z;field.pose.orientation.x;\
              field.pose.orientation.y;field.pose.orientation.z;field.pose.orientation.w",
                "7;1;2;3;0;0;S;S",
                Some(7.0),
            ),
            ("qw\tqx\tqy\tqz\ttx\tty\ttz", "S\t0\t0\tS\t1\t2\t3", None),
            ("frame pos_x pos_y pos_z rot_x rot_y rot_z rot_w", "9 1 2 3 0 0 S S", None),
            ("\"Timestamp\",\"frame_id\",x,y,z,qx,qy,qz,qw", "\"noon\",,1,2,3,0,0,S,S", None),
        ];
        for (header, line, time) in headers {
            let format = PoseFormat::of(header).unwrap();
            assert!(format.has_header(), "{header}");
            is_quarter(&format.read(&line.replace('S', &HALF.to_string())).unwrap(), time);
        }
    }

    #[test]
    fn what_is_no_pose_is_refused_and_said() {
        for (text, what) in [
            ("1 2 3", "expected 7, 8, 12 or 16 numbers, got 3"),
            ("1 2 3 0 0 0 x", "expected a number, got `x`"),
            ("time,x,y,z,roll,pitch,yaw", "got none for qx, qy, qz, qw"),
            ("1 2 3 1 1 1 1", "expected a unit quaternion in the order qx qy qz qw, got one of norm 2.000"),
            ("1 2 3 nan 0 0 1", "expected a unit quaternion"),
            ("{\"c\":1}", "expected `a`, `b` or both, got neither"),
            ("{\"b\":[1,2]}", "`b`: expected 16 numbers (a row-major 4×4 matrix)"),
            ("{\"b\":3}", "column 7: expected the numbers of a pose"),
            ("{\"b\":", "column 5: EOF"),
        ] {
            let refused = PoseFormat::of(text).and_then(|format| format.read(text)).unwrap_err();
            assert!(refused.contains(what), "{text}: {refused}");
        }
        let format = PoseFormat::of("1 2 3 0 0 0 1").unwrap();
        let refused = format.read("1 2 3 0 0 0").unwrap_err();
        assert_eq!(refused, "expected 7 numbers as on the first line, got 6");
    }
}
