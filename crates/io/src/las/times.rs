//! A decoder of GPS times in the point formats 1, 3, 4 and 5, compressed by laszip (item
//! `GPSTIME11`, version 2).
//!
//! The encoder keeps four sequences of times, since flight lines overlap. A time is encoded as a
//! multiple of the usual step of its sequence with a correction, or in full, or after a switch to
//! another sequence. The crate `laz` handles a switch by recursion, so damaged data overflow its
//! stack. This decoder uses a loop, and rejects a second switch for one time.

use std::io::{Error, ErrorKind, Read, Result};

use laz::decoders::ArithmeticDecoder;
use laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use laz::record::FieldDecompressor;

/// Size of a time in bytes.
const SIZE: usize = 8;

/// Number of sequences.
const SEQUENCES: usize = 4;

/// The largest encoded multiple of the usual step.
const LARGEST: i32 = 500;

/// The smallest encoded multiple of the usual step.
const SMALLEST: i32 = -10;

/// Number of symbols if the usual step is unknown. They mean the previous time, a step, and then
/// the same as the symbols after [`SAME`].
const FIRST_SYMBOLS: u32 = 6;

/// The symbol for the previous time, if the usual step is known. Smaller symbols encode multiples.
/// The next symbol encodes a time in full, and larger ones encode switches.
const SAME: u32 = (LARGEST - SMALLEST + 1).unsigned_abs();

/// Number of symbols if the usual step is known.
const SYMBOLS: u32 = SAME + 5;

/// Number of consecutive unusual steps after which the last one becomes the usual step.
const MISFITS: u8 = 4;

/// Contexts of encoded numbers: by the kind of the multiple, and one for full times.
mod context {
    pub(super) const FIRST: u32 = 0;
    pub(super) const USUAL: u32 = 1;
    pub(super) const BELOW_TEN: u32 = 2;
    pub(super) const UP_TO_LARGEST: u32 = 3;
    pub(super) const LARGEST: u32 = 4;
    pub(super) const NEGATIVE: u32 = 5;
    pub(super) const SMALLEST: u32 = 6;
    pub(super) const NONE: u32 = 7;
    pub(super) const WHOLE: u32 = 8;
    pub(super) const ALL: u32 = 9;
}

/// A sequence of times. All values are bit patterns of `f64`.
#[derive(Debug, Clone, Copy, Default)]
struct Sequence {
    last: i64,
    /// The usual step; 0 if unknown.
    step: i32,
    misfits: u8,
}

/// A decoder of GPS times.
pub(super) struct Times {
    sequences: [Sequence; SEQUENCES],
    /// The sequence of the previous time.
    current: usize,
    /// The sequence that was started last.
    newest: usize,
    first: ArithmeticModel,
    multiples: ArithmeticModel,
    numbers: IntegerDecompressor,
}

impl Default for Times {
    fn default() -> Self {
        Self {
            sequences: [Sequence::default(); SEQUENCES],
            current: 0,
            newest: 0,
            first: ArithmeticModelBuilder::new(FIRST_SYMBOLS).build(),
            multiples: ArithmeticModelBuilder::new(SYMBOLS).build(),
            numbers: IntegerDecompressorBuilder::new().bits(32).contexts(context::ALL).build_initialized(),
        }
    }
}

impl Times {
    fn next<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        // After a switch, the current sequence is that of the time, so a second switch is invalid.
        for _ in 0..2 {
            let symbol = if self.sequences[self.current].step == 0 {
                match decoder.decode_symbol(&mut self.first)? {
                    0 => SAME,
                    1 => return self.first_step(decoder),
                    beyond => SAME - 1 + beyond,
                }
            } else {
                decoder.decode_symbol(&mut self.multiples)?
            };
            match symbol.checked_sub(SAME) {
                None => return self.multiple(symbol, decoder),
                Some(0) => return Ok(()),
                Some(1) => return self.in_full(decoder),
                Some(beyond) => self.current = (self.current + beyond as usize - 1) % SEQUENCES,
            }
        }
        Err(Error::new(ErrorKind::InvalidData, "expected a GPS time, got a second switch of sequences"))
    }

    /// Decodes a step of a sequence without a usual step, and makes it the usual step.
    fn first_step<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        let sequence = &mut self.sequences[self.current];
        let step = self.numbers.decompress(decoder, 0, context::FIRST)?;
        *sequence = Sequence { last: sequence.last.wrapping_add(step.into()), step, misfits: 0 };
        Ok(())
    }

    /// Decodes a multiple of the usual step, with a correction.
    fn multiple<R: Read>(&mut self, symbol: u32, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        let sequence = &mut self.sequences[self.current];
        let symbol = symbol.cast_signed();
        let multiple = if symbol <= LARGEST { symbol } else { LARGEST - symbol };
        let context = match multiple {
            0 => context::NONE,
            1 => context::USUAL,
            2..10 => context::BELOW_TEN,
            10..LARGEST => context::UP_TO_LARGEST,
            LARGEST => context::LARGEST,
            SMALLEST => context::SMALLEST,
            _ => context::NEGATIVE,
        };
        let step = self.numbers.decompress(decoder, sequence.step.wrapping_mul(multiple), context)?;
        sequence.last = sequence.last.wrapping_add(step.into());
        match multiple {
            1 => sequence.misfits = 0,
            0 | LARGEST | SMALLEST => sequence.misfits += 1,
            _ => (),
        }
        if sequence.misfits == MISFITS {
            sequence.step = step;
            sequence.misfits = 0;
        }
        Ok(())
    }

    /// Decodes a full time, which starts a new sequence in place of the oldest.
    fn in_full<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        let before = self.sequences[self.current].last >> 32;
        let upper = self.numbers.decompress(decoder, before as i32, context::WHOLE)?;
        let last = (i64::from(upper) << 32) | i64::from(decoder.read_int()?);
        self.newest = (self.newest + 1) % SEQUENCES;
        self.current = self.newest;
        self.sequences[self.current] = Sequence { last, step: 0, misfits: 0 };
        Ok(())
    }
}

impl<R: Read> FieldDecompressor<R> for Times {
    fn size_of_field(&self) -> usize {
        SIZE
    }

    fn decompress_first(&mut self, source: &mut R, time: &mut [u8]) -> Result<()> {
        let mut bytes = [0; SIZE];
        source.read_exact(&mut bytes)?;
        self.sequences[0].last = i64::from_le_bytes(bytes);
        time.copy_from_slice(&bytes);
        Ok(())
    }

    fn decompress_with(&mut self, decoder: &mut ArithmeticDecoder<R>, time: &mut [u8]) -> Result<()> {
        self.next(decoder)?;
        time.copy_from_slice(&self.sequences[self.current].last.to_le_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use laz::las::v2::{GpsTimeCompressor, GpsTimeDecompressor};
    use laz::record::{
        RecordCompressor, RecordDecompressor, SequentialPointRecordCompressor,
        SequentialPointRecordDecompressor,
    };
    use proptest::prelude::*;

    use super::*;
    use crate::guard::guarded;

    fn packed(times: &[i64]) -> Vec<u8> {
        let mut packer = SequentialPointRecordCompressor::new(Vec::new());
        packer.add_field_compressor(GpsTimeCompressor::default());
        for time in times {
            packer.compress_next(&time.to_le_bytes()).unwrap();
        }
        packer.done().unwrap();
        packer.into_inner()
    }

    fn unpacked<'a>(
        packed: &'a [u8],
        count: usize,
        by: impl FieldDecompressor<&'a [u8]> + Send + Sync + 'a,
    ) -> (Vec<i64>, Option<Error>) {
        let mut decoder = SequentialPointRecordDecompressor::new(packed);
        decoder.add_field_decompressor(by);
        let mut times = Vec::new();
        for _ in 0..count {
            let mut time = [0; SIZE];
            if let Err(cause) = decoder.decompress_next(&mut time) {
                return (times, Some(cause));
            }
            times.push(i64::from_le_bytes(time));
        }
        (times, None)
    }

    /// A way in which a time follows from earlier times.
    #[derive(Debug, Clone, Copy)]
    enum Move {
        Same,
        Multiple(i64),
        Step(i64),
        /// A time in one of eight sequences; the compressor keeps four.
        Line(usize),
        Any(i64),
    }

    fn moves() -> impl Strategy<Value = Move> {
        prop_oneof![
            2 => Just(Move::Same),
            8 => (-12_i64..520).prop_map(Move::Multiple),
            4 => Just(Move::Multiple(1)),
            2 => any::<i32>().prop_map(|step| Move::Step(step.into())),
            3 => (0_usize..8).prop_map(Move::Line),
            // Larger times overflow in `laz`.
            1 => (0_i64..1 << 61).prop_map(Move::Any),
        ]
    }

    fn times(moves: &[Move], usual: i64) -> Vec<i64> {
        let mut lines: [i64; 8] = [0, 1, 2, 3, 4, 5, 6, 7].map(|line| line << 40);
        let mut line = 0;
        let one_more = |next: &Move| {
            lines[line] = match *next {
                Move::Same => lines[line],
                Move::Multiple(multiple) => lines[line].wrapping_add(multiple * usual + multiple % 3),
                Move::Step(step) => lines[line].wrapping_add(step),
                Move::Line(other) => {
                    line = other;
                    lines[line] + usual
                }
                Move::Any(time) => time,
            };
            lines[line]
        };
        moves.iter().map(one_more).collect()
    }

    proptest! {
        #[test]
        fn times_come_out_as_they_went_in(
            moves in prop::collection::vec(moves(), 1..400),
            usual in -70_000_i64..70_000,
        ) {
            let times = times(&moves, usual);
            let packed = packed(&times);
            let (ours, failed) = unpacked(&packed, times.len(), Times::default());
            prop_assert!(failed.is_none(), "{failed:?}");
            prop_assert_eq!(&ours, &times);
            prop_assert_eq!(ours, unpacked(&packed, times.len(), GpsTimeDecompressor::default()).0);
        }

        /// Uses sequences that are short enough for the stack of `laz`.
        #[test]
        fn damaged_times_are_those_of_laz_up_to_the_first_that_is_refused(
            moves in prop::collection::vec(moves(), 1..100),
            damage in prop::collection::vec((8_usize..600, any::<u8>()), 1..8),
        ) {
            let times = times(&moves, 1000);
            let mut packed = packed(&times);
            for (at, byte) in damage {
                if let Some(there) = packed.get_mut(at) {
                    *there = byte;
                }
            }
            // Debug builds of the decoder of `laz` panic on some damaged data, as do its times if
            // they overflow.
            let ours = guarded(|| unpacked(&packed, times.len(), Times::default()));
            let Some((ours, failed)) = ours else { return Ok(()) };
            let theirs = guarded(|| unpacked(&packed, ours.len(), GpsTimeDecompressor::default()));
            if let Some((theirs, _)) = theirs {
                prop_assert_eq!(&ours, &theirs);
            }
            prop_assert!(failed.is_some() || ours.len() == times.len());
        }
    }
}
