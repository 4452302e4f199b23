//! Writing of points as binary little-endian PLY.

use std::io::{self, BufWriter, Write};

use thiserror::Error;

use crate::text::{counted, plain};

/// Error of writing points.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlyError {
    /// The operating system reported an error.
    #[error("cannot write the PLY file ({}); check the space left on the disk and try again", plain(cause))]
    Io {
        /// The operating system's error.
        cause: io::Error,
    },
    /// The number of values differs from the number of points.
    #[error(
        "expected {what} for each of {}, got {given}; give one for each",
        counted(points, "point", "points")
    )]
    Count {
        /// Name of the values.
        what: &'static str,
        /// Number of values.
        given: usize,
        /// Number of points.
        points: usize,
    },
    /// An edge or a triangle refers to a missing point, or to one beyond the 31-bit indices of PLY.
    #[error("expected point indices below {}, got {point} ({element} {index})", (*points).min(1 << 31))]
    NoSuchPoint {
        /// `edge` or `face`.
        element: &'static str,
        /// Index of the edge or face.
        index: usize,
        /// Index of the point.
        point: u32,
        /// Number of points.
        points: usize,
    },
}

impl From<io::Error> for PlyError {
    fn from(cause: io::Error) -> Self {
        Self::Io { cause }
    }
}

/// An additional value of each point, with its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Column<'a> {
    /// Single-precision numbers.
    Float(&'a str, &'a [f32]),
    /// Unsigned 32-bit integers.
    Uint(&'a str, &'a [u32]),
}

impl Column<'_> {
    const fn len(&self) -> usize {
        match self {
            Self::Float(_, values) => values.len(),
            Self::Uint(_, values) => values.len(),
        }
    }

    fn property(&self) -> (&str, &str) {
        match self {
            Self::Float(name, _) => ("float", name),
            Self::Uint(name, _) => ("uint", name),
        }
    }

    fn bytes(&self, i: usize) -> [u8; 4] {
        match self {
            Self::Float(_, values) => values[i].to_le_bytes(),
            Self::Uint(_, values) => values[i].to_le_bytes(),
        }
    }
}

/// Points with their attributes, to be written as binary little-endian PLY.
///
/// Positions are written as `float` or `double`, as given, normals as `float nx ny nz`, colours as
/// `uchar red green blue`, and source indices as `uint source`; further columns follow. Equal
/// content gives equal bytes.
#[derive(Debug, Clone, Copy)]
#[must_use = "nothing is written before `write`"]
pub struct PlyPoints<'a> {
    positions: Positions<'a>,
    normals: Option<&'a [[f32; 3]]>,
    colours: Option<&'a [[u8; 3]]>,
    source: Option<&'a [u32]>,
    columns: &'a [Column<'a>],
    edges: &'a [[u32; 2]],
    triangles: &'a [[u32; 3]],
}

#[derive(Debug, Clone, Copy)]
enum Positions<'a> {
    Single(&'a [[f32; 3]]),
    Double(&'a [[f64; 3]]),
}

impl<'a> PlyPoints<'a> {
    /// Creates points in single precision.
    pub const fn single(positions: &'a [[f32; 3]]) -> Self {
        Self::of(Positions::Single(positions))
    }

    /// Creates points in double precision.
    pub const fn double(positions: &'a [[f64; 3]]) -> Self {
        Self::of(Positions::Double(positions))
    }

    const fn of(positions: Positions<'a>) -> Self {
        Self {
            positions,
            normals: None,
            colours: None,
            source: None,
            columns: &[],
            edges: &[],
            triangles: &[],
        }
    }

    /// Adds a normal for each point.
    pub const fn with_normals(mut self, normals: &'a [[f32; 3]]) -> Self {
        self.normals = Some(normals);
        self
    }

    /// Adds a colour for each point: red, green, blue.
    pub const fn with_colours(mut self, colours: &'a [[u8; 3]]) -> Self {
        self.colours = Some(colours);
        self
    }

    /// Adds the index of each point in the input.
    pub const fn with_source(mut self, source: &'a [u32]) -> Self {
        self.source = Some(source);
        self
    }

    /// Adds further values of each point.
    pub const fn with_columns(mut self, columns: &'a [Column<'a>]) -> Self {
        self.columns = columns;
        self
    }

    /// Adds edges between points, as the element `edge`.
    pub const fn with_edges(mut self, edges: &'a [[u32; 2]]) -> Self {
        self.edges = edges;
        self
    }

    /// Adds triangles of points, as the element `face`.
    pub const fn with_triangles(mut self, triangles: &'a [[u32; 3]]) -> Self {
        self.triangles = triangles;
        self
    }

    /// Writes the file. `out` need not be buffered.
    ///
    /// # Errors
    /// Fails before anything is written if the number of normals, colours, source indices or values
    /// of a column differs from the number of points, or if an edge or triangle refers to a missing
    /// point. Fails if the output fails.
    pub fn write(&self, out: &mut impl Write) -> Result<(), PlyError> {
        self.check()?;
        let mut out = BufWriter::with_capacity(1 << 16, out);
        self.header(&mut out)?;
        for i in 0..self.len() {
            match self.positions {
                Positions::Single(p) => all(&mut out, p[i].map(f32::to_le_bytes))?,
                Positions::Double(p) => all(&mut out, p[i].map(f64::to_le_bytes))?,
            }
            if let Some(normals) = self.normals {
                all(&mut out, normals[i].map(f32::to_le_bytes))?;
            }
            if let Some(colours) = self.colours {
                out.write_all(&colours[i])?;
            }
            if let Some(source) = self.source {
                out.write_all(&source[i].to_le_bytes())?;
            }
            for column in self.columns {
                out.write_all(&column.bytes(i))?;
            }
        }
        for edge in self.edges {
            all(&mut out, edge.map(u32::to_le_bytes))?;
        }
        for triangle in self.triangles {
            out.write_all(&[3])?;
            all(&mut out, triangle.map(u32::to_le_bytes))?;
        }
        out.flush()?;
        Ok(())
    }

    const fn len(&self) -> usize {
        match self.positions {
            Positions::Single(p) => p.len(),
            Positions::Double(p) => p.len(),
        }
    }

    fn check(&self) -> Result<(), PlyError> {
        let points = self.len();
        for (what, given) in [
            ("normals", self.normals.map(<[_]>::len)),
            ("colours", self.colours.map(<[_]>::len)),
            ("source indices", self.source.map(<[_]>::len)),
        ] {
            if let Some(given) = given.filter(|&given| given != points) {
                return Err(PlyError::Count { what, given, points });
            }
        }
        if let Some(column) = self.columns.iter().find(|column| column.len() != points) {
            return Err(PlyError::Count { what: "values of a column", given: column.len(), points });
        }
        let edges = self.edges.iter().map(<[u32; 2]>::as_slice);
        let faces = self.triangles.iter().map(<[u32; 3]>::as_slice);
        let edges = edges.enumerate().map(|e| ("edge", e));
        for (element, (index, ends)) in edges.chain(faces.enumerate().map(|f| ("face", f))) {
            let missing = |&&end: &&u32| i32::try_from(end).is_err() || end as usize >= points;
            if let Some(&point) = ends.iter().find(missing) {
                return Err(PlyError::NoSuchPoint { element, index, point, points });
            }
        }
        Ok(())
    }

    fn header(&self, out: &mut impl Write) -> io::Result<()> {
        let real = match self.positions {
            Positions::Single(_) => "float",
            Positions::Double(_) => "double",
        };
        write!(out, "ply\nformat binary_little_endian 1.0\n")?;
        writeln!(out, "element vertex {}", self.len())?;
        properties(out, real, &["x", "y", "z"])?;
        if self.normals.is_some() {
            properties(out, "float", &["nx", "ny", "nz"])?;
        }
        if self.colours.is_some() {
            properties(out, "uchar", &["red", "green", "blue"])?;
        }
        if self.source.is_some() {
            properties(out, "uint", &["source"])?;
        }
        for column in self.columns {
            let (kind, name) = column.property();
            properties(out, kind, &[name])?;
        }
        if !self.edges.is_empty() {
            writeln!(out, "element edge {}", self.edges.len())?;
            properties(out, "int", &["vertex1", "vertex2"])?;
        }
        if !self.triangles.is_empty() {
            writeln!(out, "element face {}", self.triangles.len())?;
            properties(out, "list uchar int", &["vertex_indices"])?;
        }
        writeln!(out, "end_header")
    }
}

fn properties(out: &mut impl Write, kind: &str, names: &[&str]) -> io::Result<()> {
    names.iter().try_for_each(|name| writeln!(out, "property {kind} {name}"))
}

fn all<const N: usize, const M: usize>(out: &mut impl Write, values: [[u8; M]; N]) -> io::Result<()> {
    out.write_all(values.as_flattened())
}
