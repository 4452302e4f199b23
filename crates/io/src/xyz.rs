//! Points as lines of text: XYZ, CSV and similar formats.
//!
//! The first line of values determines the separator: semicolons if it has any, otherwise commas,
//! otherwise white space. It may be preceded by a line of column names, and before that by the
//! number of points, as in PTS. Without names the first three columns are x, y and z, and the
//! meaning of others is guessed from their values. Lines that start with `#` or `//` are comments.

mod unnamed;

use crate::columns::{Holds, Row, is_unique, slot};
use crate::error::{Broken, Fault};
use crate::rows::{Encoding, Layout, Rows};
use crate::sink::Sink;
use crate::text::{Line, Lines, has_values, number, shown, whole};

/// Parses a text file.
pub(crate) fn parse(bytes: &[u8]) -> Result<Sink, Broken> {
    let mut lines = Lines::new(bytes);
    let count = count(&mut lines);
    let Some(first) = lines.clone().find(has_values) else {
        return match count {
            Some((promised, line)) if promised > 0 => Err(short(promised, 0, line)),
            _ => Ok(Sink::default()),
        };
    };
    let table =
        Table::of(first, lines.clone(), count.is_some()).map_err(|fault| fault.on_line(first.number))?;
    if table.named {
        lines.find(has_values);
    }
    let mut sink = Sink::new(table.holds, 0);
    let mut row = Row::default();
    let mut index = 0;
    for line in lines.filter(has_values) {
        if count.is_some_and(|(promised, _)| index >= promised) {
            return Err(Fault::Surplus.on_line(line.number));
        }
        table.read(line, &mut row).map_err(|fault| fault.on_line(line.number).within("point", index))?;
        sink.row(&row);
        index += 1;
    }
    match count {
        Some((promised, line)) if index < promised => Err(short(promised, index, line)),
        _ => Ok(sink),
    }
}

/// Reads the number of points and its line, if the text starts with one.
fn count(lines: &mut Lines<'_>) -> Option<(u64, u64)> {
    let line = lines.clone().find(has_values)?;
    let points: u64 = whole(line.text.trim_ascii())?;
    lines.find(has_values);
    Some((points, line.number))
}

/// Returns the layout of the rows. Returns `None` if the head of the file is too short or invalid.
pub(crate) fn layout(head: &[u8]) -> Option<Layout> {
    let mut lines = Lines::new(head);
    let promised = count(&mut lines);
    let mut ahead = lines.clone();
    let table = Table::of(ahead.find(has_values)?, lines.clone(), promised.is_some()).ok()?;
    if ahead.left() == 0 {
        return None;
    }
    if table.named {
        lines = ahead;
    }
    Some(Layout {
        start: lines.offset(),
        encoding: Encoding::of_text(&lines),
        element: "point".into(),
        promised,
        holds: table.holds,
        rows: Box::new(table),
    })
}

impl Rows for Table {
    fn is_row(&self, line: &Line<'_>) -> bool {
        has_values(line)
    }

    fn line(&self, line: Line<'_>, row: &mut Row) -> Result<(), Fault> {
        self.read(line, row)
    }

    fn record(&self, _: &[u8], _: &mut Row) {}
}

fn short(promised: u64, present: u64, line: u64) -> Broken {
    let element = "point".into();
    let fault = Fault::Promised { element, promised, present };
    fault.on_line(line)
}

/// The separator and the columns of a text file.
struct Table {
    divider: Option<u8>,
    /// The slot of each column, up to the last column that is read.
    columns: Vec<Option<usize>>,
    holds: Holds,
    /// `true` if the first line contains names.
    named: bool,
}

impl Table {
    /// Creates a table from the first line with names or values. `lines` must start at or before
    /// it.
    fn of(line: Line<'_>, lines: Lines<'_>, is_counted: bool) -> Result<Self, Fault> {
        let divider = [b';', b','].into_iter().find(|d| line.text.contains(d));
        let mut table = Self { divider, columns: vec![], holds: Holds::default(), named: false };
        let starts_with_number = table.values(line).next().is_some_and(|v| number(v).is_some());
        if starts_with_number {
            let values = |line: Line<'_>| table.values(line).map(number).collect();
            table.columns = unnamed::columns(lines, values, is_counted);
            table.holds = Holds::among(table.columns.iter().copied().flatten())?;
            return Ok(table);
        }
        table.named = true;
        table.columns = table.values(line).map(slot).collect();
        table.holds =
            Holds::among(table.columns.iter().copied().flatten()).map_err(|_less_clear| Fault::Expected {
                expected: "three numbers (with decimal points), or column names that include x, y and z",
                found: shown(line.text),
            })?;
        for slot in (0..Row::default().len()).filter(|slot| is_unique(*slot)) {
            if table.columns.iter().filter(|c| **c == Some(slot)).count() > 1 {
                let name = name_of(slot).into();
                return Err(Fault::Repeated { name });
            }
        }
        let used = table.columns.iter().rposition(Option::is_some).map_or(0, |i| i + 1);
        table.columns.truncate(used);
        Ok(table)
    }

    /// Returns the columns of a line, without surrounding white space and quotes.
    fn values<'a>(&self, line: Line<'a>) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let divider = self.divider;
        let is_divider = move |b: &u8| match divider {
            Some(divider) => *b == divider,
            None => b.is_ascii_whitespace(),
        };
        line.text.split(is_divider).filter(move |value| divider.is_some() || !value.is_empty()).map(unquoted)
    }

    fn read(&self, line: Line<'_>, row: &mut Row) -> Result<(), Fault> {
        let mut values = self.values(line);
        let mut columns = self.columns.iter();
        while let Some(column) = columns.next() {
            let Some(value) = values.next() else {
                let missing = column.or_else(|| columns.find_map(|c| *c));
                let column = name_of(missing.unwrap_or_default()).into();
                return Err(Fault::ShortLine { column });
            };
            if let Some(slot) = *column {
                row[slot] = number(value)
                    .ok_or_else(|| Fault::NotANumber { column: name_of(slot).into(), found: shown(value) })?;
            }
        }
        Ok(())
    }
}

fn unquoted(value: &[u8]) -> &[u8] {
    match value.trim_ascii() {
        [b'"', inner @ .., b'"'] => inner.trim_ascii(),
        value => value,
    }
}

fn name_of(slot: usize) -> &'static str {
    ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "intensity", "class"][slot]
}
