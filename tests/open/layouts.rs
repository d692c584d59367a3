//! The same surface under many layouts.

use crate::ply_bytes::{
    Element, PLACES, TRIANGLES, axis, corner_lists, faces, file, file_in, file_with, header, vertices,
};
use crate::{assert_contains, open_bytes};
use gravelometer::open::{OpenError, Reach, Scalar, Warning};
use gravelometer::settings::InputSettings;
use std::os::unix::fs::FileExt;

#[track_caller]
fn assert_is_the_patch(reach: &Reach) {
    assert_eq!((reach.vertices(), reach.triangles(), reach.faces()), (5, 4, 4));
    assert_eq!(reach.input_bounds(), ([1.0, 2.0, -0.25], [2.0, 3.0, 1.0]));
    assert_eq!(reach.frame().origin_input, [1.0, 2.0, -1.0]);
    for (v, place) in PLACES.iter().enumerate() {
        let local = reach.position(v as u64);
        assert_eq!([local.x + 1.0, local.y + 2.0, local.z - 1.0], *place, "vertex {v}");
    }
    for (t, corners) in TRIANGLES.iter().enumerate() {
        assert_eq!(reach.triangle(t as u64), *corners, "triangle {t}");
        assert_eq!(reach.face_of(t as u64), t as u64);
    }
}

#[track_caller]
fn opened(bytes: &[u8]) -> Reach {
    let (reach, warnings) = open_bytes(bytes).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(warnings, []);
    reach
}

#[test]
fn every_coordinate_type_gives_the_same_surface() {
    for kind in ["float", "float32", "double", "float64"] {
        let vertices = ["x", "y", "z"]
            .iter()
            .enumerate()
            .fold(Element::new("vertex"), |e, (i, name)| e.numbers(&format!("{kind} {name}"), axis(i)));
        assert_is_the_patch(&opened(&file(&[&vertices, &faces()])));
    }
    for kind in
        ["char", "int8", "uchar", "uint8", "short", "int16", "ushort", "uint16", "int", "int32", "uint", "uint32"]
    {
        let quarters = |i| axis(i).map(|v| (v + 1.0) * 4.0);
        let vertices = ["x", "y", "z"]
            .iter()
            .enumerate()
            .fold(Element::new("vertex"), |e, (i, name)| e.numbers(&format!("{kind} {name}"), quarters(i)));
        let reach = opened(&file(&[&vertices, &faces()]));
        assert_eq!(reach.input_bounds(), ([8.0, 12.0, 3.0], [12.0, 16.0, 8.0]), "{kind}");
    }
}

#[test]
fn every_count_and_index_type_gives_the_same_surface() {
    let kinds =
        ["char", "uchar", "short", "ushort", "int", "uint", "int8", "uint8", "int16", "uint16", "int32", "uint32"];
    for count in kinds {
        for index in kinds {
            for name in ["vertex_indices", "vertex_index"] {
                let faces = Element::new("face").lists(&format!("list {count} {index} {name}"), corner_lists());
                assert_is_the_patch(&opened(&file(&[&vertices(), &faces])));
            }
        }
    }
}

#[test]
fn order_and_unknown_properties_do_not_matter() {
    let vertices = Element::new("vertex")
        .numbers("float quality.of-this", axis(0))
        .numbers("double z", axis(2))
        .numbers("uchar flag", axis(0))
        .numbers("float x", axis(0))
        .numbers("short same", axis(1))
        .numbers("short same", axis(1))
        .numbers("double y", axis(1));
    let faces = Element::new("face")
        .numbers("float before", axis(0).take(4))
        .lists("list uchar int vertex_indices", corner_lists())
        .numbers("ushort after", axis(0).take(4));
    assert_is_the_patch(&opened(&file(&[&vertices, &faces])));
    assert_is_the_patch(&opened(&file(&[&faces, &vertices])));
}

#[test]
fn unknown_elements_are_skipped_wherever_they_stand() {
    let camera = Element::new("camera").numbers("float view_px", [1.0]).numbers("int k", [7.0]);
    let edges = Element::new("edge")
        .lists("list uchar int ends", [vec![0.0, 1.0], vec![], vec![1.0]])
        .numbers("double w", axis(0).take(3));
    let empty = Element::new("nothing");
    for order in [[&camera, &edges, &empty], [&edges, &camera, &empty], [&empty, &edges, &camera]] {
        for at in 0..=3 {
            let (vertices, faces) = (vertices(), faces());
            let mut elements: Vec<&Element> = order.to_vec();
            elements.insert(at, &vertices);
            elements.insert(at + 1, &faces);
            assert_is_the_patch(&opened(&file(&elements)));
        }
    }
}

#[test]
fn face_lists_before_and_behind_the_corners_are_skipped() {
    let texture = |n: usize| (0..4).map(move |i| vec![0.5; (i * n) % 7]);
    let faces = Element::new("face")
        .lists("list uchar float texcoord", texture(3))
        .lists("list uchar uint vertex_index", corner_lists())
        .numbers("uchar red", axis(0).take(4))
        .lists("list int double other", texture(2));
    let reach = opened(&file(&[&faces, &vertices()]));
    assert_is_the_patch(&reach);
    assert_eq!(reach.files()[0].face_corners(2).collect::<Vec<_>>(), [2, 3, 4]);
}

#[test]
fn vertex_lists_behind_the_coordinates_are_stepped_over() {
    let views = (0..5).map(|i| vec![3.0; i]);
    let with_views = vertices().numbers("uchar red", [255.0; 5]).lists("list uchar uint view_indices", views);
    let reach = opened(&file(&[&with_views, &faces()]));
    assert_is_the_patch(&reach);
    let file_ = &reach.files()[0];
    assert_eq!(file_.vertex_record(3).len(), 25);
    assert_eq!(file_.vertex_record(3)[..8], 1.0f64.to_le_bytes());
    assert_eq!(file_.vertex_properties().len(), 4);
    let behind = Element::new("vertex")
        .lists("list uchar uint view_indices", (0..5).map(|i| vec![3.0; i]))
        .numbers("double x", axis(0))
        .numbers("double y", axis(1))
        .numbers("double z", axis(2));
    let behind = behind.numbers("ushort view", axis(0));
    let reach = opened(&file(&[&behind, &faces()]));
    assert_is_the_patch(&reach);
    let names: Vec<_> = reach.files()[0].vertex_properties().iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["x", "y", "z", "view"]);
}

#[test]
fn every_encoding_holds_the_same_patch() {
    let edge =
        Element::new("edge").lists("list uchar int ends", [vec![1.0], vec![1.0, 2.0]]).numbers("short n", [7.0; 2]);
    let colored =
        vertices().numbers("uchar red", [9.0; 5]).numbers("uchar green", [8.0; 5]).numbers("uchar blue", [7.0; 5]);
    let same = |elements: &[&Element]| {
        let plain = opened(&file(elements));
        assert_is_the_patch(&plain);
        for encoding in ["ascii", "binary_big_endian"] {
            let reach = opened(&file_in(encoding, elements));
            assert_is_the_patch(&reach);
            assert_eq!(reach.files()[0].format(), format!("PLY {encoding}"));
            for v in 0..5 {
                assert_eq!(reach.files()[0].vertex_record(v), plain.files()[0].vertex_record(v), "{encoding}");
                assert_eq!(reach.color(v), plain.color(v), "{encoding}");
            }
        }
    };
    same(&[&vertices(), &faces()]);
    same(&[&edge, &faces(), &colored, &edge_again()]);
}

#[test]
fn a_file_without_faces_is_a_cloud_in_every_encoding() {
    let no_faces = Element::new("face").lists("list uchar int vertex_indices", []);
    let no_strips = Element::new("tristrips").lists("list int int vertex_indices", []);
    for encoding in ["binary_little_endian", "ascii", "binary_big_endian"] {
        for elements in [vec![&vertices()], vec![&vertices(), &no_faces], vec![&no_strips, &vertices(), &edge_again()]]
        {
            let reach = opened(&file_in(encoding, &elements));
            assert!(reach.is_cloud());
            assert_eq!((reach.vertices(), reach.faces(), reach.triangles()), (5, 0, 0));
            assert_eq!(reach.input_bounds(), ([1.0, 2.0, -0.25], [2.0, 3.0, 1.0]), "{encoding}");
        }
    }
}

fn edge_again() -> Element {
    Element::new("light").numbers("double x", [0.5])
}

/// The patch as strips: round the middle and back again, with a triangle that only leads on, then a strip of one.
#[test]
fn strips_of_triangles_are_cut_with_their_winding() {
    let strip = vec![4.0, 0.0, 1.0, 1.0, 4.0, 2.0, -1.0, 4.0, 2.0, 3.0, -1.0, -1.0, 3.0, 0.0, 4.0];
    let strips = Element::new("tristrips").lists("list int int vertex_indices", [strip]);
    for bytes in [file(&[&vertices(), &strips]), file_in("ascii", &[&vertices(), &strips])] {
        let reach = opened(&bytes);
        let turned = |t: [u64; 3]| {
            let lowest = (0..3).min_by_key(|&i| t[i]).unwrap_or(0);
            [t[lowest], t[(lowest + 1) % 3], t[(lowest + 2) % 3]]
        };
        let mut found: Vec<_> = (0..reach.triangles()).map(|t| turned(reach.triangle(t))).collect();
        let mut expected = TRIANGLES.map(turned);
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected);
    }
}

#[test]
fn line_ends_of_every_system_give_the_same_surface() {
    for newline in ["\n", "\r\n", "\r"] {
        assert_is_the_patch(&opened(&file_with(&[&vertices(), &faces()], newline)));
    }
    // A header of line feeds that ends in CRLF, as some editors leave it.
    let mixed = file(&[&vertices(), &faces()]);
    let at = mixed.windows(11).position(|w| w == b"end_header\n").expect("header") + 10;
    let mixed = [&mixed[..at], b"\r", &mixed[at..]].concat();
    assert_is_the_patch(&opened(&mixed));
}

#[test]
fn a_payload_that_starts_with_a_line_feed_is_not_cut() {
    let vertices = Element::new("vertex")
        .numbers("uchar x", [10.0, 13.0, 10.0])
        .numbers("uchar y", [10.0, 10.0, 14.0])
        .numbers("uchar z", [10.0; 3]);
    let faces = Element::new("face").lists("list uchar int vertex_indices", [vec![0.0, 1.0, 2.0]]);
    for newline in ["\n", "\r\n", "\r"] {
        let reach = opened(&file_with(&[&vertices, &faces], newline));
        assert_eq!(reach.input_bounds(), ([10.0; 3], [13.0, 14.0, 10.0]), "{newline:?}");
    }
}

#[test]
fn polygons_are_cut_into_fans_in_file_order() {
    let lists = [vec![0.0, 1.0, 2.0], vec![3.0, 2.0, 1.0, 0.0, 4.0], vec![4.0, 0.0, 1.0], vec![0.0, 1.0, 2.0, 3.0]];
    let faces = Element::new("face").lists("list uchar int vertex_indices", lists);
    let reach = opened(&file(&[&vertices(), &faces]));
    let triangles: Vec<_> = (0..reach.triangles()).map(|t| reach.triangle(t)).collect();
    assert_eq!(triangles, [[0, 1, 2], [3, 2, 1], [3, 1, 0], [3, 0, 4], [4, 0, 1], [0, 1, 2], [0, 2, 3]]);
    let faces: Vec<_> = (0..reach.triangles()).map(|t| reach.face_of(t)).collect();
    assert_eq!(faces, [0, 1, 1, 1, 2, 3, 3]);
    assert_eq!(reach.files()[0].face_corners(1).collect::<Vec<_>>(), [3, 2, 1, 0, 4]);
    assert_eq!(reach.faces(), 4);
}

#[test]
fn repeated_corners_duplicate_and_flat_faces_are_kept() {
    let lists =
        [vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 2.0], vec![2.0, 1.0, 0.0], vec![1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0]];
    let faces = Element::new("face").lists("list uchar int vertex_indices", lists);
    assert_eq!(opened(&file(&[&vertices(), &faces])).triangles(), 5);
}

#[test]
fn colours_of_every_type_and_name_are_read_as_shares() {
    for names in [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]] {
        for (kind, full) in [("uchar", 255.0), ("ushort", 65535.0), ("float", 1.0), ("double", 1.0)] {
            let shares = [[0.0, 1.0, 0.0, 1.0, 1.0], [1.0; 5], [0.0; 5]];
            let colored =
                (0..3).fold(vertices(), |e, i| e.numbers(&format!("{kind} {}", names[i]), shares[i].map(|v| v * full)));
            let reach = opened(&file(&[&colored, &faces()]));
            assert!(reach.has_colors());
            assert_eq!(reach.color(1), Some([1.0, 1.0, 0.0]), "{kind} {names:?}");
            assert_eq!(reach.color(2), Some([0.0, 1.0, 0.0]));
        }
    }
    assert_eq!(opened(&file(&[&vertices(), &faces()])).color(0), None);
}

#[test]
fn colours_that_cannot_be_meant_are_ignored_with_a_warning() {
    let add = |kind: &str, value: f64| {
        ["red", "green", "blue"].iter().fold(vertices(), |e, name| e.numbers(&format!("{kind} {name}"), [value; 5]))
    };
    for (kind, value) in [("float", 200.0), ("float", f64::NAN), ("int", 256.0), ("short", -1.0), ("char", 1.0)] {
        let (reach, warnings) = open_bytes(&file(&[&add(kind, value), &faces()])).expect("readable");
        assert!(!reach.has_colors());
        assert!(matches!(warnings.as_slice(), [Warning::ColoursIgnored { .. }]), "{warnings:?}");
    }
}

#[test]
fn vertex_records_keep_their_types_and_bytes() {
    let colored = vertices().numbers("uchar red", [1.0, 2.0, 3.0, 4.0, 5.0]).numbers("short tag", [-1.0; 5]);
    let reach = opened(&file(&[&colored, &faces()]));
    let file = &reach.files()[0];
    let facts: Vec<_> = file.vertex_properties().iter().map(|p| (p.name.as_str(), p.scalar, p.offset)).collect();
    let double = Scalar::F64;
    assert_eq!(
        facts,
        [("x", double, 0), ("y", double, 8), ("z", double, 16), ("red", Scalar::U8, 24), ("tag", Scalar::I16, 25)]
    );
    assert_eq!(file.vertex_record(4).len(), 27);
    assert_eq!(file.vertex_record(4)[24..], [5, 0xff, 0xff]);
    assert_eq!(file.comments(), ["a test"]);
}

#[test]
fn bytes_behind_the_last_element_are_warned_of() {
    let mut bytes = file(&[&vertices(), &faces()]);
    bytes.push(b'\n');
    assert_is_the_patch(&opened(&bytes));
    bytes.extend([0; 40]);
    let (_, warnings) = open_bytes(&bytes).expect("readable");
    assert!(matches!(warnings.as_slice(), [Warning::TrailingBytes { bytes: 41, .. }]), "{warnings:?}");
}

#[test]
fn a_comment_that_is_not_utf8_does_not_matter() {
    let bytes = file(&[&vertices(), &faces()]);
    let at = bytes.windows(6).position(|w| w == b"a test").expect("comment");
    let mut bytes = bytes;
    bytes[at] = 0xe9;
    assert_is_the_patch(&opened(&bytes));
}

#[test]
fn millimetres_taken_for_metres_are_warned_of() {
    let large = |i| axis(i).map(|v| v * 100.0);
    let vertices = Element::new("vertex")
        .numbers("double x", large(0))
        .numbers("double y", large(1))
        .numbers("double z", large(2));
    let (_, warnings) = open_bytes(&file(&[&vertices, &faces()])).expect("readable");
    let [warning @ Warning::LooksLikeMillimetres { .. }] = warnings.as_slice() else { panic!("{warnings:?}") };
    assert_contains(&warning.to_string(), &["reach.ply", "--unit mm"]);
}

#[test]
fn floats_too_coarse_for_the_surface_are_refused_and_doubles_are_not() {
    let far = |i: usize| axis(i).map(move |v| if i == 1 { v * 0.01 + 5_250_000.0 } else { v * 0.01 });
    let build = |kind: &str| {
        ["x", "y", "z"]
            .iter()
            .enumerate()
            .fold(Element::new("vertex"), |e, (i, n)| e.numbers(&format!("{kind} {n}"), far(i)))
    };
    let error = open_bytes(&file(&[&build("float"), &faces()])).expect_err("destroyed");
    assert!(matches!(error, OpenError::FloatStep { .. }), "{error}");
    assert_contains(&error.to_string(), &["reach.ply", "5.000e-1 m", "5250000", "--offset"]);
    opened(&file(&[&build("double"), &faces()]));
}

#[test]
fn records_beyond_four_gibibytes_are_reached() {
    // The file is sparse: five thousand million bytes of an unknown element, of which none is written or read.
    const PADDING: u64 = 5_000_000_000;
    let mut padding = Element::new("padding").numbers("uchar nothing", []);
    padding.declared = Some(PADDING);
    let (vertices, faces) = (vertices(), faces());
    let head = header(&[&padding, &vertices, &faces], "\n");
    let payload = file(&[&vertices, &faces])[header(&[&vertices, &faces], "\n").len()..].to_vec();
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("reach.ply");
    let out = std::fs::File::create(&path).expect("create");
    out.write_all_at(head.as_bytes(), 0).expect("write");
    out.write_all_at(&payload, head.len() as u64 + PADDING).expect("write");
    let (reach, _) = Reach::open(&[path], &InputSettings::default(), &|_, _| {}).unwrap_or_else(|e| panic!("{e}"));
    assert_is_the_patch(&reach);
}
