//! All contacts of two meshes: their clashes, a table, and points.

use std::io::{self, Write};
use std::path::Path;

use nearmiss::{Contact, ContactGroup, MeshContact, MeshPair, MeshSolid, Penetration};
use serde::Serialize;

use crate::contacts::{ContactArgs, DepthReport, Grouped, write_ply};
use crate::error::CliError;
use crate::output;

/// The contacts of two meshes, grouped into clashes.
#[derive(Debug)]
pub(crate) struct MeshContacts<'a> {
    contacts: &'a [MeshContact],
    /// The same contacts in the form that lists of contacts of scans have.
    places: Vec<Contact>,
    grouped: Grouped,
}

impl<'a> MeshContacts<'a> {
    /// Groups `contacts` by the link length of the options, or else by the curves on which they lie.
    pub(crate) fn new(contacts: &'a [MeshContact], args: &ContactArgs) -> Self {
        let places: Vec<Contact> = contacts.iter().map(Contact::from).collect();
        let grouped = match args.link {
            Some(link) => Grouped::new(&places, link),
            None => Grouped::of(ContactGroup::of_meshes(contacts), None),
        };
        Self { contacts, places, grouped }
    }

    /// Measures how far b of `pair` must move out of each clash, given the penetration of the pair.
    pub(crate) fn measure(&mut self, pair: &MeshPair<'_>, solids: [&MeshSolid; 2], whole: &Penetration) {
        let groups: Vec<&ContactGroup> = self.grouped.groups.iter().collect();
        self.grouped.depths = pair.depths((self.contacts, &groups), solids, whole, &mut |_| ());
    }

    /// Returns the length up to which contacts are linked; 0 for curves.
    pub(crate) fn link(&self) -> f64 {
        self.grouped.link.unwrap_or(0.0)
    }

    /// Writes the requested files.
    pub(crate) fn write(&self, csv: Option<&Path>, args: &ContactArgs) -> Result<(), CliError> {
        if let Some(path) = csv {
            output::replace_plain(path, |out| self.write_csv(out))?;
        }
        match &args.ply {
            Some(path) => write_ply(path, &self.places, &self.grouped.numbers),
            None => Ok(()),
        }
    }

    /// Writes a header line and a line for each contact.
    fn write_csv(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(
            out,
            "clash,x,y,z,normal_a_x,normal_a_y,normal_a_z,normal_b_x,normal_b_y,normal_b_z,from_x,from_y,from_z,to_x,\
             to_y,to_z,triangle_a,triangle_b"
        )?;
        for (contact, clash) in self.contacts.iter().zip(&self.grouped.numbers) {
            let MeshContact { point, ends, normals, triangles: [a, b] } = contact;
            write!(out, "{clash}")?;
            let numbers = point.iter().chain(normals.as_flattened()).chain(ends.as_flattened());
            numbers.into_iter().try_for_each(|number| write!(out, ",{number}"))?;
            writeln!(out, ",{a},{b}")?;
        }
        Ok(())
    }

    /// Returns the number of contacts and the clashes, for people.
    pub(crate) fn lines(&self, unit: f64) -> Vec<String> {
        self.grouped.lines(&self.places, unit)
    }

    /// Returns the contacts, for scripts.
    pub(crate) fn reports(&self) -> Vec<MeshContactReport> {
        let report = |(contact, &clash): (&MeshContact, &u32)| MeshContactReport {
            point: contact.point,
            ends: contact.ends,
            normal_a: contact.normals[0],
            normal_b: contact.normals[1],
            triangles: contact.triangles,
            clash,
        };
        self.contacts.iter().zip(&self.grouped.numbers).map(report).collect()
    }

    /// Returns the clashes, for scripts.
    pub(crate) fn clashes(&self) -> Vec<MeshClashReport> {
        let report = |(i, group): (usize, &ContactGroup)| MeshClashReport {
            contacts: group.contacts.len(),
            centre: group.centre(),
            size: group.size(),
            bounds: [group.bounds.min, group.bounds.max],
            depth: DepthReport::new(self.grouped.depths.get(i)),
            point: self.contacts[group.nearest].point,
            triangles: self.contacts[group.nearest].triangles,
        };
        self.grouped.groups.iter().enumerate().map(report).collect()
    }
}

/// A contact in the list of all contacts.
#[derive(Debug, Serialize)]
pub(crate) struct MeshContactReport {
    point: [f64; 3],
    /// The ends of the segment that the triangles have in common.
    ends: [[f64; 3]; 2],
    normal_a: [f64; 3],
    normal_b: [f64; 3],
    triangles: [u32; 2],
    /// The number of its clash, counted from 1.
    clash: u32,
}

/// A group of contacts, for scripts.
#[derive(Debug, Serialize)]
pub(crate) struct MeshClashReport {
    contacts: usize,
    centre: [f64; 3],
    size: [f64; 3],
    bounds: [[f64; 3]; 2],
    #[serde(flatten)]
    depth: DepthReport,
    point: [f64; 3],
    triangles: [u32; 2],
}
