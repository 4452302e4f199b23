//! Binary numbers.

/// A type of binary number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// A byte order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    Little,
    Big,
}

impl Scalar {
    /// Length in bytes.
    pub(crate) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Reads the number at the start of `bytes`, if it is long enough. Exact, except for 64-bit
    /// integers beyond 2^53.
    #[inline]
    pub(crate) fn read(self, bytes: &[u8], order: Order) -> Option<f64> {
        Some(match self {
            Self::I8 => i8::from_le_bytes(array(bytes, order)?).into(),
            Self::U8 => u8::from_le_bytes(array(bytes, order)?).into(),
            Self::I16 => i16::from_le_bytes(array(bytes, order)?).into(),
            Self::U16 => u16::from_le_bytes(array(bytes, order)?).into(),
            Self::I32 => i32::from_le_bytes(array(bytes, order)?).into(),
            Self::U32 => u32::from_le_bytes(array(bytes, order)?).into(),
            Self::I64 => i64::from_le_bytes(array(bytes, order)?) as f64,
            Self::U64 => u64::from_le_bytes(array(bytes, order)?) as f64,
            Self::F32 => f32::from_le_bytes(array(bytes, order)?).into(),
            Self::F64 => f64::from_le_bytes(array(bytes, order)?),
        })
    }
}

#[inline]
fn array<const N: usize>(bytes: &[u8], order: Order) -> Option<[u8; N]> {
    let mut array: [u8; N] = *bytes.first_chunk()?;
    if order == Order::Big {
        array.reverse();
    }
    Some(array)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_in_both_orders() {
        let cases: [(Scalar, &[u8], f64); 10] = [
            (Scalar::I8, &[0xff], -1.0),
            (Scalar::U8, &[0xff], 255.0),
            (Scalar::I16, &[0xfe, 0xff], -2.0),
            (Scalar::U16, &[0x01, 0x02], 513.0),
            (Scalar::I32, &(-70_000_i32).to_le_bytes(), -70_000.0),
            (Scalar::U32, &u32::MAX.to_le_bytes(), 4_294_967_295.0),
            (Scalar::I64, &(-5_i64).to_le_bytes(), -5.0),
            (Scalar::U64, &(1_u64 << 40).to_le_bytes(), 1_099_511_627_776.0),
            (Scalar::F32, &0.1_f32.to_le_bytes(), 0.1_f32 as f64),
            (Scalar::F64, &0.1_f64.to_le_bytes(), 0.1),
        ];
        for (scalar, little, value) in cases {
            assert_eq!(scalar.size(), little.len(), "{scalar:?}");
            let mut big = little.to_vec();
            big.reverse();
            assert_eq!(scalar.read(little, Order::Little), Some(value), "{scalar:?}");
            assert_eq!(scalar.read(&big, Order::Big), Some(value), "{scalar:?}");
            assert_eq!(scalar.read(&big[1..], Order::Big), None, "{scalar:?}, a byte short");
        }
    }
}
