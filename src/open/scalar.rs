//! The eight number types of PLY, and the two of 64 bits that some programs add.

/// A number type, little endian in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// `char`, `int8`.
    I8,
    /// `uchar`, `uint8`.
    U8,
    /// `short`, `int16`.
    I16,
    /// `ushort`, `uint16`.
    U16,
    /// `int`, `int32`.
    I32,
    /// `uint`, `uint32`.
    U32,
    /// `int64`.
    I64,
    /// `uint64`.
    U64,
    /// `float`, `float32`.
    F32,
    /// `double`, `float64`.
    F64,
}

#[inline]
fn take<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut out = [0; N];
    out.copy_from_slice(&bytes[..N]);
    out
}

impl Scalar {
    /// Length in bytes.
    #[inline]
    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::I64 | Scalar::U64 | Scalar::F64 => 8,
        }
    }

    /// The type's classic PLY name, such as `uchar`.
    pub fn ply_name(self) -> &'static str {
        match self {
            Scalar::I8 => "char",
            Scalar::U8 => "uchar",
            Scalar::I16 => "short",
            Scalar::U16 => "ushort",
            Scalar::I32 => "int",
            Scalar::U32 => "uint",
            Scalar::I64 => "int64",
            Scalar::U64 => "uint64",
            Scalar::F32 => "float",
            Scalar::F64 => "double",
        }
    }

    /// Whether the type holds whole numbers.
    pub fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }

    /// The number at the start of `bytes`, which must be long enough.
    #[inline]
    pub fn number(self, bytes: &[u8]) -> f64 {
        match self {
            Scalar::F32 => f64::from(f32::from_le_bytes(take(bytes))),
            Scalar::F64 => f64::from_le_bytes(take(bytes)),
            Scalar::U64 => u64::from_le_bytes(take(bytes)) as f64,
            // Exact up to 2^53.
            _ => self.integer(bytes) as f64,
        }
    }

    /// The whole number at the start of `bytes`, which must be long enough; truncated for float types. A `uint64` from
    /// 2^63 on comes out negative, with the same bits: no count and no index is so large, and -1 is what is meant.
    #[inline]
    pub fn integer(self, bytes: &[u8]) -> i64 {
        match self {
            Scalar::I8 => i64::from(i8::from_le_bytes(take(bytes))),
            Scalar::U8 => i64::from(bytes[0]),
            Scalar::I16 => i64::from(i16::from_le_bytes(take(bytes))),
            Scalar::U16 => i64::from(u16::from_le_bytes(take(bytes))),
            Scalar::I32 => i64::from(i32::from_le_bytes(take(bytes))),
            Scalar::U32 => i64::from(u32::from_le_bytes(take(bytes))),
            Scalar::I64 => i64::from_le_bytes(take(bytes)),
            Scalar::U64 => u64::from_le_bytes(take(bytes)) as i64,
            Scalar::F32 => f32::from_le_bytes(take(bytes)) as i64,
            Scalar::F64 => f64::from_le_bytes(take(bytes)) as i64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_reads_its_own_bytes() {
        assert_eq!(Scalar::I8.integer(&[0xff]), -1);
        assert_eq!(Scalar::U8.integer(&[0xff]), 255);
        assert_eq!(Scalar::I16.number(&[0xfe, 0xff]), -2.0);
        assert_eq!(Scalar::U16.number(&[0xfe, 0xff]), 65534.0);
        assert_eq!(Scalar::I32.integer(&(-7i32).to_le_bytes()), -7);
        assert_eq!(Scalar::U32.integer(&3_000_000_000u32.to_le_bytes()), 3_000_000_000);
        assert_eq!(Scalar::I64.integer(&(-7i64).to_le_bytes()), -7);
        assert_eq!(Scalar::U64.integer(&(1u64 << 40).to_le_bytes()), 1 << 40);
        assert_eq!(Scalar::U64.number(&u64::MAX.to_le_bytes()), 18_446_744_073_709_551_615.0);
        assert_eq!(Scalar::F32.number(&0.25f32.to_le_bytes()), 0.25);
        assert_eq!(Scalar::F64.number(&5_250_000.1f64.to_le_bytes()), 5_250_000.1);
    }
}
