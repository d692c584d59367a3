//! The bytes of a ledger. All numbers are little-endian.
//!
//! ```text
//! header:  "GRVLEDGR"  u32 format  u32 length of the identity  identity (UTF-8)  u64 checksum
//! record:  u64 key     u64 length of the payload               payload           u64 checksum
//! ```
//!
//! Checksums are XXH3-64 of all bytes before them in the header or record. That of a record takes the
//! record's position as its seed, so that a whole record in the wrong place is none.

use std::hash::Hasher;
use std::io::{self, BufRead};
use twox_hash::XxHash3_64;

pub(super) const MAGIC: [u8; 8] = *b"GRVLEDGR";
pub(super) const FORMAT: u32 = 1;
/// Bytes of a record before its payload.
pub(super) const HEAD_BYTES: u64 = 16;
const CHECKSUM_BYTES: u64 = 8;
/// Bytes of a record beside its payload.
pub(super) const FRAME_BYTES: u64 = HEAD_BYTES + CHECKSUM_BYTES;

/// Where a record lies in a ledger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    /// What the record is about.
    pub key: u64,
    /// Byte at which it begins.
    pub position: u64,
    /// Length of its payload.
    pub payload_bytes: u64,
}

/// What stands in place of a header.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Header {
    Whole { identity: String, bytes: u64 },
    Foreign,
    OtherFormat(u32),
    Damaged,
}

pub(super) fn header(identity: &str) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(FORMAT.to_le_bytes());
    bytes.extend((identity.len() as u32).to_le_bytes());
    bytes.extend(identity.as_bytes());
    bytes.extend(XxHash3_64::oneshot(&bytes).to_le_bytes());
    bytes
}

/// Reads the header of a file of `file_bytes`.
pub(super) fn read_header(input: &mut impl BufRead, file_bytes: u64) -> io::Result<Header> {
    let mut head = [0; 16];
    if file_bytes < head.len() as u64 {
        return Ok(Header::Foreign);
    }
    input.read_exact(&mut head)?;
    let (words, _) = head.as_chunks::<4>();
    let (format, length) = (u32::from_le_bytes(words[2]), u32::from_le_bytes(words[3]));
    let bytes = head.len() as u64 + u64::from(length) + CHECKSUM_BYTES;
    if head[..8] != MAGIC {
        return Ok(Header::Foreign);
    } else if format != FORMAT {
        return Ok(Header::OtherFormat(format));
    } else if bytes > file_bytes {
        return Ok(Header::Damaged);
    }
    let mut identity = vec![0; length as usize];
    input.read_exact(&mut identity)?;
    let mut hash = XxHash3_64::new();
    hash.write(&head);
    hash.write(&identity);
    let whole = read_u64(input)? == hash.finish();
    Ok(match String::from_utf8(identity) {
        Ok(identity) if whole => Header::Whole { identity, bytes },
        _ => Header::Damaged,
    })
}

pub(super) fn record(key: u64, payload: &[u8], position: u64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(payload.len() + FRAME_BYTES as usize);
    bytes.extend(key.to_le_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    bytes.extend(payload);
    bytes.extend(XxHash3_64::oneshot_with_seed(position, &bytes).to_le_bytes());
    bytes
}

/// The key of a record and the length of its payload.
pub(super) fn key_and_length(head: &[u8; HEAD_BYTES as usize]) -> (u64, u64) {
    let (numbers, _) = head.as_chunks::<8>();
    (u64::from_le_bytes(numbers[0]), u64::from_le_bytes(numbers[1]))
}

/// Checksum of the record at `position` that begins with `head`.
pub(super) fn checksum(head: &[u8], payload: &[u8], position: u64) -> u64 {
    let mut hash = XxHash3_64::with_seed(position);
    hash.write(head);
    hash.write(payload);
    hash.finish()
}

/// Proves the record at `position` of a file of `file_bytes`, without keeping its payload; none if there is
/// no whole one.
pub(super) fn scan_record(input: &mut impl BufRead, position: u64, file_bytes: u64) -> io::Result<Option<Entry>> {
    let there = file_bytes.saturating_sub(position);
    if there < FRAME_BYTES {
        return Ok(None);
    }
    let mut head = [0; HEAD_BYTES as usize];
    input.read_exact(&mut head)?;
    let (key, payload_bytes) = key_and_length(&head);
    let entry = Entry { key, position, payload_bytes };
    if entry.payload_bytes > there - FRAME_BYTES {
        return Ok(None);
    }
    let mut hash = XxHash3_64::with_seed(position);
    hash.write(&head);
    let mut left = entry.payload_bytes;
    while left > 0 {
        let chunk = input.fill_buf()?;
        if chunk.is_empty() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let taken = chunk.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        hash.write(&chunk[..taken]);
        input.consume(taken);
        left -= taken as u64;
    }
    Ok((read_u64(input)? == hash.finish()).then_some(entry))
}

fn read_u64(input: &mut impl BufRead) -> io::Result<u64> {
    let mut bytes = [0; 8];
    input.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_header_reads_back_and_every_flipped_bit_in_it_is_seen() {
        let bytes = header("{\"survey\": 1}");
        let read = |bytes: &[u8]| read_header(&mut &bytes[..], bytes.len() as u64).unwrap();
        let identity = "{\"survey\": 1}".to_owned();
        assert_eq!(read(&bytes), Header::Whole { identity, bytes: bytes.len() as u64 });
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(!matches!(read(&flipped), Header::Whole { .. }), "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert!(!matches!(read(&bytes[..length]), Header::Whole { .. }), "{length} bytes");
        }
    }

    #[test]
    fn a_record_in_another_place_is_none() {
        let bytes = record(5, b"stones", 100);
        let scan = |position| scan_record(&mut &bytes[..], position, position + bytes.len() as u64).unwrap();
        assert_eq!(scan(100), Some(Entry { key: 5, position: 100, payload_bytes: 6 }));
        assert_eq!(scan(101), None);
    }

    #[test]
    fn a_disk_block_of_zeros_is_no_record() {
        assert_eq!(scan_record(&mut &[0u8; 4096][..], 0, 4096).unwrap(), None);
        assert_eq!(scan_record(&mut &[0u8; 4096][..], 60, 4156).unwrap(), None);
    }
}
