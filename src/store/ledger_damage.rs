//! A ledger that was torn or changed, byte by byte.

use super::ledger::tests::{IDENTITY, RECORDS, contents, fill, first, place};
use super::ledger_format::header;
use super::{Ledger, StoreError};
use std::fs;

#[test]
fn a_tail_torn_at_any_byte_costs_the_last_record_only_and_can_be_written_again() {
    let (_folder, path) = place();
    let last = fill(&path)[3] as usize;
    let whole = fs::read(&path).unwrap();
    for length in last..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        assert_eq!(contents(&path), (first(3), (length - last) as u64), "{length} bytes");
        assert_eq!(fs::metadata(&path).unwrap().len(), last as u64);
        let (mut ledger, _) = Ledger::open(&path, IDENTITY).unwrap();
        ledger.append(RECORDS[3].0, RECORDS[3].1).unwrap();
        assert_eq!(fs::read(&path).unwrap(), whole);
    }
}

#[test]
fn a_flipped_byte_anywhere_refuses_the_header_or_ends_the_valid_part_before_its_record() {
    let (_folder, path) = place();
    let positions = fill(&path);
    let whole = fs::read(&path).unwrap();
    for at in 0..whole.len() {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x10;
        fs::write(&path, &flipped).unwrap();
        if at < positions[0] as usize {
            assert!(Ledger::open(&path, IDENTITY).is_err(), "byte {at}");
            assert_eq!(fs::read(&path).unwrap(), flipped, "byte {at}: a file that is refused is left alone");
        } else {
            let record = positions.iter().rposition(|&p| p as usize <= at).unwrap();
            let cut_bytes = whole.len() as u64 - positions[record];
            assert_eq!(contents(&path), (first(record), cut_bytes), "byte {at}");
        }
    }
}

#[test]
fn a_tail_of_zeros_or_of_a_lying_length_is_cut_off() {
    let (_folder, path) = place();
    fill(&path);
    let whole = fs::read(&path).unwrap();
    let lie = |length: u64| [5u64.to_le_bytes(), length.to_le_bytes(), [0; 8], [0; 8]].concat();
    for tail in [vec![0; 5000], lie(u64::MAX), lie(u64::MAX - 23), lie(9), lie(8), lie(1 << 40)] {
        fs::write(&path, [whole.clone(), tail.clone()].concat()).unwrap();
        assert_eq!(contents(&path), (first(4), tail.len() as u64));
    }
}

#[test]
fn another_identity_is_refused_with_both_texts() {
    let (_folder, path) = place();
    fill(&path);
    match Ledger::open(&path, "{\"input\": \"another bed\"}").unwrap_err() {
        StoreError::OtherIdentity { recorded, wanted, .. } => {
            assert_eq!((recorded.as_str(), wanted.as_str()), (IDENTITY, "{\"input\": \"another bed\"}"));
        }
        other => panic!("{other}"),
    }
    assert_eq!(contents(&path), (first(4), 0));
}

#[test]
fn what_is_no_ledger_of_this_format_is_refused_and_left_alone() {
    let (_folder, path) = place();
    let mut newer = header(IDENTITY);
    newer[8] = 2;
    let mut lying = header(IDENTITY);
    lying[12..16].fill(255);
    for (bytes, says) in [
        (b"ply\nformat binary_little_endian 1.0\n".to_vec(), "is no record file of gravelometer"),
        (Vec::new(), "is no record file of gravelometer"),
        (newer, "is a record file of format 2, but this program reads format 1"),
        (lying, "the header of the record file is damaged"),
    ] {
        fs::write(&path, &bytes).unwrap();
        let error = Ledger::open(&path, IDENTITY).unwrap_err().to_string();
        assert!(error.contains(&format!("tiles.ledger: {says}")) && error.contains("\nhelp: "), "{error}");
        assert_eq!(fs::read(&path).unwrap(), bytes);
    }
    let error = Ledger::open(&path.join("below"), IDENTITY).unwrap_err().to_string();
    assert!(error.contains("below"), "{error}");
}

#[test]
fn a_place_where_no_record_begins_is_an_error() {
    let (_folder, path) = place();
    let positions = fill(&path);
    let (ledger, _) = Ledger::open(&path, IDENTITY).unwrap();
    let end = fs::metadata(&path).unwrap().len();
    for position in (0..end + 30).chain([u64::MAX - 8, u64::MAX]).filter(|p| !positions.contains(p)) {
        let error = ledger.read(position).unwrap_err();
        assert!(matches!(error, StoreError::DamagedRecord { .. }), "{error}");
    }
    // Changed under our hands.
    let mut bytes = fs::read(&path).unwrap();
    bytes[positions[0] as usize + 18] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert!(matches!(ledger.read(positions[0]), Err(StoreError::DamagedRecord { .. })));
    assert_eq!(ledger.read(positions[1]).unwrap().key, u64::MAX);
}
