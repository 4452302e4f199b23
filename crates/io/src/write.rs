//! Points out, as binary little endian PLY.

use std::io::{self, BufWriter, Write};

use thiserror::Error;

/// Why points could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The output failed.
    #[error("writing PLY: {cause}")]
    Io {
        /// What the operating system said.
        cause: io::Error,
    },
    /// Values that do not belong to the points.
    #[error("{given} {what} for {points} points; give one for each")]
    Count {
        /// What the values are.
        what: &'static str,
        /// How many of them there are.
        given: usize,
        /// How many points there are.
        points: usize,
    },
    /// An edge or a triangle that names a point which is not there, or which PLY's 31-bit indices cannot
    /// name.
    #[error("{element} {index} names point {point}, but there are {points} points")]
    NoSuchPoint {
        /// `edge` or `face`.
        element: &'static str,
        /// Index of the edge or face.
        index: usize,
        /// The point it names.
        point: u32,
        /// How many points there are.
        points: usize,
    },
}

impl From<io::Error> for WriteError {
    fn from(cause: io::Error) -> Self {
        Self::Io { cause }
    }
}

/// A further number of each point, with its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Column<'a> {
    /// In single precision.
    Float(&'a str, &'a [f32]),
    /// Not negative.
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

/// Points and what belongs to them, to be written as binary little endian PLY.
///
/// Positions are `float` or `double` as given, normals `float nx ny nz`, colours `uchar red green blue`, the
/// source `uint source`; further columns follow. The same content gives the same bytes.
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
    /// Points in single precision.
    pub const fn single(positions: &'a [[f32; 3]]) -> Self {
        Self::of(Positions::Single(positions))
    }

    /// Points in double precision.
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

    /// With a normal for each point.
    pub const fn with_normals(mut self, normals: &'a [[f32; 3]]) -> Self {
        self.normals = Some(normals);
        self
    }

    /// With a colour for each point: red, green, blue.
    pub const fn with_colours(mut self, colours: &'a [[u8; 3]]) -> Self {
        self.colours = Some(colours);
        self
    }

    /// With the index that each point had in another file.
    pub const fn with_source(mut self, source: &'a [u32]) -> Self {
        self.source = Some(source);
        self
    }

    /// With further numbers of each point.
    pub const fn with_columns(mut self, columns: &'a [Column<'a>]) -> Self {
        self.columns = columns;
        self
    }

    /// With lines between points, as the element `edge`.
    pub const fn with_edges(mut self, edges: &'a [[u32; 2]]) -> Self {
        self.edges = edges;
        self
    }

    /// With triangles between points, as the element `face`.
    pub const fn with_triangles(mut self, triangles: &'a [[u32; 3]]) -> Self {
        self.triangles = triangles;
        self
    }

    /// Writes header and content; `out` need not be buffered.
    ///
    /// # Errors
    /// When the output fails; and, before anything is written, when there is not one normal, colour, source
    /// or further number for each point, or when an edge or triangle names a point that is not there.
    pub fn write(&self, out: &mut impl Write) -> Result<(), WriteError> {
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

    fn check(&self) -> Result<(), WriteError> {
        let points = self.len();
        for (what, given) in [
            ("normals", self.normals.map(<[_]>::len)),
            ("colours", self.colours.map(<[_]>::len)),
            ("source indices", self.source.map(<[_]>::len)),
        ] {
            if let Some(given) = given.filter(|&given| given != points) {
                return Err(WriteError::Count { what, given, points });
            }
        }
        if let Some(column) = self.columns.iter().find(|column| column.len() != points) {
            return Err(WriteError::Count { what: "numbers of a column", given: column.len(), points });
        }
        let edges = self.edges.iter().map(<[u32; 2]>::as_slice);
        let faces = self.triangles.iter().map(<[u32; 3]>::as_slice);
        let edges = edges.enumerate().map(|e| ("edge", e));
        for (element, (index, ends)) in edges.chain(faces.enumerate().map(|f| ("face", f))) {
            let missing = |&&end: &&u32| i32::try_from(end).is_err() || end as usize >= points;
            if let Some(&point) = ends.iter().find(missing) {
                return Err(WriteError::NoSuchPoint { element, index, point, points });
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
