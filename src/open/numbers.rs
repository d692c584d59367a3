//! Numbers one behind the other, in each of the encodings of PLY.

use super::printed::decimals;
use super::scalar::Scalar;
use super::transcode::{Flaw, Value};

/// A payload that is read from front to back.
pub(super) trait Numbers {
    /// The next number, which has this type.
    fn next(&mut self, scalar: Scalar) -> Result<Value, Flaw>;
    /// Passes over so many numbers of this type.
    fn skip(&mut self, scalar: Scalar, numbers: u64) -> Result<(), Flaw>;
    /// Bytes read so far.
    fn read(&self) -> usize;
}

/// Numbers with the lowest byte first.
pub(super) struct LittleEndian<'a> {
    payload: &'a [u8],
    at: usize,
}

impl<'a> LittleEndian<'a> {
    pub(super) fn new(payload: &'a [u8]) -> Self {
        LittleEndian { payload, at: 0 }
    }
}

impl Numbers for LittleEndian<'_> {
    fn next(&mut self, scalar: Scalar) -> Result<Value, Flaw> {
        let bytes = self.payload.get(self.at..self.at + scalar.size()).ok_or(Flaw::End)?;
        self.at += scalar.size();
        Ok(value(scalar, bytes))
    }

    fn skip(&mut self, scalar: Scalar, numbers: u64) -> Result<(), Flaw> {
        let room = self.payload.len() - self.at;
        let bytes = usize::try_from(numbers).ok().and_then(|n| n.checked_mul(scalar.size()));
        self.at += bytes.filter(|&bytes| bytes <= room).ok_or(Flaw::End)?;
        Ok(())
    }

    fn read(&self) -> usize {
        self.at
    }
}

/// Numbers with the highest byte first.
pub(super) struct BigEndian<'a>(LittleEndian<'a>);

impl<'a> BigEndian<'a> {
    pub(super) fn new(payload: &'a [u8]) -> Self {
        BigEndian(LittleEndian::new(payload))
    }
}

impl Numbers for BigEndian<'_> {
    fn next(&mut self, scalar: Scalar) -> Result<Value, Flaw> {
        let within = &mut self.0;
        let bytes = within.payload.get(within.at..within.at + scalar.size()).ok_or(Flaw::End)?;
        within.at += scalar.size();
        let mut turned = [0; 8];
        let turned = &mut turned[..scalar.size()];
        turned.copy_from_slice(bytes);
        turned.reverse();
        Ok(value(scalar, turned))
    }

    fn skip(&mut self, scalar: Scalar, numbers: u64) -> Result<(), Flaw> {
        self.0.skip(scalar, numbers)
    }

    fn read(&self) -> usize {
        self.0.at
    }
}

fn value(scalar: Scalar, bytes: &[u8]) -> Value {
    if scalar.is_integer() { Value::Whole(scalar.integer(bytes)) } else { Value::Real(scalar.number(bytes)) }
}

/// Numbers as text, with white space between them.
pub(super) struct Text<'a> {
    payload: &'a [u8],
    at: usize,
    line: u64,
}

/// A word longer than this is no number.
const LONGEST_WORD: usize = 400;

impl<'a> Text<'a> {
    pub(super) fn new(payload: &'a [u8]) -> Self {
        Text { payload, at: 0, line: 1 }
    }

    fn word(&mut self) -> Result<&'a [u8], Flaw> {
        let rest = &self.payload[self.at..];
        let space = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or(Flaw::End)?;
        self.line += line_ends(&rest[..space]);
        let word = &rest[space..];
        let word = &word[..word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len())];
        self.at += space + word.len();
        Ok(word)
    }
}

impl Numbers for Text<'_> {
    fn next(&mut self, scalar: Scalar) -> Result<Value, Flaw> {
        let word = self.word()?;
        let text = std::str::from_utf8(word).ok().filter(|text| text.len() <= LONGEST_WORD);
        let found = text.and_then(|text| match scalar {
            // Its type says how precise a number is. Coordinates are not asked for as floats.
            Scalar::F32 => text.parse::<f32>().ok().map(|x| Value::Real(f64::from(x))),
            Scalar::F64 => text.parse().ok().map(|real| Value::Printed { real, decimals: decimals(text) }),
            Scalar::U64 => text.parse::<u64>().ok().map(|n| Value::Whole(n as i64)),
            _ => whole(text).filter(|&n| fits(scalar, n)).map(Value::Whole),
        });
        found.ok_or_else(|| {
            let text = String::from_utf8_lossy(&word[..word.len().min(40)]);
            Flaw::Text { line: self.line, text: text.chars().filter(|c| !c.is_control()).collect() }
        })
    }

    fn skip(&mut self, scalar: Scalar, numbers: u64) -> Result<(), Flaw> {
        (0..numbers).try_for_each(|_| self.next(scalar).map(|_| ()))
    }

    fn read(&self) -> usize {
        // The end of the last line is no finding.
        let rest = &self.payload[self.at..];
        self.at + if rest.iter().all(u8::is_ascii_whitespace) { rest.len() } else { 0 }
    }
}

/// Line feeds, carriage returns, and both together, which count once.
fn line_ends(space: &[u8]) -> u64 {
    let ends = |i: usize| space[i] == b'\n' || space[i] == b'\r' && space.get(i + 1) != Some(&b'\n');
    (0..space.len()).filter(|&i| ends(i)).count() as u64
}

/// A whole number; some programs write it with a point.
fn whole(text: &str) -> Option<i64> {
    text.parse().ok().or_else(|| {
        let real: f64 = text.parse().ok()?;
        (real.fract() == 0.0 && real.abs() < 1e15).then_some(real as i64)
    })
}

fn fits(scalar: Scalar, n: i64) -> bool {
    match scalar {
        Scalar::I8 => i8::try_from(n).is_ok(),
        Scalar::U8 => u8::try_from(n).is_ok(),
        Scalar::I16 => i16::try_from(n).is_ok(),
        Scalar::U16 => u16::try_from(n).is_ok(),
        Scalar::I32 => i32::try_from(n).is_ok(),
        Scalar::U32 => u32::try_from(n).is_ok(),
        Scalar::U64 => u64::try_from(n).is_ok(),
        Scalar::I64 | Scalar::F32 | Scalar::F64 => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(numbers: &mut impl Numbers, types: &[Scalar]) -> Vec<Value> {
        types.iter().map(|&t| numbers.next(t).unwrap_or_else(|_| panic!("a number"))).collect()
    }

    #[test]
    fn the_same_numbers_come_from_every_encoding() {
        let types = [Scalar::I8, Scalar::U16, Scalar::I32, Scalar::F32, Scalar::F64];
        let expected = [
            Value::Whole(-2),
            Value::Whole(65_000),
            Value::Whole(-7),
            Value::Real(f64::from(0.1f32)),
            Value::Real(5_250_000.1),
        ];
        let mut little = vec![0xfe];
        little.extend(65_000u16.to_le_bytes());
        little.extend((-7i32).to_le_bytes());
        little.extend(0.1f32.to_le_bytes());
        little.extend(5_250_000.1f64.to_le_bytes());
        let mut big = vec![0xfe];
        big.extend(65_000u16.to_be_bytes());
        big.extend((-7i32).to_be_bytes());
        big.extend(0.1f32.to_be_bytes());
        big.extend(5_250_000.1f64.to_be_bytes());
        assert_eq!(all(&mut LittleEndian::new(&little), &types), expected);
        assert_eq!(all(&mut BigEndian::new(&big), &types), expected);
        let expected = expected.map(|v| match v {
            Value::Real(real) if real > 1e6 => Value::Printed { real, decimals: 1 },
            other => other,
        });
        assert_eq!(all(&mut Text::new(b" -2 65000\r\n-7.0\t0.1\n5250000.1\n"), &types), expected);
    }

    #[test]
    fn a_word_that_is_no_number_of_its_type_is_told_with_its_line() {
        for (text, scalar) in [("x", Scalar::F32), ("300", Scalar::U8), ("-1", Scalar::U32), ("1.5", Scalar::I32)] {
            let payload = format!("1\n\n {text} ");
            let mut numbers = Text::new(payload.as_bytes());
            assert!(numbers.next(Scalar::U8).is_ok());
            match numbers.next(scalar) {
                Err(Flaw::Text { line, text: found }) => assert_eq!((line, found.as_str()), (3, text)),
                _ => panic!("{text} was taken for a {}", scalar.ply_name()),
            }
        }
        assert!(matches!(Text::new(b"  \n").next(Scalar::F32), Err(Flaw::End)));
        assert!(matches!(BigEndian::new(&[1, 2]).next(Scalar::F32), Err(Flaw::End)));
    }
}
