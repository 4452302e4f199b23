//! All contacts of two scans, as a table and as points, and their grouping into clashes.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::io::{Column, PlyPoints};
use nearmiss::query::default_link;
use nearmiss::{Contact, ContactGroup, Penetration, Placed};
use serde::Serialize;

use crate::digits::{count, place, rough, short};
use crate::error::CliError;
use crate::output;
use crate::parse::parse_radius;

/// The most clashes or contacts printed for people; files and JSON hold all.
pub(crate) const SHOWN: usize = 40;

/// Options for the contacts that were found.
#[derive(Debug, Clone, Args)]
pub struct ContactArgs {
    /// Put contacts into one clash if they are at most this far apart, in world units
    ///
    /// The default is four times the larger sampling radius; for two meshes, a clash is a connected curve
    /// of intersection.
    #[arg(long, value_name = "LEN", requires = "all", allow_hyphen_values = true, value_parser = parse_radius)]
    pub link: Option<f64>,
    /// Write the contacts of --all as points, each with the normal of A and the number of its clash
    #[arg(long, value_name = "OUT.ply", requires = "all", conflicts_with = "poses", help_heading = "Output")]
    pub ply: Option<PathBuf>,
}

impl ContactArgs {
    /// Rejects outputs that cannot be written, or that would replace an input or each other.
    pub(crate) fn check(&self, csv: Option<&Path>, inputs: &[&Path]) -> Result<(), CliError> {
        let outputs: Vec<&Path> = csv.into_iter().chain(self.ply.as_deref()).collect();
        check_outputs(&outputs, inputs)
    }

    /// Groups `contacts` by the link length of the options, or else by the default for these scans.
    pub(crate) fn group(&self, contacts: &[Contact], views: [&Placed<'_>; 2]) -> Grouped {
        Grouped::new(contacts, self.link.unwrap_or_else(|| default_link(views)))
    }

    /// Writes the requested files.
    pub(crate) fn write(
        &self,
        csv: Option<&Path>,
        contacts: &[Contact],
        grouped: &Grouped,
    ) -> Result<(), CliError> {
        if let Some(path) = csv {
            output::replace_plain(path, |out| write_csv(contacts, &grouped.numbers, out))?;
        }
        if let Some(path) = &self.ply {
            write_ply(path, contacts, &grouped.numbers)?;
        }
        Ok(())
    }
}

/// Rejects outputs that cannot be written, or that would replace an input or each other.
pub(crate) fn check_outputs(outputs: &[&Path], inputs: &[&Path]) -> Result<(), CliError> {
    for (i, path) in outputs.iter().enumerate() {
        output::check_apart(path, inputs)?;
        if outputs[..i].iter().any(|earlier| output::is_same(earlier, path)) {
            return Err(CliError::Usage(format!(
                "{}: expected one output for each file, got two outputs; name another file",
                path.display()
            )));
        }
    }
    Ok(())
}

/// Contacts grouped into clashes.
#[derive(Debug)]
pub(crate) struct Grouped {
    /// The length up to which contacts are linked; `None` for connected curves.
    pub(crate) link: Option<f64>,
    /// The clashes, the greatest first.
    pub(crate) groups: Vec<ContactGroup>,
    /// The number of the clash of each contact, counted from 1.
    pub(crate) numbers: Vec<u32>,
    /// The shifts of b out of each clash; empty unless asked for.
    pub(crate) depths: Vec<Penetration>,
}

impl Grouped {
    /// Groups `contacts` that are at most `link` apart, directly or through others.
    pub(crate) fn new(contacts: &[Contact], link: f64) -> Self {
        Self::of(ContactGroup::all(contacts, link), Some(link))
    }

    /// Takes groups that hold all contacts.
    pub(crate) fn of(mut groups: Vec<ContactGroup>, link: Option<f64>) -> Self {
        groups.sort_by(ContactGroup::by_size);
        let count = groups.iter().map(|group| group.contacts.len()).sum();
        let numbers = numbers(count, groups.iter().map(|group| &group.contacts));
        Self { link, groups, numbers, depths: Vec::new() }
    }

    /// Returns the clashes, for scripts.
    pub(crate) fn reports(&self, contacts: &[Contact]) -> Vec<GroupReport> {
        let of = |(i, group)| GroupReport::new(contacts, group, self.depths.get(i));
        self.groups.iter().enumerate().map(of).collect()
    }

    /// Returns the number of contacts and the clashes, for people.
    pub(crate) fn lines(&self, contacts: &[Contact], unit: f64) -> Vec<String> {
        let linked = self.link.map_or_else(
            || "a clash is a connected curve".to_owned(),
            |link| format!("contacts up to {} apart are in one clash", rough(link)),
        );
        let head = format!(
            "{} in {} ({linked})",
            count(contacts.len() as u64, "contact"),
            clash_count(self.groups.len())
        );
        let line = |(number, group): (usize, &ContactGroup)| {
            let [x, y, z] = group.size().map(short);
            let contacts = count(group.contacts.len() as u64, "contact");
            let depth = self.depths.get(number - 1).filter(|depth| depth.upper.is_finite());
            let depth = depth.map_or_else(String::new, |depth| {
                let most = if depth.complete { "" } else { "at most " };
                if depth.upper < unit {
                    format!(", less than {} deep", short(unit))
                } else {
                    format!(", {most}{} deep", short(depth.upper))
                }
            });
            format!(
                "  clash {number}: {contacts} about {}, {x} × {y} × {z}{depth}",
                place(group.centre(), unit)
            )
        };
        std::iter::once(head).chain((1..).zip(&self.groups).map(line)).collect()
    }
}

/// Returns a number of clashes in words.
pub(crate) fn clash_count(n: usize) -> String {
    format!("{n} clash{}", if n == 1 { "" } else { "es" })
}

/// Returns for each of `n` contacts the number of the list that holds it, counted from 1, or 0 if
/// none does.
pub(crate) fn numbers<'a>(n: usize, lists: impl Iterator<Item = &'a Vec<usize>>) -> Vec<u32> {
    let mut numbers = vec![0; n];
    for (number, list) in (1..).zip(lists) {
        for &i in list {
            numbers[i] = number;
        }
    }
    numbers
}

/// A group of contacts, for scripts.
#[derive(Debug, Serialize)]
pub(crate) struct GroupReport {
    contacts: usize,
    centre: [f64; 3],
    size: [f64; 3],
    bounds: [[f64; 3]; 2],
    #[serde(flatten)]
    depth: DepthReport,
    /// The place of the contact with the least residual.
    point: [f64; 3],
    residual: f64,
    source_a: u32,
    source_b: u32,
}

impl GroupReport {
    fn new(contacts: &[Contact], group: &ContactGroup, depth: Option<&Penetration>) -> Self {
        let nearest = &contacts[group.nearest];
        Self {
            contacts: group.contacts.len(),
            centre: group.centre(),
            size: group.size(),
            bounds: [group.bounds.min, group.bounds.max],
            depth: DepthReport::new(depth),
            point: nearest.point,
            residual: nearest.residual,
            source_a: nearest.sources[0].0,
            source_b: nearest.sources[1].0,
        }
    }
}

/// The depth of a clash, for scripts.
#[derive(Debug, Serialize)]
pub(crate) struct DepthReport {
    /// The length of the move of b out of the clash. Null unless asked for.
    depth: Option<f64>,
    depth_lower: Option<f64>,
    depth_direction: Option<[f64; 3]>,
    /// `false` if the budget ended the search for the depth; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    depth_complete: Option<bool>,
}

impl DepthReport {
    /// The report of the shift out of a clash, if one was found.
    pub(crate) fn new(depth: Option<&Penetration>) -> Self {
        let depth = depth.filter(|depth| depth.upper.is_finite());
        Self {
            depth: depth.map(|depth| depth.upper),
            depth_lower: depth.map(|depth| depth.lower),
            depth_direction: depth.map(|depth| depth.direction),
            depth_complete: depth.filter(|depth| !depth.complete).map(|_| false),
        }
    }
}

/// Writes a header line and a line for each contact. Normals are empty if points are compared.
fn write_csv(contacts: &[Contact], numbers: &[u32], out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "clash,x,y,z,normal_a_x,normal_a_y,normal_a_z,normal_b_x,normal_b_y,normal_b_z,residual,source_a,source_b"
    )?;
    for (contact, clash) in contacts.iter().zip(numbers) {
        let Contact { point: [x, y, z], residual, sources: [a, b], .. } = contact;
        write!(out, "{clash},{x},{y},{z}")?;
        match contact.normals {
            Some(normals) => normals.as_flattened().iter().try_for_each(|n| write!(out, ",{n}"))?,
            None => write!(out, ",,,,,,")?,
        }
        writeln!(out, ",{residual},{},{}", a.0, b.0)?;
    }
    Ok(())
}

/// Writes the contacts as points in double precision, with the normal of a (zero if points are
/// compared) and the property `uint clash`.
pub(crate) fn write_ply(path: &Path, contacts: &[Contact], numbers: &[u32]) -> Result<(), CliError> {
    let points: Vec<[f64; 3]> = contacts.iter().map(|contact| contact.point).collect();
    #[expect(clippy::cast_possible_truncation, reason = "unit vectors")]
    let normal = |contact: &Contact| contact.normals.map_or([0.0; 3], |[of_a, _]| of_a.map(|c| c as f32));
    let normals: Vec<[f32; 3]> = contacts.iter().map(normal).collect();
    let columns = [Column::Uint("clash", numbers)];
    output::replace(path, |out| {
        let ply = PlyPoints::double(&points).with_normals(&normals).with_columns(&columns);
        ply.write(out).map_err(CliError::writing_ply(path))
    })
}
