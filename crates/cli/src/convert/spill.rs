//! Temporary storage of points on disk.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use nearmiss::io::Points;

use crate::error::CliError;

/// The number of points in a piece.
const TOGETHER: usize = 1 << 15;

/// Points in an unnamed temporary file, which the system removes when the process ends in any way.
pub(super) struct Spill {
    /// The folder of the file, for error messages.
    folder: PathBuf,
    out: BufWriter<File>,
    /// `true` for each of normals, colours, intensities and classes that the points have.
    holds: [bool; 4],
    points: u64,
}

impl Spill {
    /// Creates an empty file in the folder of `beside`.
    pub(super) fn new(beside: &Path) -> Result<Self, CliError> {
        let folder = match beside.parent() {
            Some(folder) if folder != Path::new("") => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let file = tempfile::tempfile_in(&folder).map_err(CliError::writing(&folder))?;
        Ok(Self { folder, out: BufWriter::with_capacity(1 << 16, file), holds: [false; 4], points: 0 })
    }

    /// Adds the points with these indices. All points added must have the same attributes.
    pub(super) fn add(
        &mut self,
        points: &Points,
        which: impl IntoIterator<Item = usize>,
    ) -> Result<(), CliError> {
        let Points { positions, normals, colours, intensities, classes, .. } = points;
        let there = [normals.is_empty(), colours.is_empty(), intensities.is_empty(), classes.is_empty()];
        let mut bytes = Vec::new();
        for i in which {
            self.holds = there.map(|empty| !empty);
            bytes.extend(positions[i].map(f64::to_le_bytes).as_flattened());
            if let Some(normal) = normals.get(i) {
                bytes.extend(normal.map(f32::to_le_bytes).as_flattened());
            }
            bytes.extend(colours.get(i).into_iter().flatten());
            if let Some(intensity) = intensities.get(i) {
                bytes.extend(intensity.to_le_bytes());
            }
            bytes.extend(classes.get(i));
            self.points += 1;
        }
        self.out.write_all(&bytes).map_err(CliError::writing(&self.folder))
    }

    /// Returns the number of points.
    pub(super) fn len(&self) -> u64 {
        self.points
    }

    /// Writes out the buffer.
    pub(super) fn finished(mut self) -> Result<Self, CliError> {
        self.out.flush().map_err(CliError::writing(&self.folder))?;
        Ok(self)
    }

    /// Calls `take` with all points, in order. The spill must be [finished](Self::finished).
    pub(super) fn each(&self, mut take: impl FnMut(&Points) -> Result<(), CliError>) -> Result<(), CliError> {
        let failed = |cause| CliError::reading(&self.folder)(cause);
        let mut file = self.out.get_ref();
        file.seek(SeekFrom::Start(0)).map_err(failed)?;
        let mut reader = BufReader::with_capacity(1 << 18, file);
        let mut left = self.points;
        while left > 0 {
            let many = usize::try_from(left).unwrap_or(usize::MAX).min(TOGETHER);
            let points = self.read(&mut reader, many).map_err(failed)?;
            take(&points)?;
            left -= many as u64;
        }
        Ok(())
    }

    fn read(&self, reader: &mut impl Read, many: usize) -> std::io::Result<Points> {
        let [normals, colours, intensities, classes] = self.holds;
        let mut points = Points::default();
        for _ in 0..many {
            let place: [[u8; 8]; 3] = numbers(reader)?;
            points.positions.push(place.map(f64::from_le_bytes));
            if normals {
                let normal: [[u8; 4]; 3] = numbers(reader)?;
                points.normals.push(normal.map(f32::from_le_bytes));
            }
            if colours {
                let colour: [[u8; 1]; 3] = numbers(reader)?;
                points.colours.push(colour.map(u8::from_le_bytes));
            }
            if intensities {
                let [intensity]: [[u8; 4]; 1] = numbers(reader)?;
                points.intensities.push(f32::from_le_bytes(intensity));
            }
            if classes {
                let [[class]]: [[u8; 1]; 1] = numbers(reader)?;
                points.classes.push(class);
            }
        }
        Ok(points)
    }
}

fn numbers<const N: usize, const M: usize>(reader: &mut impl Read) -> std::io::Result<[[u8; M]; N]> {
    let mut numbers = [[0; M]; N];
    numbers.iter_mut().try_for_each(|number| reader.read_exact(number))?;
    Ok(numbers)
}
