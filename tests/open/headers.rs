//! Headers as programs write them, and as they should not.

use crate::ply_bytes::{Element, axis, corner_lists, faces, file, file_in, vertices};
use crate::{assert_contains, open_bytes, refusal};
use gravelometer::open::{OpenError, Reach, Scalar, Warning};
use gravelometer::settings::InputSettings;
use std::io::Write;

const ENCODINGS: [&str; 3] = ["binary_little_endian", "binary_big_endian", "ascii"];

#[track_caller]
fn opened(bytes: &[u8]) -> Reach {
    let (reach, warnings) = open_bytes(bytes).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(warnings, []);
    reach
}

/// Puts `new` in place of `old`, which is there once, in the header.
#[track_caller]
fn with(bytes: &[u8], old: &str, new: &str) -> Vec<u8> {
    let at = bytes.windows(old.len()).position(|w| w == old.as_bytes()).unwrap_or_else(|| panic!("no {old}"));
    [&bytes[..at], new.as_bytes(), &bytes[at + old.len()..]].concat()
}

/// x, y, z of this type, named as given.
fn places(kind: &str, element: Element) -> Element {
    (0..3).fold(element, |e, i| e.numbers(&format!("{kind} {}", ["x", "y", "z"][i]), axis(i)))
}

fn add(kind: &str, names: &[&str], element: Element) -> Element {
    names.iter().fold(element, |e, name| e.numbers(&format!("{kind} {name}"), [1.0; 5]))
}

#[test]
fn the_layouts_of_many_programs_hold_the_same_patch() {
    let vertex = || Element::new("vertex");
    let normals = ["nx", "ny", "nz"];
    let views = || (0..5).map(|i| vec![2.0; i]);
    let corners = |kind: &str, name: &str| Element::new("face").lists(&format!("list {kind} {name}"), corner_lists());
    let open3d = add("double", &normals, places("double", vertex()));
    let meshlab = add("uchar", &["red", "green", "blue", "alpha"], add("float", &normals, places("float", vertex())));
    let meshlab = add("float", &["quality", "radius", "texture_u", "texture_v"], meshlab);
    let per_face = ["red", "green", "blue", "alpha"]
        .iter()
        .fold(corners("uchar int", "vertex_indices"), |e, name| e.numbers(&format!("uchar {name}"), [3.0; 4]));
    let compare =
        add("float", &["scalar_CANUPO.class", "scalar_C2C_absolute_distances[<0.5]"], places("float", vertex()));
    let openmvs = places("float32", vertex())
        .lists("list uint8 uint32 view_indices", views())
        .lists("list uint8 float32 view_weights", views());
    let openmvs_before = places("float32", vertex().lists("list uint8 uint32 view_indices", views()));
    let pdal = add("uint16", &["red", "green", "blue"], places("float64", vertex()));
    let pdal = add("float64", &["gpstime"], add("uint8", &["classification"], pdal));
    let metashape = add("uchar", &["red", "green", "blue"], add("float", &normals, places("float", vertex())));
    let poisson = add("float", &["value"], places("float", vertex()));
    let opensfm = add(
        "uchar",
        &["diffuse_red", "diffuse_green", "diffuse_blue"],
        add("float", &normals, places("float", vertex())),
    );
    let assimp = add("float", &["s", "t"], add("float", &normals, places("float", vertex())));
    let multi = Element::new("multi_texture_vertex").numbers("uchar tx", [0.0; 2]).numbers("float u", [0.5; 2]);
    let textured =
        corners("uchar uint", "vertex_indices").lists("list uchar float texcoord", (0..4).map(|_| vec![0.5; 6]));
    let material = Element::new("material").numbers("int ambient_red", [4.0]).numbers("float specular_coeff", [0.5]);
    let none = Element::new("edge").numbers("int vertex1", []);
    let layouts: [(&str, Vec<Element>); 11] = [
        ("Open3D", vec![open3d, faces()]),
        ("MeshLab", vec![meshlab, per_face]),
        ("CloudCompare", vec![compare, corners("uchar int", "vertex_indices")]),
        ("OpenMVS", vec![openmvs, corners("uint8 uint32", "vertex_indices")]),
        ("lists first", vec![openmvs_before, corners("uint8 uint32", "vertex_indices")]),
        ("PDAL", vec![pdal, corners("uint8 uint32", "vertex_indices")]),
        ("Metashape", vec![metashape, corners("uchar int", "vertex_indices").numbers("uchar texnumber", [0.0; 4])]),
        ("PoissonRecon", vec![poisson, corners("int int", "vertex_indices")]),
        ("OpenSfM", vec![opensfm, corners("uchar int", "vertex_index"), none]),
        ("Assimp", vec![material, assimp, corners("uchar int", "vertex_index")]),
        ("multi texture", vec![places("float", vertex()), multi, textured]),
    ];
    let plain = opened(&file(&[&vertices(), &faces()]));
    for (program, elements) in layouts {
        let elements: Vec<&Element> = elements.iter().collect();
        for encoding in ENCODINGS {
            let reach = opened(&file_in(encoding, &elements));
            let name = format!("{program}, {encoding}");
            assert_eq!(reach.input_bounds(), plain.input_bounds(), "{name}");
            assert_eq!(
                (0..5).map(|v| reach.position(v)).collect::<Vec<_>>(),
                (0..5).map(|v| plain.position(v)).collect::<Vec<_>>(),
                "{name}"
            );
            assert_eq!(
                (0..4).map(|t| reach.triangle(t)).collect::<Vec<_>>(),
                (0..4).map(|t| plain.triangle(t)).collect::<Vec<_>>(),
                "{name}"
            );
            assert_eq!(reach.has_colors(), ["MeshLab", "PDAL", "Metashape", "OpenSfM"].contains(&program), "{name}");
        }
    }
}

#[test]
fn numbers_of_64_bits_are_counts_corners_coordinates_and_whatever_else() {
    for encoding in ENCODINGS {
        for count in ["int64", "uint64"] {
            for entry in ["int64", "uint64", "uchar"] {
                let vertices = vertices()
                    .numbers("uint64 id", [1e15; 5])
                    .lists("list uint64 int64 views", (0..5).map(|i| vec![-1.0; i]));
                let faces = Element::new("face").lists(&format!("list {count} {entry} vertex_index"), corner_lists());
                let reach = opened(&file_in(encoding, &[&vertices, &faces]));
                assert_eq!((reach.triangles(), reach.triangle(3)), (4, [3, 0, 4]));
                let id = &reach.files()[0].vertex_properties()[3];
                assert_eq!((id.name.as_str(), id.scalar), ("id", Scalar::U64));
                assert_eq!(
                    reach.files()[0].vertex_record(4)[24..],
                    1_000_000_000_000_000u64.to_le_bytes(),
                    "{encoding}"
                );
            }
        }
        let whole = (0..3).fold(Element::new("vertex"), |e, i| {
            e.numbers(&format!("int64 {}", ["x", "y", "z"][i]), axis(i).map(|v| v * 4.0))
        });
        assert_eq!(
            opened(&file_in(encoding, &[&whole, &faces()])).input_bounds(),
            ([4.0, 8.0, -1.0], [8.0, 12.0, 4.0])
        );
        let lists = [vec![0.0, 1.0, 2.0], vec![0.0, 1.0, -1.0]];
        let missing = Element::new("face").lists("list uchar int64 vertex_index", lists);
        assert_contains(&refusal(&file_in(encoding, &[&vertices(), &missing])), &["face 1 refers to vertex -1"]);
    }
    // The largest number of all, in bits and in digits.
    let text = file_in("ascii", &[&vertices().numbers("uint64 id", [7.0; 5]), &faces()]);
    let text = String::from_utf8(text).expect("text").replace(" 7\r", " 18446744073709551615\r");
    assert_eq!(opened(text.as_bytes()).files()[0].vertex_record(0)[24..], [0xff; 8]);
    assert_contains(
        &refusal(text.replace("18446744073709551615", "-1").as_bytes()),
        &["`-1` is no number that `id` of vertex 0"],
    );
}

#[test]
fn counts_and_corners_that_are_floats_are_refused_by_name_in_every_encoding() {
    for encoding in ENCODINGS {
        for (kind, expected) in
            [("float int", "length is an integer type"), ("uchar double", "a list of an integer type")]
        {
            let faces = Element::new("face").lists(&format!("list {kind} vertex_index"), corner_lists());
            let message = refusal(&file_in(encoding, &[&vertices(), &faces]));
            assert_contains(&message, &["`vertex_index` of element `face`", &format!("`list {kind}`"), expected]);
        }
        let nameless = Element::new("face").lists("list uchar int corners", corner_lists());
        assert_contains(
            &refusal(&file_in(encoding, &[&vertices(), &nameless])),
            &["`face` has no property", "corners"],
        );
        let strips = Element::new("tristrips").lists("list int float vertex_indices", [vec![0.0; 4]]);
        assert_contains(&refusal(&file_in(encoding, &[&vertices(), &strips])), &["of element `tristrips`", "integer"]);
    }
}

#[test]
fn white_space_and_marks_in_a_header_do_not_matter() {
    for encoding in ENCODINGS {
        let whole = file_in(encoding, &[&vertices(), &faces()]);
        let mark = [b"\xef\xbb\xbf".to_vec(), whole.clone()].concat();
        let blanks = with(&with(&whole, "ply\n", "ply  \t\n"), "element vertex 5\n", " element\tvertex   5\t \n");
        let blanks =
            with(&with(&blanks, "end_header\n", "end_header \t\n"), "property double x", "\tproperty\tdouble  x ");
        let empty = with(
            &with(&whole, "comment a test\n", "\ncomment\nobj_info\ncomment \n \t\n"),
            "format",
            "comment first\nformat",
        );
        let mixed = with(&with(&whole, "ply\n", "ply\r\n"), "end_header\n", "end_header\r\n");
        for (name, bytes) in [("mark", &mark), ("blanks", &blanks), ("empty", &empty), ("mixed", &mixed)] {
            let reach = opened(bytes);
            assert_eq!(reach.input_bounds(), ([1.0, 2.0, -0.25], [2.0, 3.0, 1.0]), "{name}, {encoding}");
            assert_eq!(reach.triangle(3), [3, 0, 4], "{name}, {encoding}");
        }
    }
}

#[test]
fn a_property_with_blanks_in_its_name_is_read_by_that_name() {
    let tagged = vertices().numbers("float distance to plane", axis(0));
    let reach = opened(&file(&[&tagged, &faces()]));
    assert_eq!(reach.files()[0].vertex_properties()[3].name, "distance to plane");
}

#[test]
fn a_header_line_without_a_keyword_is_skipped_with_a_warning_where_the_data_are_whole_without_it() {
    for encoding in ENCODINGS {
        let whole = file_in(encoding, &[&vertices(), &faces()]);
        let (reach, warnings) =
            open_bytes(&with(&whole, "comment a test", "Created by a program\nand so on")).expect("readable");
        assert_eq!(reach.triangle(3), [3, 0, 4]);
        let [warning @ Warning::HeaderLinesSkipped { line: 3, lines: 2, .. }] = warnings.as_slice() else {
            panic!("{warnings:?}")
        };
        assert_contains(
            &warning.to_string(),
            &["reach.ply: header line 3 ", "`Created by a program`", "and 1 more", "\nhelp: "],
        );
    }
}

#[test]
fn a_header_line_without_a_keyword_that_shifts_the_data_is_refused_with_its_number() {
    for encoding in ENCODINGS {
        let tagged = vertices().numbers("ushort tag", [1.0; 5]);
        let whole = file_in(encoding, &[&tagged, &faces()]);
        let message = refusal(&with(&whole, "property ushort tag", "proprety ushort tag"));
        assert_contains(
            &message,
            &["header line 8 ", "`proprety ushort tag`", "begins with no PLY keyword", "do not fit"],
        );
        // An element of its own at the end leaves bytes over.
        let more = Element::new("edge").numbers("int a", [1.0]);
        let whole = file_in(encoding, &[&vertices(), &faces(), &more]);
        let message =
            refusal(&with(&with(&whole, "element edge 1", "elment edge 1"), "property int a", "poperty int a"));
        assert_contains(&message, &["header line 10 ", "`elment edge 1`", "bytes are left over"]);
    }
    // What is no text is no comment.
    let bytes = with(&file(&[&vertices(), &faces()]), "comment a test", "\u{1}\u{2} a test");
    assert_contains(&refusal(&bytes), &["header line 3 "]);
}

#[test]
fn elements_without_properties_take_no_time_however_many_are_declared() {
    for encoding in ENCODINGS {
        let mut nothing = Element::new("nothing");
        nothing.declared = Some(u64::MAX);
        assert_eq!(opened(&file_in(encoding, &[&nothing, &vertices(), &faces()])).triangles(), 4);
        let mut vertex = Element::new("vertex");
        vertex.declared = Some(u64::MAX);
        assert_contains(&refusal(&file_in(encoding, &[&vertex, &faces()])), &["`vertex` has no property `x`"]);
        let mut face = Element::new("face");
        face.declared = Some(u64::MAX);
        assert_contains(&refusal(&file_in(encoding, &[&vertices(), &face])), &["`face` has no property"]);
    }
}

#[test]
fn a_header_of_very_many_elements_is_read_in_no_time() {
    let many: String = (0..60_000).map(|i| format!("element e{i} 0\n")).collect();
    let started = std::time::Instant::now();
    opened(&with(&file(&[&vertices(), &faces()]), "comment a test\n", &many));
    assert!(started.elapsed().as_secs_f64() < 5.0, "{:?}", started.elapsed());
}

#[test]
fn a_large_file_that_is_too_short_for_its_header_is_refused_by_its_length_alone() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let mut many_faces = Element::new("face").lists("list uchar int vertex_indices", []);
    many_faces.declared = Some(5_000_000_000);
    let mut many_vertices = Element::new("vertex").numbers("float x", []).numbers("float y", []).numbers("float z", []);
    many_vertices.declared = Some(5_000_000_000);
    for encoding in ENCODINGS {
        for (elements, named) in [([&vertices(), &many_faces], "face"), ([&many_vertices, &many_faces], "vertex")] {
            // A gigabyte of nothing: it takes no room on the disk, but reading it would take seconds.
            let bytes = file_in(encoding, &elements);
            let path = directory.path().join("reach.ply");
            let mut out = std::fs::File::create(&path).expect("create");
            out.write_all(&bytes).expect("write");
            out.set_len(1 << 30).expect("a sparse file");
            let told = |done, _| assert_eq!(done, 0, "{encoding}: read before its length was looked at");
            let error = Reach::open(&[path], &InputSettings::default(), &told).expect_err("too short");
            let OpenError::TooShort { element, count: 5_000_000_000, bytes: 1_073_741_824, .. } = &error else {
                panic!("{error}")
            };
            assert_eq!(element, named);
            assert_contains(&error.to_string(), &["ends at byte 1073741824", "at the latest within", "\nhelp: "]);
        }
    }
}

#[test]
fn a_flaw_in_another_encoding_names_the_byte_of_the_file_itself() {
    let mut lists: Vec<Vec<f64>> = corner_lists().collect();
    lists[3] = vec![0.0, 1.0];
    let faces = Element::new("face").lists("list char int vertex_indices", lists);
    let mut bytes = file_in("binary_big_endian", &[&vertices(), &faces]);
    let at = bytes.len() - 9;
    assert_contains(&refusal(&bytes), &[&format!("face 3 has 2 corners (byte {at})")]);
    bytes[at] = 0xfe;
    assert_contains(&refusal(&bytes), &[&format!("face 3: list `vertex_indices` has -2 entries (byte {at})")]);
}

#[test]
fn lines_of_text_are_counted_by_any_line_end() {
    let text = String::from_utf8(file_in("ascii", &[&vertices(), &faces()])).expect("text").replace("\r\n", "\n");
    let line = text.lines().count();
    let broken = format!("{}four\n", &text[..text.trim_end().rfind(' ').expect("a word") + 1]);
    for newline in ["\n", "\r\n", "\r"] {
        assert_contains(&refusal(broken.replace('\n', newline).as_bytes()), &[&format!("line {line}: `four`")]);
    }
}

#[test]
fn colours_in_whole_numbers_wider_than_a_byte_are_bytes() {
    for kind in ["short", "int", "uint", "int64"] {
        let shares = [[0.0, 255.0, 0.0, 255.0, 255.0], [255.0; 5], [0.0; 5]];
        let colored =
            (0..3).fold(vertices(), |e, i| e.numbers(&format!("{kind} {}", ["red", "green", "blue"][i]), shares[i]));
        let reach = opened(&file(&[&colored, &faces()]));
        assert_eq!((reach.color(1), reach.color(2)), (Some([1.0, 1.0, 0.0]), Some([0.0, 1.0, 0.0])), "{kind}");
    }
}
