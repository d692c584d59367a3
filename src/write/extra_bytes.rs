//! The record that describes extra bytes of LAS points (`LASF_Spec`, 4), with one more kind of them.

/// Bytes of the description of one kind of extra bytes.
const DESCRIPTION_BYTES: usize = 192;
const TYPE_AT: usize = 2;
const OPTIONS_AT: usize = 3;
const NAME: std::ops::Range<usize> = 4..36;
const TEXT: std::ops::Range<usize> = 160..192;
/// Type of bytes of which nothing is known; the options then hold how many.
const UNDOCUMENTED: u8 = 0;
/// Type `int`, 32 bits.
const INT: u8 = 6;
/// Name of the new kind.
const GRAIN_ID: &[u8] = b"grain_id";
/// Name of one of that name that is there already: a cloud that was labelled before.
const OLD_GRAIN_ID: &[u8] = b"input_grain_id";
const EXPLANATION: &[u8] = b"grain of the point, -1: none";

/// The descriptions of `extra_bytes` bytes, as `described` has them, and of `grain_id` behind them. Bytes that nobody
/// described are, as undocumented: readers add up lengths to find where `grain_id` lies. `None` if `described`
/// contradicts the points, so that nothing can be found behind.
pub(super) fn with_grain_id(described: &[u8], extra_bytes: usize) -> Option<Vec<u8>> {
    let mut all = Vec::with_capacity(described.len() + 2 * DESCRIPTION_BYTES);
    let mut left = extra_bytes;
    for description in described.chunks_exact(DESCRIPTION_BYTES) {
        left = left.checked_sub(bytes_of(description))?;
        let start = all.len();
        all.extend_from_slice(description);
        let name = &description[NAME];
        let name = &name[..name.iter().position(|&b| b == 0).unwrap_or(name.len())];
        if name == GRAIN_ID {
            put(&mut all[start..][NAME], OLD_GRAIN_ID);
        }
    }
    while left > 0 {
        let bytes = left.min(usize::from(u8::MAX));
        all.extend(description(UNDOCUMENTED, bytes as u8, b"undocumented", b""));
        left -= bytes;
    }
    all.extend(description(INT, 0, GRAIN_ID, EXPLANATION));
    Some(all)
}

/// Bytes of a point that are described. Types above 10 are the pairs and triples of LAS 1.3, since withdrawn.
fn bytes_of(description: &[u8]) -> usize {
    let scalar = |number: u8| match number {
        1 | 2 => 1,
        3 | 4 => 2,
        5 | 6 | 9 => 4,
        _ => 8,
    };
    match description[TYPE_AT] {
        UNDOCUMENTED => usize::from(description[OPTIONS_AT]),
        number @ 1..=10 => scalar(number),
        number @ 11..=20 => 2 * scalar(number - 10),
        number @ 21..=30 => 3 * scalar(number - 20),
        _ => 0,
    }
}

fn description(number: u8, options: u8, name: &[u8], text: &[u8]) -> [u8; DESCRIPTION_BYTES] {
    let mut description = [0; DESCRIPTION_BYTES];
    description[TYPE_AT] = number;
    description[OPTIONS_AT] = options;
    put(&mut description[NAME], name);
    put(&mut description[TEXT], text);
    description
}

fn put(field: &mut [u8], text: &[u8]) {
    field.fill(0);
    field[..text.len()].copy_from_slice(text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_all_kinds_add_up() {
        let described = [(4, 0), (9, 0), (UNDOCUMENTED, 3), (10, 0), (22, 0)];
        let described: Vec<u8> = described.iter().flat_map(|&(n, o)| description(n, o, b"kind", b"")).collect();
        assert_eq!(described.chunks(DESCRIPTION_BYTES).map(bytes_of).sum::<usize>(), 2 + 4 + 3 + 8 + 3);
        let found = with_grain_id(&described, 20).expect("fits");
        assert_eq!(found.len(), 6 * DESCRIPTION_BYTES);
        assert_eq!(&found[..described.len()], described.as_slice());
        assert_eq!(with_grain_id(&described, 19), None);
    }

    #[test]
    fn bytes_that_nobody_described_are_and_an_old_label_is_renamed() {
        let old = description(INT, 0, GRAIN_ID, b"");
        let found = with_grain_id(&old, 4 + 300).expect("fits");
        let names: Vec<_> = found
            .chunks(DESCRIPTION_BYTES)
            .map(|d| (String::from_utf8_lossy(&d[NAME]).trim_end_matches('\0').to_owned(), bytes_of(d)))
            .collect();
        let expected = [("input_grain_id", 4), ("undocumented", 255), ("undocumented", 45), ("grain_id", 4)];
        assert_eq!(names, expected.map(|(name, bytes)| (name.to_owned(), bytes)));
    }
}
