//! NumPy arrays of N × 3 numbers, `.npy` of format versions 1 to 3.

use crate::columns::{Holds, Row};
use crate::error::{Broken, Fault};
use crate::rows::{Encoding, Layout, Rows};
use crate::scalar::{Order, Scalar};
use crate::text::{Line, shown};

/// The magic number at the start of the file.
pub(crate) const MAGIC: &[u8] = b"\x93NUMPY";

/// Number of coordinates of a point.
const COLUMNS: usize = 3;

/// Parses the header at the start of a file.
pub(crate) fn layout(head: &[u8]) -> Result<Layout, Broken> {
    let after = MAGIC.len() + 2;
    // The length of the header takes two bytes in version 1, and four later.
    let wide = if head.get(MAGIC.len()) == Some(&1) { 2 } else { 4 };
    let cut = || Fault::PastEnd.at_byte(head.len());
    let length = head.get(after..after + wide).ok_or_else(cut)?;
    let length = length.iter().rev().fold(0_usize, |sum, byte| sum << 8 | usize::from(*byte));
    let at = after + wide;
    let header = at.checked_add(length).and_then(|end| head.get(at..end)).ok_or_else(cut)?;
    let wrong = |expected, found: &[u8]| Fault::Expected { expected, found: shown(found) }.at_byte(at);
    let entry = |key: &'static str| {
        let quoted = [format!("'{key}':"), format!("\"{key}\":")];
        let start = quoted.iter().find_map(|key| {
            let found = header.windows(key.len()).position(|window| window == key.as_bytes())?;
            Some(found + key.len())
        });
        let value = start.map(|start| header[start..].trim_ascii_start());
        value.ok_or_else(|| wrong("a header with descr, fortran_order and shape", header))
    };
    let is_contiguous = entry("fortran_order")?.starts_with(b"False");
    if !is_contiguous {
        let expected = "'fortran_order': False, as saved from `numpy.ascontiguousarray(points)`";
        return Err(wrong(expected, entry("fortran_order").unwrap_or_default()));
    }
    let (scalar, order) = kind(entry("descr")?).ok_or_else(|| {
        wrong("floats or integers, such as '<f4' or '<f8'", entry("descr").unwrap_or_default())
    })?;
    let points = shape(entry("shape")?)
        .ok_or_else(|| wrong("the shape (N, 3)", entry("shape").unwrap_or_default()))?;
    Ok(Layout {
        start: at + length,
        encoding: Encoding::Binary { stride: COLUMNS * scalar.size() },
        element: "point".into(),
        promised: Some((points, 1)),
        holds: Holds::default(),
        rows: Box::new(Numbers { scalar, order }),
    })
}

/// Parses a type of numbers, such as `'<f8'`.
fn kind(text: &[u8]) -> Option<(Scalar, Order)> {
    let [quote @ (b'\'' | b'"'), order, kind, size, end, ..] = text else { return None };
    if quote != end {
        return None;
    }
    let scalar = match (kind, size) {
        (b'f', b'4') => Scalar::F32,
        (b'f', b'8') => Scalar::F64,
        (b'i', b'1') => Scalar::I8,
        (b'i', b'2') => Scalar::I16,
        (b'i', b'4') => Scalar::I32,
        (b'i', b'8') => Scalar::I64,
        (b'u', b'1') => Scalar::U8,
        (b'u', b'2') => Scalar::U16,
        (b'u', b'4') => Scalar::U32,
        (b'u', b'8') => Scalar::U64,
        _ => return None,
    };
    match order {
        b'<' | b'|' => Some((scalar, Order::Little)),
        b'>' => Some((scalar, Order::Big)),
        _ => None,
    }
}

/// Parses a shape `(N, 3)` and returns N.
fn shape(text: &[u8]) -> Option<u64> {
    let inner = text.strip_prefix(b"(")?;
    let inner = &inner[..inner.iter().position(|byte| *byte == b')')?];
    let mut sizes = inner.split(|byte| *byte == b',').map(<[u8]>::trim_ascii).filter(|size| !size.is_empty());
    let mut size = || std::str::from_utf8(sizes.next()?).ok()?.parse::<u64>().ok();
    let (points, columns) = (size()?, size()?);
    (columns == COLUMNS as u64 && sizes.next().is_none()).then_some(points)
}

struct Numbers {
    scalar: Scalar,
    order: Order,
}

impl Rows for Numbers {
    fn is_row(&self, _: &Line<'_>) -> bool {
        false
    }

    fn line(&self, _: Line<'_>, _: &mut Row) -> Result<(), Fault> {
        Ok(())
    }

    fn record(&self, bytes: &[u8], row: &mut Row) {
        for (value, number) in row.iter_mut().zip(bytes.chunks_exact(self.scalar.size())) {
            *value = self.scalar.read(number, self.order).unwrap_or_default();
        }
    }
}
