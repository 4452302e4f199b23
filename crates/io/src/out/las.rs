//! LAS 1.4 and LAZ: point format 6, or 7 if the points have colours.

use std::io::{Seek, Write};

use laz::{LasZipCompressor, LazVlr, LazVlrBuilder};

use super::survey::{OutError, ScaleOffset, Survey};
use crate::points::Points;

/// Length of the header in bytes.
const HEADER: u16 = 375;

/// Length of the header of a variable-length record in bytes.
const RECORD: usize = 54;

/// Length of a point record in bytes, without and with a colour.
const STRIDES: [u16; 2] = [30, 36];

/// Return number 1 of 1, as reported by a scanner with single returns.
const ONLY_RETURN: u8 = 0x11;

/// A writer of LAS and LAZ.
pub(super) struct LasWriter<W: Write + Seek + Send + Sync + 'static> {
    out: Out<W>,
    lattice: ScaleOffset,
    has_colours: bool,
}

enum Out<W: Write + Seek + Send + Sync + 'static> {
    Raw(std::io::BufWriter<W>),
    Packed(Box<LasZipCompressor<'static, W>>),
}

impl<W: Write + Seek + Send + Sync + 'static> LasWriter<W> {
    /// Creates a writer and writes the header.
    pub(super) fn new(mut out: W, survey: &Survey, compressed: bool) -> Result<Self, OutError> {
        let (lattice, bounds) = (survey.lattice(), survey.bounds());
        let fits = |x: f64, k: usize| {
            let steps = ((x - lattice.offset[k]) / lattice.scale[k]).round();
            steps >= i32::MIN.into() && steps <= i32::MAX.into()
        };
        if survey.points() > 0 && !(0..3).all(|k| fits(bounds.min[k], k) && fits(bounds.max[k], k)) {
            let (step, offset) = (lattice.scale[0], lattice.offset);
            return Err(OutError::TooWide { step, offset, bounds: [bounds.min, bounds.max] });
        }
        let has_colours = survey.holds.colours;
        let format = if has_colours { 7 } else { 6 };
        let vlr = if compressed {
            let builder = LazVlrBuilder::default().with_point_format(format, 0);
            Some(builder.map_err(std::io::Error::other)?.build())
        } else {
            None
        };
        let mut content = Vec::new();
        if let Some(vlr) = &vlr {
            vlr.write_to(&mut content).map_err(std::io::Error::other)?;
        }
        out.write_all(&header(survey, format, lattice, vlr.is_some().then_some(content.len())))?;
        if vlr.is_some() {
            let mut about = [0; RECORD];
            about[2..2 + LazVlr::USER_ID.len()].copy_from_slice(LazVlr::USER_ID.as_bytes());
            about[18..20].copy_from_slice(&LazVlr::RECORD_ID.to_le_bytes());
            about[20..22].copy_from_slice(&u16::try_from(content.len()).unwrap_or_default().to_le_bytes());
            out.write_all(&about)?;
            out.write_all(&content)?;
        }
        let out = match vlr {
            None => Out::Raw(std::io::BufWriter::with_capacity(1 << 16, out)),
            Some(vlr) => {
                Out::Packed(Box::new(LasZipCompressor::new(out, vlr).map_err(std::io::Error::other)?))
            }
        };
        Ok(Self { out, lattice, has_colours })
    }

    /// Writes a block of points. `records` is an empty buffer for reuse.
    pub(super) fn write(
        &mut self,
        points: &Points,
        survey: &Survey,
        records: &mut Vec<u8>,
    ) -> Result<(), OutError> {
        for i in 0..points.len() {
            for k in 0..3 {
                let steps = (points.positions[i][k] - self.lattice.offset[k]) / self.lattice.scale[k];
                #[expect(clippy::cast_possible_truncation, reason = "the bounds were checked")]
                records.extend((steps.round() as i32).to_le_bytes());
            }
            let intensity = points.intensities.get(i).map_or(0, |intensity| survey.intensity(*intensity));
            records.extend(intensity.to_le_bytes());
            records.extend([ONLY_RETURN, 0, points.classes.get(i).copied().unwrap_or(0), 0]);
            // Zeros for scan angle, source and time.
            records.extend([0; 12]);
            if self.has_colours {
                let colour = points.colours.get(i).copied().unwrap_or_default();
                records.extend(colour.map(|channel| (u16::from(channel) * 257).to_le_bytes()).as_flattened());
            }
        }
        match &mut self.out {
            Out::Raw(out) => out.write_all(records)?,
            Out::Packed(out) => out.compress_many(records)?,
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Result<W, OutError> {
        match self.out {
            Out::Raw(out) => Ok(out.into_inner().map_err(std::io::IntoInnerError::into_error)?),
            Out::Packed(mut out) => {
                out.done()?;
                Ok(out.into_inner())
            }
        }
    }
}

/// Builds the header. `packed` is the length of the laszip record, if the file is compressed.
fn header(survey: &Survey, format: u8, lattice: ScaleOffset, packed: Option<usize>) -> Vec<u8> {
    let mut bytes = vec![0; usize::from(HEADER)];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, b"LASF");
    // Declares that coordinate systems are given as well-known text, as LAS 1.4 requires.
    put(6, &[0x10]);
    put(24, &[1, 4]);
    put(26, b"OTHER");
    put(58, b"nearmiss");
    put(94, &HEADER.to_le_bytes());
    let before =
        u32::from(HEADER) + packed.map_or(0, |length| u32::try_from(RECORD + length).unwrap_or_default());
    put(96, &before.to_le_bytes());
    put(100, &u32::from(packed.is_some()).to_le_bytes());
    put(104, &[format | if packed.is_some() { 0x80 } else { 0 }]);
    put(105, &STRIDES[usize::from(format - 6)].to_le_bytes());
    for k in 0..3 {
        put(131 + 8 * k, &lattice.scale[k].to_le_bytes());
        put(155 + 8 * k, &lattice.offset[k].to_le_bytes());
        let bounds = survey.bounds();
        // The bounds after rounding, as they are read back.
        let stored = |x: f64| {
            ((x - lattice.offset[k]) / lattice.scale[k]).round() * lattice.scale[k] + lattice.offset[k]
        };
        let [least, most] =
            if survey.points() > 0 { [bounds.min[k], bounds.max[k]].map(stored) } else { [0.0; 2] };
        put(179 + 16 * k, &most.to_le_bytes());
        put(187 + 16 * k, &least.to_le_bytes());
    }
    put(247, &survey.points().to_le_bytes());
    // All points are first returns.
    put(255, &survey.points().to_le_bytes());
    bytes
}
