//! Each malformed file gives its precise error.

use crate::ply_bytes::{Element, axis, corner_lists, faces, file, file_in, header, vertices};
use crate::{assert_contains, open_bytes, refusal};
use gravelometer::open::{OpenError, Reach};
use gravelometer::settings::InputSettings;
use std::path::{Path, PathBuf};

fn refuse_path(path: &Path) -> String {
    Reach::open(&[path.to_owned()], &InputSettings::default(), &|_, _| {}).expect_err("must be refused").to_string()
}

#[test]
fn truncated_vertices_name_the_byte_and_the_vertex() {
    let head = header(&[&vertices(), &faces()], "\n").len();
    let whole = file(&[&vertices(), &faces()]);
    let end = head + 2 * 24 + 5;
    assert_contains(&refusal(&whole[..end]), &[&format!("ends at byte {end}"), "vertex 2 of 5"]);
    assert_contains(&refusal(&whole[..head]), &[&format!("ends at byte {head}"), "vertex 0 of 5"]);
}

#[test]
fn truncated_faces_name_the_byte_and_the_face() {
    let whole = file(&[&vertices(), &faces()]);
    let end = whole.len() - 13 - 1;
    assert_contains(&refusal(&whole[..end]), &[&format!("ends at byte {end}"), "face 2 of 4"]);
    let end = whole.len() - 13;
    assert_contains(&refusal(&whole[..end]), &[&format!("ends at byte {end}"), "face 3 of 4"]);
}

#[test]
fn truncated_unknown_elements_name_the_record() {
    let extra = Element::new("edge").lists("list uchar int ends", [vec![1.0], vec![1.0, 2.0]]);
    let whole = file(&[&vertices(), &faces(), &extra]);
    assert_contains(&refusal(&whole[..whole.len() - 3]), &["edge 1 of 2"]);
}

fn with_face(list: Vec<f64>) -> Vec<u8> {
    let mut lists: Vec<Vec<f64>> = corner_lists().collect();
    lists[2] = list;
    file(&[&vertices(), &Element::new("face").lists("list char int vertex_indices", lists)])
}

#[test]
fn an_index_out_of_range_names_face_index_and_vertices() {
    assert_contains(&refusal(&with_face(vec![0.0, 5.0, 1.0])), &["face 2 refers to vertex 5", "5 vertices"]);
    assert_contains(&refusal(&with_face(vec![0.0, 1.0, 2.0, 99.0])), &["face 2 refers to vertex 99", "5 vertices"]);
}

#[test]
fn a_negative_index_names_face_and_index() {
    assert_contains(&refusal(&with_face(vec![0.0, 1.0, -1.0])), &["face 2 refers to vertex -1"]);
    assert_contains(&refusal(&with_face(vec![-7.0, 1.0, 1.0, 1.0])), &["face 2 refers to vertex -7"]);
}

#[test]
fn the_first_bad_face_is_named_whatever_follows() {
    let mut lists: Vec<Vec<f64>> = (0..200_000).map(|_| vec![0.0, 1.0, 2.0]).collect();
    lists[70_000] = vec![0.0, 1.0, 6.0];
    lists[190_000] = vec![0.0, 1.0, 7.0];
    lists[70_001] = vec![0.0, 1.0];
    let bytes = file(&[&vertices(), &Element::new("face").lists("list uchar int vertex_indices", lists)]);
    assert_contains(&refusal(&bytes), &["face 70000 refers to vertex 6"]);
}

#[test]
fn a_face_of_fewer_than_three_corners_is_named() {
    for (corners, list) in [(2, vec![0.0, 1.0]), (1, vec![0.0]), (0, vec![])] {
        assert_contains(&refusal(&with_face(list)), &[&format!("face 2 has {corners} corners")]);
    }
}

#[test]
fn a_negative_list_length_is_named() {
    let mut bytes = file(&[&vertices(), &Element::new("face").lists("list char int vertex_indices", corner_lists())]);
    let at = bytes.len() - 2 * 13;
    bytes[at] = 0xfd;
    assert_contains(&refusal(&bytes), &["face 2: list `vertex_indices` has -3 entries", &format!("byte {at}")]);
}

#[test]
fn coordinates_that_are_no_numbers_name_vertex_and_property() {
    for (value, shown) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (f64::NEG_INFINITY, "-inf")] {
        for kind in ["float", "double"] {
            let y: Vec<f64> = axis(1).enumerate().map(|(i, v)| if i >= 3 { value } else { v }).collect();
            let vertices = Element::new("vertex")
                .numbers(&format!("{kind} x"), axis(0))
                .numbers(&format!("{kind} y"), y)
                .numbers(&format!("{kind} z"), axis(2));
            assert_contains(
                &refusal(&file(&[&vertices, &faces()])),
                &[&format!("vertex 3: property `y` is {shown}\n")],
            );
        }
    }
}

#[test]
fn no_vertices_are_refused() {
    let none = Element::new("vertex").numbers("float x", []).numbers("float y", []).numbers("float z", []);
    assert_contains(&refusal(&file(&[&none, &faces()])), &["0 vertices"]);
    assert_contains(&refusal(&file(&[&faces()])), &["no element `vertex`", "face"]);
}

#[test]
fn missing_and_unusable_properties_are_named() {
    let flat = Element::new("vertex").numbers("float x", axis(0)).numbers("float y", axis(1));
    assert_contains(&refusal(&file(&[&flat, &faces()])), &["`vertex` has no property `z`", "x, y"]);
    let nameless = Element::new("face").lists("list uchar int corners", corner_lists());
    assert_contains(
        &refusal(&file(&[&vertices(), &nameless])),
        &["`face` has no property `vertex_indices`", "corners"],
    );
    let floats = Element::new("face").lists("list uchar float vertex_indices", corner_lists());
    assert_contains(&refusal(&file(&[&vertices(), &floats])), &["`vertex_indices`", "`list uchar float`", "integer"]);
    let counted = Element::new("face").lists("list float int vertex_indices", corner_lists());
    assert_contains(&refusal(&file(&[&vertices(), &counted])), &["`list float int`", "length is an integer type"]);
    let twice = file(&[&vertices(), &faces(), &faces()]);
    assert_contains(&refusal(&twice), &["element `face` twice"]);
}

#[test]
fn a_path_that_is_no_file_is_refused() {
    let directory = tempfile::tempdir().expect("temporary directory");
    assert_contains(&refuse_path(directory.path()), &["is a directory", "help: "]);
    let missing = directory.path().join("gone.ply");
    assert_contains(&refuse_path(&missing), &["gone.ply: there is no such file", "help: "]);
    assert_contains(&refusal(b""), &["is empty (0 bytes)"]);
    assert_contains(&refuse_path(Path::new("/dev/null")), &["is not a regular file"]);
    let none: [PathBuf; 0] = [];
    let error = Reach::open(&none, &InputSettings::default(), &|_, _| {}).expect_err("no files");
    assert!(matches!(error, OpenError::NoFiles));
}

#[test]
fn something_other_than_ply_is_refused() {
    assert_contains(&refusal(b"LASF\0\0\x01\0"), &["LAS header is damaged", "ends at byte 8"]);
    assert_contains(&refusal(b"solid cube\n"), &["is not a PLY file", "`solid cube"]);
    assert_contains(&refusal(b"ply2\nformat ascii 1.0\n"), &["is not a PLY file"]);
}

#[test]
fn a_header_without_an_end_is_refused() {
    let whole = file(&[&vertices(), &faces()]);
    let at = whole.windows(10).position(|w| w == b"end_header").expect("header");
    assert_contains(&refusal(&whole[..at]), &["no line `end_header`", &format!("first {at} bytes")]);
    let endless = [b"ply\n".to_vec(), vec![b'c'; 3 << 20]].concat();
    assert_contains(&refusal(&endless), &["no line `end_header`", "first 1048576 bytes"]);
}

#[test]
fn a_header_line_outside_the_grammar_is_quoted_with_its_number() {
    let text = header(&[&vertices(), &faces()], "\n");
    for (line, from, to) in [
        (5, "property double x", "property quadruple x"),
        (5, "property double x", "property x"),
        (4, "element vertex 5", "element vertex -5"),
        (4, "element vertex 5", "element vertex 99999999999999999999"),
        (2, "format binary_little_endian 1.0", "format binary_middle_endian 1.0"),
    ] {
        let message = refusal(text.replacen(from, to, 1).as_bytes());
        assert_contains(&message, &[&format!("header line {line} "), &format!("`{to}`")]);
    }
    assert_contains(&refusal(b"ply\nend_header\n"), &["header line", "format"]);
}

#[test]
fn counts_beyond_any_file_are_refused_without_allocating() {
    for count in [u64::from(u32::MAX), 1_000_000_000_000_000_000, u64::MAX] {
        let mut many = vertices();
        many.declared = Some(count);
        assert_contains(&refusal(&file(&[&many, &faces()])), &[&format!("of {count}"), "vertex 7 "]);
        let mut many = faces();
        many.declared = Some(count);
        assert_contains(&refusal(&file(&[&vertices(), &many])), &[&format!("face 4 of {count}")]);
        let mut many = Element::new("edge").lists("list uint int ends", [vec![1.0]]);
        many.declared = Some(count);
        assert_contains(&refusal(&file(&[&many, &vertices(), &faces()])), &[&format!("of {count}")]);
        let mut nothing = Element::new("nothing");
        nothing.declared = Some(count);
        open_bytes(&file(&[&nothing, &vertices(), &faces()])).expect("records without properties take no bytes");
    }
}

#[test]
fn a_list_length_beyond_the_file_is_a_truncation() {
    let lists: Vec<Vec<f64>> = corner_lists().collect();
    let declarations = [("uint", 4), ("uint64", 8)];
    for (kind, size) in declarations {
        let faces = Element::new("face").lists(&format!("list {kind} int vertex_indices"), lists.clone());
        for (encoding, turned) in [("binary_little_endian", false), ("binary_big_endian", true)] {
            let mut bytes = file_in(encoding, &[&vertices(), &faces]);
            let at = bytes.len() - size - 12;
            let mut length = 65_536u64.to_le_bytes()[..size].to_vec();
            if turned {
                length.reverse();
            }
            bytes[at..at + size].copy_from_slice(&length);
            assert_contains(&refusal(&bytes), &["face 3 of 4", "ends at byte"]);
        }
    }
    // Of an element that is not needed, too, where places would overflow.
    let edges = Element::new("edge")
        .lists("list uint64 double ends", [vec![], vec![]])
        .lists("list uint64 int more", [vec![], vec![]]);
    for encoding in ["binary_little_endian", "binary_big_endian"] {
        for value in [1u64 << 62, (1 << 63) - 1, (1 << 61) + 3] {
            let mut bytes = file_in(encoding, &[&vertices(), &faces(), &edges]);
            let at = bytes.len() - 16;
            bytes[at..at + 8].copy_from_slice(&if encoding == "binary_big_endian" {
                value.to_be_bytes()
            } else {
                value.to_le_bytes()
            });
            assert_contains(&refusal(&bytes), &["edge 1 of 2", "ends at byte"]);
        }
    }
}

#[test]
fn a_face_of_more_corners_than_any_polygon_is_refused_in_every_encoding() {
    let round = |corners: usize| {
        Element::new("face").lists(
            "list uint int vertex_indices",
            [vec![0.0, 1.0, 2.0], (0..corners).map(|i| (i % 5) as f64).collect()],
        )
    };
    for encoding in ["binary_little_endian", "binary_big_endian", "ascii"] {
        let (reach, _) =
            open_bytes(&file_in(encoding, &[&vertices(), &round(65_536)])).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(reach.triangles(), 65_535);
        let message = refusal(&file_in(encoding, &[&vertices(), &round(65_537)]));
        assert_contains(&message, &["face 1 has 65537 corners (byte ", "65536", "triangulate"]);
    }
    // Whatever the file could hold.
    let mut bytes = file(&[&vertices(), &round(3)]);
    let at = bytes.len() - 16;
    bytes[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_contains(&refusal(&bytes), &[&format!("face 1 has 4294967295 corners (byte {at})")]);
}

#[test]
fn other_encodings_that_are_cut_off_name_the_record() {
    for encoding in ["ascii", "binary_big_endian"] {
        let whole = file_in(encoding, &[&vertices(), &faces()]);
        let header = whole.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
        for cut in header..whole.len() - 2 {
            let message = refusal(&whole[..cut]);
            // Text that is cut within a number may be another number.
            let wrong = ["ends at byte", "is no number", "refers to vertex", "corners"];
            assert!(wrong.iter().any(|w| message.contains(w)) || encoding == "ascii", "{message}");
        }
        assert_contains(&refusal(&whole[..header + 5]), &["ends at byte", "vertex 0 of 5"]);
    }
}

#[test]
fn a_word_that_is_no_number_is_named_with_its_line() {
    let text = String::from_utf8(file_in("ascii", &[&vertices(), &faces()])).expect("text");
    let lines = text.lines().count() as u64;
    let last = text.trim_end().rfind(' ').expect("a word") + 1;
    let broken = format!("{}four\n", &text[..last]);
    let expected = [&format!("line {lines}: `four`"), "`vertex_indices` of face 3"];
    assert_contains(&refusal(broken.as_bytes()), &expected);
    let beyond = format!("{}9\n", &text[..last]);
    assert_contains(&refusal(beyond.as_bytes()), &["face 3 refers to vertex 9"]);
}

#[test]
fn a_survey_wider_than_any_reach_is_refused() {
    for far in [1e6, 1e30, 1.7e308] {
        let x: Vec<f64> = axis(0).enumerate().map(|(i, v)| if i == 4 { far } else { v - far }).collect();
        let vertices =
            Element::new("vertex").numbers("double x", x).numbers("double y", axis(1)).numbers("double z", axis(2));
        assert_contains(&refusal(&file(&[&vertices, &faces()])), &["along x", "--unit mm"]);
    }
}
