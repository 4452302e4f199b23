//! Columns without names: their meaning is guessed from the first rows.
//!
//! The first three columns are x, y and z. Three further columns are normals if they are vectors of
//! unit length, and colours if they are whole numbers from 0 to 255. A single column before these
//! is an intensity, as in PTS. A single column without others is an intensity only in PTS, which
//! starts with a count.

use crate::text::{Line, Lines, has_values};

/// Number of rows examined.
const ROWS: usize = 32;

/// Number of bytes examined. Smaller than the head that is read to recognise a format, so that the
/// guess is the same for pieces and for the whole file.
const BYTES: usize = 60_000;

/// Tolerance of the squared length of normals, which allows rounding to two digits.
const ROUNDED: f64 = 0.03;

const NORMAL: usize = 3;
const COLOUR: usize = 6;
const INTENSITY: usize = 9;

/// Returns the slot of each column, up to the last column that is read. `values` parses a row of
/// numbers. `is_counted` is `true` if the text starts with a count.
pub(super) fn columns(
    lines: Lines<'_>,
    values: impl Fn(Line<'_>) -> Option<Vec<f64>>,
    is_counted: bool,
) -> Vec<Option<usize>> {
    let mut columns: Vec<Option<usize>> = [0, 1, 2].map(Some).into();
    let rows = first_rows(lines, values);
    let width = rows.iter().map(Vec::len).min().unwrap_or_default();
    let mut next = columns.len();
    if width >= next && (width - next) % 3 == 1 && (is_counted || width > next + 1) {
        columns.push(Some(INTENSITY));
        next += 1;
    }
    for at in (next..).step_by(3).take_while(|at| at + 3 <= width) {
        let triples = rows.iter().map(|row| [row[at], row[at + 1], row[at + 2]]);
        let first = first_of(&triples.collect::<Vec<_>>()).filter(|first| !columns.contains(&Some(*first)));
        columns.extend([0, 1, 2].map(|k| first.map(|first| first + k)));
    }
    let used = columns.iter().rposition(Option::is_some).map_or(0, |i| i + 1);
    columns.truncate(used);
    columns
}

fn first_rows(mut lines: Lines<'_>, values: impl Fn(Line<'_>) -> Option<Vec<f64>>) -> Vec<Vec<f64>> {
    let mut rows = Vec::new();
    while rows.len() < ROWS
        && let Some(line) = lines.next()
        && lines.offset() <= BYTES
    {
        if has_values(&line) {
            match values(line) {
                Some(row) => rows.push(row),
                None => break,
            }
        }
    }
    rows
}

/// Returns the first slot of three columns: that of normals or of colours.
fn first_of(triples: &[[f64; 3]]) -> Option<usize> {
    let finite: Vec<&[f64; 3]> = triples.iter().filter(|row| row.iter().all(|x| x.is_finite())).collect();
    let is_unit = |row: &&[f64; 3]| (row.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() <= ROUNDED;
    let is_colour = |row: &&[f64; 3]| row.iter().all(|x| x.fract() == 0.0 && (0.0..=255.0).contains(x));
    match finite.as_slice() {
        [] => None,
        rows if rows.iter().all(is_unit) => Some(NORMAL),
        rows if rows.iter().all(is_colour) => Some(COLOUR),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, is_counted: bool) -> Vec<Option<usize>> {
        let values = |line: Line<'_>| line.words().map(crate::text::number).collect();
        columns(Lines::new(text.as_bytes()), values, is_counted)
    }

    #[test]
    fn columns_are_known_by_what_they_hold() {
        let slots = |all: &[usize]| -> Vec<Option<usize>> { all.iter().copied().map(Some).collect() };
        for (text, is_counted, expected) in [
            ("1 2 3\n4 5 6", true, &[0, 1, 2][..]),
            ("1 2 3 0 0 1\n4 5 6 0.6 -0.8 0", false, &[0, 1, 2, 3, 4, 5]),
            ("1 2 3 0 0 1\n4 5 6 200 3 0", false, &[0, 1, 2, 6, 7, 8]),
            ("1 2 3 200 3 0 0.6 -0.8 0\n", false, &[0, 1, 2, 6, 7, 8, 3, 4, 5]),
            ("1 2 3 -1200 255 128 0\n", true, &[0, 1, 2, 9, 6, 7, 8]),
            ("1 2 3 0.5 255 128 0\n", false, &[0, 1, 2, 9, 6, 7, 8]),
            ("1 2 3 0.5\n", true, &[0, 1, 2, 9]),
            // Columns of unknown meaning.
            ("1 2 3 0.5\n", false, &[0, 1, 2]),
            ("1 2 3 0.5 0.5\n", true, &[0, 1, 2]),
            ("1 2 3 256 0 0\n", false, &[0, 1, 2]),
            ("1 2 3 4.5 0 0\n", true, &[0, 1, 2]),
            ("1 2 3 nan nan nan\n", true, &[0, 1, 2]),
            ("1 2 3 10 10 10\n1 2 3\n", true, &[0, 1, 2]),
            ("1 2 3 wall\n", true, &[0, 1, 2]),
        ] {
            assert_eq!(of(text, is_counted), slots(expected), "{text}");
        }
        let skipped = of("1 2 3 900 900 900 200 3 0\n", false);
        assert_eq!(skipped[3..], [None, None, None, Some(6), Some(7), Some(8)]);
    }
}
