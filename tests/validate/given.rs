//! What people give: folders of runs, labels in files of several kinds; and what they get.

use crate::board::{Board, write_npz};
use gravelometer::validate::{Report, ValidateError, Validation, validate};
use std::path::{Path, PathBuf};

const STONES: [&str; 5] = ["..........", ".aaaa.bb..", ".aaaa.bb..", ".aaaa.bb..", ".........."];
const GRAINS: [&str; 5] = ["..........", ".ccaa.bb..", ".ccaa.bb..", ".aaaa.bb..", "..dd......"];

/// A folder with known stones, and room for labels.
pub fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let truth = folder.path().join("scene");
    Board::new(&STONES).write_truth(&truth);
    (folder, truth)
}

/// A folder as a run leaves it: the labelled mesh and the table of its three grains, with more columns.
fn run_folder(folder: &Path, columns: &str, fields: [&str; 4]) -> PathBuf {
    let run = folder.join("found");
    std::fs::create_dir_all(&run).unwrap();
    let labels = Board::new(&GRAINS).of_triangles();
    Board::new(&STONES).write_ply(&run.join("labelled_mesh.ply"), Some(("int grain_id", &labels)), None);
    let rows: String = fields.iter().enumerate().map(|(id, fields)| format!("{id},{fields}\n")).collect();
    std::fs::write(run.join("grains.csv"), format!("grain_id,{columns}\n{rows}")).unwrap();
    run
}

fn report(run: &Path, truth: &Path) -> Result<Report, ValidateError> {
    Ok(validate(&Validation { run: run.to_owned(), truth: truth.to_owned(), ..Validation::default() })?.report)
}

#[test]
fn labels_of_every_kind_of_file_give_the_same_score() {
    let (folder, truth) = place();
    let path = |name: &str| folder.path().join(name);
    let board = Board::new(&STONES);
    let labels = Board::new(&GRAINS).of_triangles();
    board.write_ply(&path("int.ply"), Some(("int segment", &labels)), None);
    board.write_ply(&path("float.ply"), Some(("float label", &labels)), None);
    write_npz(&path("labels.npz"), &[("labels", &labels)]);
    // Little and big-endian records, with numbers before and behind the list of corners.
    for (name, big) in [("little.ply", false), ("big.ply", true)] {
        let (points, triangles) = (board.points(), board.triangles());
        let format = if big { "binary_big_endian" } else { "binary_little_endian" };
        let mut bytes = format!(
            "ply\nformat {format} 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
             element face {}\nproperty uchar red\nproperty short instance\nproperty float quality\n\
             property list uchar int vertex_indices\nproperty int64 id\nend_header\n",
            points.len(),
            triangles.len()
        )
        .into_bytes();
        let order = |mut bytes: Vec<u8>| {
            if big {
                bytes.reverse();
            }
            bytes
        };
        for point in points {
            point.to_array().iter().for_each(|c| bytes.extend(order(c.to_le_bytes().to_vec())));
        }
        for (triangle, &label) in triangles.iter().zip(&labels) {
            bytes.push(7);
            bytes.extend(order((label as i16).to_le_bytes().to_vec()));
            bytes.extend(order(0.5f32.to_le_bytes().to_vec()));
            bytes.push(3);
            triangle.iter().for_each(|v| bytes.extend(order((*v as i32).to_le_bytes().to_vec())));
            bytes.extend(order(99i64.to_le_bytes().to_vec()));
        }
        std::fs::write(path(name), bytes).unwrap();
    }
    let expected = Board::new(&STONES).scored(&GRAINS).score;
    assert_eq!((expected.detection_majority.tp, expected.detection_majority.fp), (2, 2));
    for name in ["int.ply", "float.ply", "labels.npz", "little.ply", "big.ply"] {
        let found = report(&path(name), &truth).unwrap();
        assert_eq!(found.score, expected, "{name}");
        assert_eq!(found.perfect_labels.detection_iou50.f1, 1.0);
    }
    // The likelier name wins: `instance` over `id`.
    let lifted: Vec<i32> = labels.iter().map(|l| l + 1).collect();
    board.write_ply(&path("zero.ply"), Some(("uint grain_id", &lifted)), None);
    let what = Validation { run: path("zero.ply"), truth, zero_is_none: true, ..Validation::default() };
    assert_eq!(validate(&what).unwrap().report.score.detection_majority, expected.detection_majority);
}

#[test]
fn labels_of_vertices_are_taken_from_a_mesh_or_a_cloud() {
    let (folder, truth) = place();
    let board = Board::new(&STONES);
    // A vertex has the stone of the square to its lower right.
    let numbers = board.of_triangles();
    let of_vertex: Vec<i32> = (0..board.points().len())
        .map(|v| (v % (board.width() + 1), v / (board.width() + 1)))
        .map(|(x, y)| if x < board.width() && y < 5 { numbers[2 * (y * board.width() + x)] } else { -1 })
        .collect();
    let mesh = folder.path().join("vertices.ply");
    board.write_ply(&mesh, None, Some(("int label", &of_vertex)));
    let by_mesh = report(&mesh, &truth).unwrap().score;
    assert_eq!(by_mesh.detection_majority.tp, 2);
    let text = std::fs::read_to_string(&mesh).unwrap();
    let (header, rest) = text.split_once("element face").unwrap();
    let rows: String = rest
        .lines()
        .skip_while(|l| *l != "end_header")
        .take(1 + of_vertex.len())
        .fold(String::new(), |all, line| all + line + "\n");
    let cloud = folder.path().join("cloud.ply");
    std::fs::write(&cloud, format!("{header}{rows}")).unwrap();
    assert_eq!(report(&cloud, &truth).unwrap().score, by_mesh);
}

#[test]
fn the_folder_of_a_run_gets_scores_and_a_picture_and_its_own_axes_are_scored() {
    let (folder, truth) = place();
    let columns =
        "ellipsoid_a_axis_m,ellipsoid_b_axis_m,ellipsoid_c_axis_m,a_fit_m,b_fit_m,c_fit_m,confidence,zingg_class";
    let fields = ["3.3,1.8,1.0,3,2,1,0.9,disc", ",,,3,2,1.5,0.8,rod", "9,9,9,9,9,9,0.1,rod", ",,,,,,,blade"];
    let run = run_folder(folder.path(), columns, fields);
    let what = Validation { run: run.clone(), truth, ..Validation::default() };
    let found = validate(&what).unwrap();
    assert_eq!(found.files, [run.join("validation.json"), run.join("validation.png")]);
    assert!(std::fs::read(run.join("validation.png")).unwrap().starts_with(b"\x89PNG\r\n"));
    // Grain 0 is the match of stone 0, and has the only ellipsoid of a match.
    let ellipsoid = found.report.ellipsoid.as_ref().unwrap();
    assert_eq!(ellipsoid.stones, 1);
    assert!((ellipsoid.axes.a.bias_percent - 10.0).abs() < 1e-9 && (ellipsoid.axes.b.bias_percent + 10.0).abs() < 1e-9);
    assert!((ellipsoid.axes.a.mean_abs_mm - 300.0).abs() < 1e-9 && ellipsoid.axes.c.mean_abs_percent == 0.0);
    let fit = found.report.fit.as_ref().unwrap();
    assert_eq!(fit.stones, 2);
    assert!((fit.axes.c.mean_abs_percent - 25.0).abs() < 1e-9, "{fit:?}");
    assert_eq!(fit.b_axis_mm.unwrap().segments.unwrap().d50, 2000.0, "of 2, 2 and 9 m");
    let reliability = found.report.reliability.as_ref().unwrap();
    assert_eq!((reliability.grains, reliability.bins.len()), (3, 3));

    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(run.join("validation.json")).unwrap()).unwrap();
    for (key, value) in [
        ("/truth", "\"best\""),
        ("/segments", "4"),
        ("/visible", "2"),
        ("/detection_majority/tp", "2"),
        ("/detection_majority/fn", "0"),
        ("/errors/mostly_sand", "1"),
        ("/errors/over_segmented_extra", "1"),
        ("/astray/further_grains", "[2]"),
        ("/astray/sand_grains", "[3]"),
        ("/astray/overlooked_stones", "[]"),
        ("/matched/0/pebble", "0"),
        ("/matched/0/ref", "0"),
        ("/fit/stones", "2"),
        ("/perfect_labels/detection_iou50/f1", "1.0"),
        ("/b_axis_mm/truth/D50", "2000.0"),
    ] {
        assert_eq!(json.pointer(key).map(ToString::to_string).as_deref(), Some(value), "{key} of {json}");
    }
    for key in ["/area/iou/median", "/axes/A/bias_percent", "/b_axis_mm/error_percent/D84", "/matched/0/A_error"] {
        assert!(json.pointer(key).is_some_and(serde_json::Value::is_number), "{key} of {json}");
    }
    let text = found.report.to_string();
    for part in
        ["2 stones count, 4 grains", "b axis, mm", "ellipsoid_*_axis_m", "completed: *_fit_m", "true labels would give"]
    {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    // Again: its own results are replaced, and nothing else is in the folder.
    validate(&what).unwrap();
    assert_eq!(std::fs::read_dir(&run).unwrap().count(), 4);
}

#[test]
fn columns_that_a_run_does_not_have_are_not_scored() {
    let (folder, truth) = place();
    let run = run_folder(folder.path(), "a_axis_m", ["1", "1", "1", "1"]);
    let found = report(&run, &truth).unwrap();
    assert!(found.ellipsoid.is_none() && found.fit.is_none() && found.reliability.is_none());
    std::fs::remove_file(run.join("grains.csv")).unwrap();
    assert!(report(&run, &truth).is_ok(), "labels are enough");
}

#[test]
fn the_command_prints_the_tables_and_where_the_picture_is() {
    let (folder, truth) = place();
    let labels = folder.path().join("labels.npz");
    write_npz(&labels, &[("labels", &Board::new(&GRAINS).of_triangles())]);
    let picture = folder.path().join("map.png");
    let command = || assert_cmd::Command::new(env!("CARGO_BIN_EXE_gravelometer"));
    let output = command().arg("validate").arg(&labels).arg(&truth).arg("--picture").arg(&picture).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    for part in ["detection", "grain mostly the stone", "map.png", "red ", "missed", "degrees"] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    assert!(picture.is_file() && !folder.path().join("validation.json").exists());
    let help = String::from_utf8(command().args(["validate", "--help"]).output().unwrap().stdout).unwrap();
    for part in ["tri_id", "A,B,C", "needed", "--labelled-mesh", "--visible-area", "strict", "yellow", "m²", "r00"] {
        assert!(help.contains(part), "{part} in\n{help}");
    }
    let refused = command().arg("validate").arg(folder.path()).arg(&truth).output().unwrap();
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1));
    assert!(said.contains("run again with --labelled-mesh"), "{said}");
}

#[test]
fn a_run_that_replaces_its_results_knows_what_scores_of_them_are_called() {
    assert_eq!(gravelometer::validate::WRITTEN, gravelometer::write::SCORES);
}
