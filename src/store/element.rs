//! Numbers as little-endian bytes, without unsafe code; the loops compile to copies.

/// A value of fixed width in a [`super::ColumnFile`].
pub trait Element: Copy {
    /// Bytes of one value.
    const BYTES: usize;

    /// Appends the values of `bytes`, of which an incomplete last one is left out.
    fn read(bytes: &[u8], values: &mut Vec<Self>);

    /// Appends the bytes of `values`.
    fn write(values: &[Self], bytes: &mut Vec<u8>);
}

macro_rules! little_endian_number {
    ($($number:ty),*) => {$(
        impl Element for $number {
            const BYTES: usize = size_of::<$number>();

            fn read(bytes: &[u8], values: &mut Vec<$number>) {
                let (each, _) = bytes.as_chunks::<{ size_of::<$number>() }>();
                values.extend(each.iter().map(|&b| <$number>::from_le_bytes(b)));
            }

            fn write(values: &[$number], bytes: &mut Vec<u8>) {
                let first = bytes.len();
                bytes.resize(first + size_of_val(values), 0);
                let (each, _) = bytes[first..].as_chunks_mut::<{ size_of::<$number>() }>();
                each.iter_mut().zip(values).for_each(|(b, v)| *b = v.to_le_bytes());
            }
        }
    )*};
}

little_endian_number!(u8, u16, u32, u64, f64);

/// Several numbers side by side, such as the three coordinates of a position.
impl<E: Element, const N: usize> Element for [E; N] {
    const BYTES: usize = N * E::BYTES;

    fn read(bytes: &[u8], values: &mut Vec<[E; N]>) {
        let mut numbers = Vec::with_capacity(bytes.len() / E::BYTES);
        E::read(bytes, &mut numbers);
        values.extend(numbers.as_chunks::<N>().0);
    }

    fn write(values: &[[E; N]], bytes: &mut Vec<u8>) {
        E::write(values.as_flattened(), bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back<E: Element + PartialEq + std::fmt::Debug>(values: &[E], expected: &[u8]) {
        let (mut bytes, mut back) = (vec![9], Vec::new());
        E::write(values, &mut bytes);
        assert_eq!(bytes[1..], *expected);
        assert_eq!(bytes.len() - 1, E::BYTES * values.len());
        bytes.push(255);
        E::read(&bytes[1..], &mut back);
        assert_eq!(back, values);
    }

    #[test]
    fn numbers_are_little_endian() {
        there_and_back(&[0x0102u16, 3], &[2, 1, 3, 0]);
        there_and_back(&[0x0102_0304u32], &[4, 3, 2, 1]);
        there_and_back(&[0x0102_0304_0506_0708u64], &[8, 7, 6, 5, 4, 3, 2, 1]);
        there_and_back(&[-2.0f64, 0.0], &[0, 0, 0, 0, 0, 0, 0, 0xc0, 0, 0, 0, 0, 0, 0, 0, 0]);
        there_and_back(&[[1u16, 2, 3], [4, 5, 6]], &[1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0]);
    }

    #[test]
    fn the_bits_of_odd_numbers_survive() {
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, f64::MIN_POSITIVE / 8.0];
        let (mut bytes, mut back) = (Vec::new(), Vec::new());
        f64::write(&odd, &mut bytes);
        f64::read(&bytes, &mut back);
        assert_eq!(back.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), odd.map(f64::to_bits));
    }
}
