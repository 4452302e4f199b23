//! A clash list as JSON, as CSV, and as a table for people.

use std::io::{self, Write};

use nearmiss::{ClashKind, Distance, Reason, Verdict};
use serde::Serialize;

use crate::clash::list::{ClashReport, List};
use crate::contacts::clash_count;
use crate::digits::{bounds, place, rough, short};
use crate::sentence::{bracket, why};

/// A summary of the whole list, for scripts.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    clashes: usize,
    hard: usize,
    /// The number of clearance clashes.
    clearance: usize,
    contacts: usize,
    /// The number of near contacts.
    near_contacts: usize,
    clearance_distance: f64,
    /// Contacts up to this far apart are in one clash.
    link: f64,
    verdict: &'static str,
    reason: Option<&'static str>,
    /// `true` if no clash is missing.
    complete: bool,
    micros: f64,
}

impl Summary {
    pub(crate) fn new(list: &List<'_>, micros: f64) -> Self {
        let found = list.found;
        let (verdict, reason) = match found.answers.0.verdict {
            Verdict::Intersecting { .. } => ("intersecting", None),
            Verdict::Separated { .. } => ("separated", None),
            Verdict::Undecided(reason) => ("undecided", reason_word(reason)),
        };
        Self {
            clashes: found.clashes.len(),
            hard: list.count(ClashKind::Hard),
            clearance: list.count(ClashKind::Clearance),
            contacts: found.hard,
            near_contacts: found.contacts.len() - found.hard,
            clearance_distance: list.plan.clearance(),
            link: found.link,
            verdict,
            reason,
            complete: found.complete,
            micros,
        }
    }
}

fn reason_word(reason: Reason) -> Option<&'static str> {
    match reason {
        Reason::Budget { .. } => Some("budget"),
        Reason::Undersampled => Some("undersampled"),
        Reason::Ambiguous => Some("ambiguous"),
        Reason::NoGraph => Some("no-graph"),
        Reason::Pose => Some("pose"),
        _ => None,
    }
}

/// Writes a header line and a line for each clash, with lengths in world units and all digits.
pub(crate) fn write_csv(list: &List<'_>, out: &mut impl Write) -> io::Result<()> {
    let [a, b] = list.inputs.map(|path| field(&path.to_string_lossy()));
    writeln!(
        out,
        "id,kind,centre_x,centre_y,centre_z,size_x,size_y,size_z,distance_lower,distance_upper,evidence,contacts,\
         surroundings,depth,point_x,point_y,point_z,source_a,source_b,a,b,depth_lower,depth_direction_x,\
         depth_direction_y,depth_direction_z"
    )?;
    for clash in list.reports() {
        let ([cx, cy, cz], [sx, sy, sz], [px, py, pz]) = (clash.centre, clash.size, clash.point);
        let number = |length: Option<f64>| length.map_or_else(String::new, |length| length.to_string());
        let (depth, lower) = (number(clash.depth), number(clash.depth_lower));
        let [dx, dy, dz] = [0, 1, 2].map(|k| number(clash.depth_direction.map(|direction| direction[k])));
        write!(out, "{},{},{cx},{cy},{cz},{sx},{sy},{sz},", clash.id, clash.kind)?;
        write!(out, "{},{},{},{},", clash.lower, clash.upper, clash.evidence, clash.contacts)?;
        let (source_a, source_b) = (clash.source_a, clash.source_b);
        write!(out, "{},{depth},{px},{py},{pz},{source_a},{source_b},{a},{b}", clash.surroundings)?;
        writeln!(out, ",{lower},{dx},{dy},{dz}")?;
    }
    Ok(())
}

/// Quotes text as a CSV field that no spreadsheet takes for a formula.
fn field(text: &str) -> String {
    let guard = if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { "'" } else { "" };
    format!("\"{guard}{}\"", text.replace('"', "\"\""))
}

/// Returns the first clashes as a table with a header; empty if there are no clashes.
pub(crate) fn lines(list: &List<'_>, most: usize) -> Vec<String> {
    if list.found.clashes.is_empty() {
        return Vec::new();
    }
    let head = ["clash", "kind", "centre", "size", "distance", "places"].map(str::to_owned);
    let rows: Vec<[String; 6]> =
        std::iter::once(head).chain(list.reports().take(most).map(|clash| cells(list, &clash))).collect();
    let widths: [usize; 6] =
        std::array::from_fn(|k| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0));
    let line = |row: &[String; 6]| {
        let cells: Vec<String> = (0..6).map(|k| format!("{:<width$}", row[k], width = widths[k])).collect();
        cells.join("  ").trim_end().to_owned()
    };
    let mut lines: Vec<String> = rows.iter().map(line).collect();
    let left = list.found.clashes.len().saturating_sub(most);
    if left > 0 {
        lines.push(format!("and {}; --csv, --html and --json list all clashes", more(left)));
    }
    lines
}

fn more(left: usize) -> String {
    format!("{left} more")
}

/// Returns the cells of a clash: number, kind, centre, size, distance, contacts.
pub(crate) fn cells(list: &List<'_>, clash: &ClashReport) -> [String; 6] {
    let [x, y, z] = clash.size.map(short);
    [
        clash.id.to_string(),
        clash.kind.to_owned(),
        place(clash.centre, list.unit()),
        format!("{x} × {y} × {z}"),
        distance(list, clash),
        clash.contacts.to_string(),
    ]
}

/// Returns the distance or the depth of a clash in words, with the lower bound rounded down.
fn distance(list: &List<'_>, clash: &ClashReport) -> String {
    let upper = short(clash.upper);
    match (clash.kind, clash.depth) {
        ("hard", Some(depth)) => format!("{} deep", short(depth)),
        ("hard", None) => "contact".to_owned(),
        _ if clash.lower.to_bits() == clash.upper.to_bits() => upper,
        _ => {
            let [lower, upper] = bounds([clash.lower, clash.upper], list.unit());
            if clash.lower > 0.0 { format!("{lower} to {upper}") } else { format!("up to {upper}") }
        }
    }
}

/// Sums up the list in a sentence or two. Without clashes, `distance` is the distance of the scans.
pub(crate) fn sentence(list: &List<'_>, distance: Option<&Distance>) -> String {
    let (hard, near) = (list.count(ClashKind::Hard), list.count(ClashKind::Clearance));
    let clearance = list.plan.clearance();
    let within = if clearance > 0.0 { format!(" within {}", short(clearance)) } else { String::new() };
    let mut text = match (hard, near) {
        (0, 0) => match list.found.answers.0.verdict {
            Verdict::Undecided(reason) => {
                return format!("Cannot tell: {}.", why(reason, list.views, ["a", "b"], list.plan.options()));
            }
            _ => {
                let apart = distance.map(|found| format!("; the scans are {}", bracket(found, list.unit())));
                format!("No clash{within}{}.", apart.unwrap_or_default())
            }
        },
        (hard, 0) => format!("{}, all hard.", clash_count(hard)),
        (0, near) => {
            format!("{} without contact: the gaps are below {}.", clash_count(near), short(clearance))
        }
        (hard, near) => format!(
            "{}: {hard} hard, and {near} without contact that {} closer than {}.",
            clash_count(hard + near),
            if near == 1 { "comes" } else { "come" },
            short(clearance)
        ),
    };
    if hard + near > 0 {
        text += &format!(" Contacts up to {} apart are in one clash.", rough(list.found.link));
    }
    if !list.found.complete {
        text +=
            " The search took too long and was stopped, so clashes may be missing. Try a smaller clearance.";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_quoted_and_no_formulas() {
        assert_eq!(field("pump \"7\", left.ply"), "\"pump \"\"7\"\", left.ply\"");
        assert_eq!(field("=cmd|' /C calc'!A0"), "\"'=cmd|' /C calc'!A0\"");
    }
}
