//! Writing of points in blocks, in all formats for points.
//!
//! The header contains the number, the bounds and the precision of the points. Therefore the points
//! are processed twice: first by a [`Survey`], then by a [`PointWriter`].

#[cfg(feature = "laz")]
mod las;
mod survey;

use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;
use std::str::FromStr;

use thiserror::Error;

use crate::columns::Holds;
use crate::points::Points;
pub use survey::{OutError, ScaleOffset, Survey};

/// A format that points can be written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum OutputFormat {
    /// PLY, binary little endian.
    Ply,
    /// PCD 0.7, binary.
    Pcd,
    /// LAS 1.4.
    Las,
    /// LAS 1.4, compressed by laszip.
    Laz,
    /// Text: x y z, then further attributes, with a line of column names if there are any.
    Xyz,
    /// A NumPy array of N × 3 numbers.
    Npy,
}

/// Error of parsing an [`OutputFormat`] from an unknown name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("expected ply, pcd, las, laz, xyz or npy, got `{given}`")]
pub struct UnknownOutputFormat {
    /// The given name.
    pub given: String,
}

impl FromStr for OutputFormat {
    type Err = UnknownOutputFormat;

    fn from_str(name: &str) -> Result<Self, UnknownOutputFormat> {
        match name.to_ascii_lowercase().as_str() {
            "ply" => Ok(Self::Ply),
            "pcd" => Ok(Self::Pcd),
            "las" => Ok(Self::Las),
            "laz" => Ok(Self::Laz),
            "xyz" | "txt" | "csv" => Ok(Self::Xyz),
            "npy" => Ok(Self::Npy),
            _ => Err(UnknownOutputFormat { given: name.into() }),
        }
    }
}

impl OutputFormat {
    /// Returns the format of the file extension of `path`.
    ///
    /// # Errors
    /// Fails if no format has this extension.
    pub fn of(path: &Path) -> Result<Self, UnknownOutputFormat> {
        path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().parse()
    }

    /// Returns the names of the attributes that the points have and this format cannot store.
    #[must_use]
    pub fn loses(self, survey: &Survey) -> Vec<&'static str> {
        let Holds { normals, colours, intensities, classes } = survey.holds;
        let all =
            [("normals", normals), ("colours", colours), ("intensities", intensities), ("classes", classes)];
        let lost = |what: &str| match self {
            Self::Las | Self::Laz => what == "normals",
            Self::Npy => true,
            Self::Ply | Self::Pcd | Self::Xyz => false,
        };
        all.into_iter().filter(|(what, there)| *there && lost(what)).map(|(what, _)| what).collect()
    }
}

/// A writer of points that a [`Survey`] has processed before.
pub struct PointWriter<W: Write + Seek + Send + Sync + 'static> {
    survey: Survey,
    out: Out<W>,
    bytes: Vec<u8>,
}

enum Out<W: Write + Seek + Send + Sync + 'static> {
    Plain(BufWriter<W>, OutputFormat),
    #[cfg(feature = "laz")]
    Las(las::LasWriter<W>),
}

impl<W: Write + Seek + Send + Sync + 'static> PointWriter<W> {
    /// Creates a writer and writes the header.
    ///
    /// # Errors
    /// Fails if the output fails, if the coordinates exceed the range of LAS, or for LAS and LAZ
    /// without the feature `laz`.
    pub fn new(out: W, format: OutputFormat, survey: &Survey) -> Result<Self, OutError> {
        let out = match format {
            #[cfg(feature = "laz")]
            OutputFormat::Las => Out::Las(las::LasWriter::new(out, survey, false)?),
            #[cfg(feature = "laz")]
            OutputFormat::Laz => Out::Las(las::LasWriter::new(out, survey, true)?),
            #[cfg(not(feature = "laz"))]
            OutputFormat::Las | OutputFormat::Laz => return Err(OutError::Feature),
            OutputFormat::Ply | OutputFormat::Pcd | OutputFormat::Xyz | OutputFormat::Npy => {
                let mut out = BufWriter::with_capacity(1 << 16, out);
                header(&mut out, format, survey)?;
                Out::Plain(out, format)
            }
        };
        Ok(Self { survey: survey.clone(), out, bytes: Vec::new() })
    }

    /// Writes a block of points.
    ///
    /// # Errors
    /// Fails if the output fails.
    pub fn write(&mut self, points: &Points) -> Result<(), OutError> {
        self.bytes.clear();
        match &mut self.out {
            #[cfg(feature = "laz")]
            Out::Las(las) => las.write(points, &self.survey, &mut self.bytes)?,
            Out::Plain(out, format) => {
                for i in 0..points.len() {
                    match format {
                        OutputFormat::Xyz => line(points, i, self.survey.decimals(), &mut self.bytes)?,
                        OutputFormat::Npy => {
                            coordinates(points.positions[i], self.survey.is_single, &mut self.bytes)
                        }
                        _ => record(points, i, self.survey.is_single, *format, &mut self.bytes),
                    }
                }
                out.write_all(&self.bytes)?;
            }
        }
        Ok(())
    }

    /// Finishes the file and returns the output.
    ///
    /// # Errors
    /// Fails if the output fails.
    pub fn finish(self) -> Result<W, OutError> {
        match self.out {
            #[cfg(feature = "laz")]
            Out::Las(las) => Ok(las.finish()?),
            Out::Plain(out, _) => Ok(out.into_inner().map_err(io::IntoInnerError::into_error)?),
        }
    }
}

impl<W: Write + Seek + Send + Sync + 'static> std::fmt::Debug for PointWriter<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PointWriter").field("survey", &self.survey).finish_non_exhaustive()
    }
}

/// Returns the names of the attributes besides coordinates, in file order, each with its PLY type.
fn columns(holds: Holds) -> Vec<(&'static str, &'static str)> {
    let groups: [(bool, &[(&str, &str)]); 4] = [
        (holds.normals, &[("nx", "float"), ("ny", "float"), ("nz", "float")]),
        (holds.colours, &[("red", "uchar"), ("green", "uchar"), ("blue", "uchar")]),
        (holds.intensities, &[("intensity", "float")]),
        (holds.classes, &[("classification", "uchar")]),
    ];
    groups.into_iter().filter(|group| group.0).flat_map(|group| group.1.iter().copied()).collect()
}

fn header(out: &mut impl Write, format: OutputFormat, survey: &Survey) -> io::Result<()> {
    let (count, is_single, holds) = (survey.points, survey.is_single, survey.holds);
    match format {
        OutputFormat::Ply => {
            let real = if is_single { "float" } else { "double" };
            write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {count}\n")?;
            for (name, kind) in ["x", "y", "z"].map(|name| (name, real)).into_iter().chain(columns(holds)) {
                writeln!(out, "property {kind} {name}")?;
            }
            writeln!(out, "end_header")
        }
        OutputFormat::Pcd => {
            // Colours are packed into one field, as readers of PCD expect.
            let (size, mut fields) = (if is_single { 4 } else { 8 }, vec![]);
            fields.extend(["x", "y", "z"].map(|name| (name, size, 'F')));
            for (name, _) in columns(holds).into_iter().filter(|(name, _)| !matches!(*name, "green" | "blue"))
            {
                fields.push(match name {
                    "nx" => ("normal_x", 4, 'F'),
                    "ny" => ("normal_y", 4, 'F'),
                    "nz" => ("normal_z", 4, 'F'),
                    "red" => ("rgb", 4, 'U'),
                    "classification" => (name, 1, 'U'),
                    _ => (name, 4, 'F'),
                });
            }
            let list = |of: &dyn Fn(&(&str, i32, char)) -> String| {
                fields.iter().map(of).collect::<Vec<_>>().join(" ")
            };
            write!(
                out,
                "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\n\
                 WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n",
                list(&|field| field.0.into()),
                list(&|field| field.1.to_string()),
                list(&|field| field.2.to_string()),
                list(&|_| "1".into()),
            )
        }
        OutputFormat::Npy => {
            let kind = if is_single { "<f4" } else { "<f8" };
            let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({count}, 3), }}");
            // Magic, version and length take ten bytes. The whole header is a multiple of 64 bytes.
            while (10 + text.len() + 1) % 64 != 0 {
                text.push(' ');
            }
            text.push('\n');
            out.write_all(b"\x93NUMPY\x01\x00")?;
            out.write_all(&u16::try_from(text.len()).unwrap_or_default().to_le_bytes())?;
            out.write_all(text.as_bytes())
        }
        OutputFormat::Xyz if columns(holds).is_empty() => Ok(()),
        OutputFormat::Xyz => {
            write!(out, "x y z")?;
            columns(holds).into_iter().try_for_each(|(name, _)| write!(out, " {name}"))?;
            writeln!(out)
        }
        OutputFormat::Las | OutputFormat::Laz => Ok(()),
    }
}

fn coordinates(position: [f64; 3], is_single: bool, bytes: &mut Vec<u8>) {
    if is_single {
        #[expect(clippy::cast_possible_truncation, reason = "exact, as the survey found")]
        bytes.extend(position.map(|x| (x as f32).to_le_bytes()).as_flattened());
    } else {
        bytes.extend(position.map(f64::to_le_bytes).as_flattened());
    }
}

/// Writes a point in binary.
fn record(points: &Points, i: usize, is_single: bool, format: OutputFormat, bytes: &mut Vec<u8>) {
    coordinates(points.positions[i], is_single, bytes);
    if let Some(normal) = points.normals.get(i) {
        bytes.extend(normal.map(f32::to_le_bytes).as_flattened());
    }
    if let Some(&[r, g, b]) = points.colours.get(i) {
        if format == OutputFormat::Pcd {
            bytes.extend([b, g, r, 0]);
        } else {
            bytes.extend([r, g, b]);
        }
    }
    if let Some(intensity) = points.intensities.get(i) {
        bytes.extend(intensity.to_le_bytes());
    }
    bytes.extend(points.classes.get(i));
}

/// Writes a point as text, with this number of decimals, or else the shortest digits that parse to
/// the same number.
fn line(points: &Points, i: usize, decimals: Option<usize>, bytes: &mut Vec<u8>) -> io::Result<()> {
    let [x, y, z] = points.positions[i];
    match decimals {
        Some(n) => write!(bytes, "{x:.n$} {y:.n$} {z:.n$}")?,
        None => write!(bytes, "{x} {y} {z}")?,
    }
    if let Some([x, y, z]) = points.normals.get(i) {
        write!(bytes, " {x} {y} {z}")?;
    }
    if let Some([r, g, b]) = points.colours.get(i) {
        write!(bytes, " {r} {g} {b}")?;
    }
    if let Some(intensity) = points.intensities.get(i) {
        write!(bytes, " {intensity}")?;
    }
    if let Some(class) = points.classes.get(i) {
        write!(bytes, " {class}")?;
    }
    writeln!(bytes)
}
