//! Truth and labels that are missing, damaged or of another scene: errors that name the file, the place and a remedy.

use crate::board::{Board, write_npz};
use crate::given::place;
use gravelometer::validate::{TruthRule, Validation, validate};
use std::path::Path;

const GRAINS: [&str; 5] = ["..........", ".ccaa.bb..", ".ccaa.bb..", ".aaaa.bb..", "..dd......"];

/// What is said of labels and truth that cannot be scored, checked to name a remedy.
#[track_caller]
fn refusal(what: &Validation, parts: &[&str]) {
    let message = validate(what).expect_err("must be refused").to_string();
    for part in parts.iter().copied().chain(["\nhelp: "]) {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

/// Good labels beside a good truth.
fn good(folder: &Path, truth: &Path) -> Validation {
    let run = folder.join("labels.npz");
    write_npz(&run, &[("labels", &Board::new(&GRAINS).of_triangles())]);
    let what = Validation { run, truth: truth.to_owned(), ..Validation::default() };
    validate(&what).unwrap();
    what
}

#[test]
fn a_missing_file_of_the_truth_is_named() {
    for name in ["mesh.ply", "truth.npz", "truth.csv"] {
        let (folder, truth) = place();
        let what = good(folder.path(), &truth);
        std::fs::remove_file(truth.join(name)).unwrap();
        refusal(&what, &[name, "scene"]);
    }
    let (folder, truth) = place();
    let what = good(folder.path(), &truth);
    refusal(&Validation { truth: folder.path().join("nowhere"), ..what.clone() }, &["nowhere", "mesh.ply"]);
    refusal(&Validation { run: folder.path().join("nothing"), ..what.clone() }, &["nothing", "no such file"]);
    refusal(&Validation { run: truth.clone(), ..what }, &["labelled_mesh.ply", "--labelled-mesh"]);
}

#[test]
fn a_table_without_what_is_needed_names_column_line_and_text() {
    let (folder, truth) = place();
    let what = good(folder.path(), &truth);
    for (table, parts) in [
        ("id,visible,A,B\n0,1,3,2\n1,1,3,2\n", vec!["`C`", "id, visible, A, B"]),
        ("A,B,C\n3,2,1\n3,2,\n", vec!["line 3", "`C`", "length above 0"]),
        ("A,B,C\n3,2,1\n3,-2,1\n", vec!["line 3", "`B`", "-2"]),
        ("A,B,C\n3,two,1\n3,2,1\n", vec!["line 2", "`two`", "number"]),
        ("id,A,B,C\n1,3,2,1\n2,3,2,1\n", vec!["line 2", "`id`", "`1`"]),
        ("A,B,C\n3,2,1\n3,2\n", vec!["cannot read the table"]),
        ("A,B,C\n3,2,1\n", vec!["tri_id", "stone 1", "1 stones"]),
        (
            "A,B,C,r00,r01,r02,r10,r11,r12,r20,r21,r22\n3,2,1,1,0,0,0,1,0,0,0,1\n3,2,1,1,0,0,0.5,0.866,0,0,0,1\n",
            vec!["line 3", "`r00`", "0.866", "right angles"],
        ),
        (
            "A,B,C,r00,r01,r02,r10,r11,r12,r20,r21,r22\n3,2,1,1,0,0,1,0,0,0,0,1\n3,2,1,,,,,,,,,\n",
            vec!["line 2", "unit vectors"],
        ),
        ("", vec!["`A`"]),
    ] {
        std::fs::write(truth.join("truth.csv"), table).unwrap();
        refusal(&what, &[parts, vec!["truth."]].concat());
    }
    std::fs::write(truth.join("truth.csv"), "A,B,C\n3,2,1\n3,2,1\n").unwrap();
    assert_eq!(validate(&what).unwrap().report.score.visible, 2, "the other columns are not needed");
    refusal(&Validation { visible_area_m2: Some(1.0), ..what }, &["component_area", "--visible-area"]);
}

#[test]
fn arrays_that_do_not_fit_the_mesh_are_named() {
    let (folder, truth) = place();
    let what = good(folder.path(), &truth);
    let archive = truth.join("truth.npz");
    let stones = Board::new(&["..........", ".aaaa.bb..", ".aaaa.bb..", ".aaaa.bb..", ".........."]).of_triangles();
    write_npz(&archive, &[("other", &stones)]);
    refusal(&what, &["truth.npz", "tri_id", "other"]);
    write_npz(&archive, &[("tri_id", &stones[1..])]);
    refusal(&what, &["tri_id", "99 numbers", "100 triangles"]);
    write_npz(&archive, &[("tri_id", &stones)]);
    validate(&what).unwrap();
    refusal(&Validation { rule: TruthRule::Strict, ..what.clone() }, &["tri_strict", "tri_id"]);
    std::fs::write(&archive, "no archive").unwrap();
    refusal(&what, &["truth.npz", "archive"]);
}

#[test]
fn labels_of_another_mesh_are_refused_with_the_counts() {
    let (folder, truth) = place();
    let what = good(folder.path(), &truth);
    let path = |name: &str| folder.path().join(name);
    let of = |name: &str| Validation { run: path(name), ..what.clone() };
    let board = Board::new(&GRAINS);
    let labels = board.of_triangles();
    write_npz(&path("short.npz"), &[("labels", &labels[3..])]);
    refusal(&of("short.npz"), &["97 labels", "100 triangles", "66 vertices"]);
    let other = Board::new(&["aabb", "aabb"]);
    other.write_ply(&path("other.ply"), Some(("int label", &other.of_triangles())), None);
    refusal(&of("other.ply"), &["16 faces", "100 triangles"]);
    board.write_ply(&path("plain.ply"), None, None);
    refusal(&of("plain.ply"), &["plain.ply", "segment, label, grain_id"]);
    board.write_ply(&path("odd.ply"), Some(("float label", &labels)), None);
    let text = std::fs::read_to_string(path("odd.ply")).unwrap();
    let first = text.find("\n3 0 ").unwrap() + 1;
    let end = first + text[first..].find('\n').unwrap();
    let mut text = text;
    text.replace_range(first..end, "3 0 11 12 0.5");
    std::fs::write(path("odd.ply"), text).unwrap();
    refusal(&of("odd.ply"), &["face 0", "0.5", "whole number"]);
    std::fs::write(path("no.ply"), "no mesh").unwrap();
    refusal(&of("no.ply"), &["no.ply"]);
    std::fs::write(path("no.npy"), "no numbers").unwrap();
    refusal(&of("no.npy"), &["no.npy", "NumPy"]);
    std::fs::write(path("real.npy"), npy("'<f8'", "(100,)", &[0; 800])).unwrap();
    refusal(&of("real.npy"), &["<f8", "whole numbers"]);
    std::fs::write(path("cut.npy"), npy("'<i4'", "(100,)", &[0; 396])).unwrap();
    refusal(&of("cut.npy"), &["99 of 100"]);
    std::fs::write(path("huge.npy"), npy("'<i4'", "(99999999999, 99999999999)", &[])).unwrap();
    refusal(&of("huge.npy"), &["huge.npy", "no size"]);
    std::fs::write(path("deep.npy"), npy(&"(".repeat(60_000), "(100,)", &[])).unwrap();
    refusal(&of("deep.npy"), &["deep.npy", "header"]);
}

/// A `.npy` file with this description, shape and numbers.
fn npy(description: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': {description}, 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(numbers);
    bytes
}

#[test]
fn numbers_of_every_width_and_order_are_read() {
    let (folder, truth) = place();
    let what = good(folder.path(), &truth);
    let expected = validate(&what).unwrap().report.score;
    let labels = Board::new(&GRAINS).of_triangles();
    let path = folder.path().join("wide.npy");
    let each = |bytes: &dyn Fn(i32) -> Vec<u8>| labels.iter().flat_map(|&l| bytes(l)).collect::<Vec<u8>>();
    for (kind, bytes) in [
        ("'|i1'", each(&|l| (l as i8).to_le_bytes().to_vec())),
        ("'>i2'", each(&|l| (l as i16).to_be_bytes().to_vec())),
        ("'<i8'", each(&|l| i64::from(l).to_le_bytes().to_vec())),
        // -1 that lost its sign.
        ("'<u4'", each(&|l| (l as u32).to_le_bytes().to_vec())),
        ("'>u8'", each(&|l| (i64::from(l) as u64).to_be_bytes().to_vec())),
    ] {
        for shape in ["(100,)", "(100, 1)"] {
            std::fs::write(&path, npy(kind, shape, &bytes)).unwrap();
            let found = validate(&Validation { run: path.clone(), ..what.clone() }).unwrap().report.score;
            assert_eq!(found, expected, "{kind} {shape}");
        }
    }
}

#[test]
fn any_byte_of_an_archive_may_be_wrong_without_a_panic() {
    let (folder, truth) = place();
    let what = good(folder.path(), &truth);
    let archive = truth.join("truth.npz");
    let whole = std::fs::read(&archive).unwrap();
    let (mut refused, mut tried) = (0, 0);
    for at in (0..whole.len()).step_by(3) {
        let mut damaged = whole.clone();
        damaged[at] = damaged[at].wrapping_mul(31).wrapping_add(129 + (at % 100) as u8);
        std::fs::write(&archive, damaged).unwrap();
        tried += 1;
        if let Err(error) = validate(&what) {
            refused += 1;
            assert!(error.to_string().contains("truth.npz"), "{error}");
        }
    }
    assert!(tried > 100 && refused > tried / 4, "{refused} of {tried}");
    for end in (0..whole.len()).step_by(7) {
        std::fs::write(&archive, &whole[..end]).unwrap();
        assert!(validate(&what).unwrap_err().to_string().contains("truth.npz"), "cut at {end}");
    }
}

#[test]
fn nothing_that_is_read_is_written_over() {
    let (folder, truth) = place();
    let what = good(folder.path(), &truth);
    let table = Some(truth.join("truth.csv"));
    refusal(&Validation { json: table.clone(), ..what.clone() }, &["truth.csv", "scores"]);
    refusal(&Validation { picture: table, ..what.clone() }, &["truth.csv", "picture"]);
    refusal(&Validation { json: Some(what.run.clone()), ..what.clone() }, &["labels.npz"]);
    validate(&what).unwrap();
    refusal(&Validation { json: Some(folder.path().join("none/x.json")), ..what }, &["none/x.json"]);
}
