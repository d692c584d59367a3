//! The command line as people meet it: help that teaches, every setting by every way, and messages that say
//! what, where and what to do.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gravelometer::geometry::DVec3;
use gravelometer::open::MemorySurface;
use gravelometer::settings::Settings;
use gravelometer::write::OUTPUTS;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use support::bed::{bed, write_ply};

struct Said {
    code: i32,
    out: String,
    err: String,
}

fn gravelometer<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Said {
    let output = assert_cmd::Command::new(env!("CARGO_BIN_EXE_gravelometer")).args(args).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let said = Said { code: output.status.code().unwrap(), out: text(output.stdout), err: text(output.stderr) };
    assert!(!said.err.contains("panicked"), "{}", said.err);
    said
}

fn words(line: &str) -> Vec<String> {
    line.split(' ').map(str::to_owned).collect()
}

/// Runs a mesh into a folder, with more arguments.
fn run(mesh: &Path, out: &Path, more: &[&str]) -> Said {
    let mut args = vec!["run".into(), mesh.as_os_str().to_owned(), "-o".into(), out.as_os_str().to_owned()];
    args.extend(more.iter().map(|a| a.into()));
    gravelometer(args)
}

impl Said {
    fn fails(&self, code: i32, says: &[&str]) {
        assert_eq!(self.code, code, "{}", self.err);
        for text in says {
            assert!(self.err.contains(text), "`{text}` is not in: {}", self.err);
        }
    }
}

fn scene() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("bed.ply");
    write_ply(&mesh, &bed(21, 60, 50));
    (folder, mesh)
}

/// The files of a folder, without what a run keeps to go on.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| !p.ends_with("gravelometer-work"))
        .map(|p| (p.clone(), std::fs::read(&p).unwrap()))
        .collect()
}

#[test]
fn help_names_every_command_and_the_exit_codes() {
    let said = gravelometer(["--help"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    for text in ["run", "inspect", "demo", "validate", "settings", "Exit codes", "130"] {
        assert!(said.out.contains(text), "{text}: {}", said.out);
    }
}

#[test]
fn help_of_run_teaches_units_keys_files_and_examples() {
    let said = gravelometer(["run", "--help"]);
    assert_eq!(said.code, 0);
    let texts = [
        "metres",
        "m²",
        "[segment.max_grain_m",
        "[input.offset",
        "[work.memory",
        "EPSG:2193",
        "Examples:",
        "gravelometer run reach.ply",
        "Exit codes",
        "do not depend on",
    ];
    for text in texts.into_iter().chain(OUTPUTS) {
        assert!(said.out.contains(text), "{text}: {}", said.out);
    }
    for command in ["inspect", "demo", "settings"] {
        assert_eq!(gravelometer([command, "--help"]).code, 0, "{command}");
    }
}

#[test]
fn the_version_is_that_of_the_package() {
    assert_eq!(gravelometer(["--version"]).out.trim(), concat!("gravelometer ", env!("CARGO_PKG_VERSION")));
}

/// Another value that the key accepts.
fn another(section: &str, key: &str, value: &toml::Value) -> toml::Value {
    let candidates: Vec<toml::Value> = match value {
        toml::Value::Boolean(b) => vec![(!b).into()],
        toml::Value::Integer(i) => vec![(i + 1).into()],
        toml::Value::Float(f) => vec![(f + 0.3).into(), (0.9 * f).into()],
        toml::Value::Array(a) => vec![toml::Value::Array(vec![1.5.into(); a.len()])],
        _ => ["mm", "triangle-count", "mean", "3GiB", "EPSG:2193", "scalar", "rheinwalt2025"]
            .into_iter()
            .map(toml::Value::from)
            .collect(),
    };
    let accepted = |v: &toml::Value| v != value && Settings::load(None, &[format!("{section}.{key}={v}")]).is_ok();
    candidates.into_iter().find(accepted).unwrap_or_else(|| panic!("{section}.{key}: no other value is accepted"))
}

#[test]
fn every_key_gives_the_same_settings_by_set_and_by_file_and_changes_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let default = toml::Table::try_from(Settings::default()).unwrap();
    let mut keys = 0;
    for (section, values) in &default {
        for (key, value) in values.as_table().unwrap() {
            let other = another(section, key, value);
            let file = folder.path().join(format!("{section}-{key}.toml"));
            std::fs::write(&file, format!("[{section}]\n{key} = {other}\n")).unwrap();
            let by_set = gravelometer(["settings".into(), "--set".into(), format!("{section}.{key}={other}")]);
            let by_file = gravelometer(["settings".as_ref(), "--config".as_ref(), file.as_os_str()]);
            assert_eq!((by_set.code, by_file.code), (0, 0), "{} {}", by_set.err, by_file.err);
            assert_eq!(by_set.out, by_file.out, "{section}.{key}");
            let mut expected = default.clone();
            expected[section][key] = other;
            assert_eq!(by_set.out.parse::<toml::Table>().unwrap(), expected, "{section}.{key}");
            keys += 1;
        }
    }
    assert!(keys >= 25, "{keys} keys");
}

#[test]
fn every_flag_gives_the_settings_of_its_key_and_wins_over_set_and_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("other.toml");
    std::fs::write(&file, "[segment]\nmax_grain_m = 7.0\n[work]\nthreads = 9\n").unwrap();
    for (flags, sets) in [
        ("--crs EPSG:2193", "--set input.crs=EPSG:2193"),
        ("--offset 1,-2.5,3", "--set input.offset=[1.0,-2.5,3.0]"),
        ("--offset -1,2", "--set input.offset=[-1.0,2.0,0.0]"),
        ("--offset-file coords.txt", "--set input.offset_file=coords.txt"),
        ("--unit mm", "--set input.unit=mm"),
        ("--unit us-ft", "--set input.unit=us-ft"),
        ("--max-grain 1.25", "--set segment.max_grain_m=1.25"),
        ("--min-grain-area 0.005", "--set segment.min_grain_area_m2=5e-3"),
        ("--tile-size 12.5", "--set work.tile_size_m=12.5"),
        ("--threads 3", "--set work.threads=3"),
        ("--memory 500MB", "--set work.memory=500MB"),
        ("--labelled-mesh", "--set output.labelled_mesh=true"),
        ("--set segment.max_grain_m=4 --max-grain 3", "--set segment.max_grain_m=3.0"),
        ("--config sandbox --threads 2", "--config sandbox --set work.threads=2"),
    ] {
        let [by_flag, by_set] = [flags, sets].map(|line| gravelometer(words(&format!("settings {line}"))));
        assert_eq!((by_flag.code, by_set.code), (0, 0), "{flags}: {} {}", by_flag.err, by_set.err);
        assert_eq!(by_flag.out, by_set.out, "{flags}");
        assert_ne!(by_flag.out, gravelometer(["settings"]).out, "{flags}");
    }
    let over_file = gravelometer(words(&format!("settings --max-grain 1 --config {}", file.display()))).out;
    assert!(over_file.contains("max_grain_m = 1.0") && over_file.contains("threads = 9"), "{over_file}");
}

#[test]
fn printed_settings_can_be_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("again.toml");
    let first = gravelometer(words("settings --config drone --set work.memory=3GiB --offset 1480000,5250000,700")).out;
    std::fs::write(&file, &first).unwrap();
    assert_eq!(gravelometer(["settings".as_ref(), "--config".as_ref(), file.as_os_str()]).out, first);
}

#[test]
fn settings_that_cannot_be_used_end_with_code_2_and_name_the_key() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.toml");
    std::fs::write(&broken, "[segment]\nmax_grain_m = = 2\n").unwrap();
    let broken = broken.display().to_string();
    for (line, says) in [
        ("--set segment.minimum=3".to_owned(), vec!["minimum", "help:"]),
        ("--set sediment.max_grain_m=3".to_owned(), vec!["sediment", "help:"]),
        ("--set max_grain_m".to_owned(), vec!["section.key=value"]),
        ("--set segment.min_sphericity=1.5".to_owned(), vec!["segment.min_sphericity = 1.5"]),
        ("--set segment.max_grain_m=wide".to_owned(), vec!["segment.max_grain_m"]),
        ("--set curvature.neighbours=0".to_owned(), vec!["curvature.neighbours = 0"]),
        ("--set segment.erosion_iterations=-1".to_owned(), vec!["erosion_iterations"]),
        ("--max-grain -1".to_owned(), vec!["-1"]),
        ("--max-grain=-1".to_owned(), vec!["segment.max_grain_m = -1"]),
        ("--max-grain=nan".to_owned(), vec!["segment.max_grain_m"]),
        ("--memory many".to_owned(), vec!["work.memory = many"]),
        ("--threads 5000".to_owned(), vec!["work.threads = 5000"]),
        ("--offset 1".to_owned(), vec!["east,north"]),
        ("--unit furlong".to_owned(), vec!["furlong"]),
        ("--config nowhere.toml".to_owned(), vec!["nowhere.toml", "help:"]),
        (format!("--config {broken}"), vec!["broken.toml", "line 2"]),
        ("--no-such-flag".to_owned(), vec!["--no-such-flag"]),
    ] {
        gravelometer(words(&format!("settings {line}"))).fails(2, &says);
    }
    gravelometer(["run"]).fails(2, &["--out"]);
    gravelometer(["run", "-o", "somewhere"]).fails(2, &["INPUTS"]);
    gravelometer(["nonsense"]).fails(2, &["nonsense"]);
}

#[test]
fn inputs_that_cannot_be_read_end_with_code_1_name_the_path_and_help() {
    let (folder, mesh) = scene();
    let missing = folder.path().join("missing.ply");
    let out = folder.path().join("out");
    run(&missing, &out, &[]).fails(1, &["missing.ply", "there is no such file", "\nhelp: "]);
    let empty = tempfile::tempdir().unwrap();
    run(empty.path(), &out, &[]).fails(1, &[empty.path().to_str().unwrap(), "the folder is empty", "\nhelp: "]);
    std::fs::write(empty.path().join("photo.jpg"), "x").unwrap();
    run(empty.path(), &out, &[]).fails(1, &["holds 1 .jpg, but no *.ply", "\nhelp: "]);
    run(&empty.path().join("*.ply"), &out, &[]).fails(1, &["*.ply: nothing matches", "\nhelp: "]);
    run(Path::new("@nowhere.txt"), &out, &[]).fails(1, &["@nowhere.txt", "cannot be read", "\nhelp: "]);
    run(&mesh, &out, &["--crs", "EPSG:999999"]).fails(2, &["EPSG:999999", "\nhelp: "]);
    run(&mesh, &out, &["--crs", "EPSG:4326"]).fails(2, &["not a projected system", "\nhelp: "]);
    let offset = folder.path().join("offset.txt");
    std::fs::write(&offset, "far away").unwrap();
    let offset = offset.to_str().unwrap();
    run(&mesh, &out, &["--offset-file", offset]).fails(2, &["offset.txt: line 1: `far`", "500000 4600000", "\nhelp: "]);
    run(&mesh, &out, &["--offset-file", offset, "--offset", "1,2"]).fails(2, &["only one of them", "\nhelp: "]);
    assert!(!out.exists());
    // Found out when the survey is indexed: the index is kept for the run that follows.
    run(&mesh, &out, &["--set", "raster.cell_m=1e-5"]).fails(2, &["raster.cell_m", "\nhelp: "]);
    assert!(contents(&out).is_empty() && out.join("gravelometer-work").is_dir());
    gravelometer(["inspect".as_ref(), missing.as_os_str()]).fails(1, &["missing.ply", "\nhelp: "]);
}

#[test]
fn older_results_are_touched_by_force_only_and_by_complete_results_only() {
    let (folder, mesh) = scene();
    let out = folder.path().join("out");
    assert_eq!(run(&mesh, &out, &["--labelled-mesh"]).code, 0);
    let notes = out.join("notes.txt");
    std::fs::write(&notes, "mine").unwrap();
    let scores = ["validation.json", "validation.png"].map(|name| out.join(name));
    scores.iter().for_each(|path| std::fs::write(path, "of these results").unwrap());
    let before = contents(&out);
    assert_eq!(before.len(), 9, "{:?}", before.keys());
    let refusal = ["holds files already", "validation.json", "validation.png", "--force", "\nhelp: "];
    run(&mesh, &out, &[]).fails(1, &refusal);
    assert!(contents(&out) == before, "a refused run changed the folder");
    let damaged = folder.path().join("damaged.ply");
    let bytes = std::fs::read(&mesh).unwrap();
    std::fs::write(&damaged, &bytes[..bytes.len() - 1]).unwrap();
    run(&damaged, &out, &["--force"]).fails(1, &["damaged.ply"]);
    assert!(contents(&out) == before, "a failed run changed the folder");
    assert_eq!(run(&mesh, &out, &["--force", "--set", "raster.cell_m=0.25"]).code, 0);
    let after = contents(&out);
    assert!(after[&out.join("grain_size.tif")] != before[&out.join("grain_size.tif")], "nothing was replaced");
    assert!(!after.contains_key(&out.join("labelled_mesh.ply")), "an older result was left among new ones");
    assert!(!scores.iter().any(|path| after.contains_key(path)), "scores of older results were left among new ones");
    assert_eq!(after[&notes], b"mine");
}

#[test]
fn an_output_folder_that_cannot_be_is_refused() {
    let (folder, mesh) = scene();
    let file = folder.path().join("file");
    std::fs::write(&file, "mine").unwrap();
    run(&mesh, &file, &["--force"]).fails(1, &["is not a folder", "\nhelp: "]);
    run(&mesh, &file.join("below"), &["--force"]).fails(1, &["file/below", "\nhelp: "]);
    assert_eq!(std::fs::read(&file).unwrap(), b"mine");
    if Path::new("/proc/self").exists() {
        run(&mesh, Path::new("/proc/no-place-for-results"), &[]).fails(1, &["no-place-for-results", "\nhelp: "]);
    }
}

/// A level sheet: not a grain on it.
fn plane() -> MemorySurface {
    let mut plane = MemorySurface::default();
    for j in 0..=40u32 {
        for i in 0..=40u32 {
            plane.positions.push(DVec3::new(f64::from(i) * 0.01, f64::from(j) * 0.01, 0.25));
        }
    }
    for (i, j) in (0..40u64).flat_map(|j| (0..40u64).map(move |i| (i, j))) {
        let a = j * 41 + i;
        plane.triangles.extend([[a, a + 1, a + 42], [a, a + 42, a + 41]]);
    }
    plane
}

#[test]
fn a_survey_without_grains_is_a_result_with_all_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, out) = (folder.path().join("plane.ply"), folder.path().join("out"));
    write_ply(&mesh, &plane());
    let said = run(&mesh, &out, &["--labelled-mesh", "--crs", "EPSG:2193"]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.err.contains("0 grains"), "{}", said.err);
    let mut csv = csv::Reader::from_path(out.join("grains.csv")).unwrap();
    assert!(csv.headers().unwrap().iter().any(|h| h == "b_axis_m"));
    assert_eq!(csv.records().count(), 0);
    for name in ["summary.json", "run.json"] {
        serde_json::from_slice::<serde_json::Value>(&std::fs::read(out.join(name)).unwrap()).unwrap();
    }
    use gdal::vector::LayerAccess;
    let package = gdal::Dataset::open(out.join("grains.gpkg")).unwrap();
    assert_eq!(package.layer_by_name("grains").unwrap().feature_count(), 0);
    assert!(gdal::Dataset::open(out.join("grain_size.tif")).unwrap().raster_count() >= 6);
    assert_eq!(gravelometer(["inspect".as_ref(), out.join("labelled_mesh.ply").as_os_str()]).code, 0);
}

#[test]
fn json_lines_are_json_and_tell_every_stage_from_begin_to_end() {
    let (folder, mesh) = scene();
    let published = ["--set", "segment.method=rheinwalt2025"];
    let said = run(&mesh, &folder.path().join("out"), &[&["--log", "json"], &published[..]].concat());
    assert_eq!((said.code, said.out.as_str()), (0, ""), "{}", said.err);
    let lines: Vec<serde_json::Value> = said.err.lines().map(|l| serde_json::from_str(l).expect(l)).collect();
    for stage in ["open", "index", "spacing", "curvature", "grains", "write"] {
        for event in ["begin", "end"] {
            let told = lines.iter().filter(|l| l["stage"] == stage && l["event"] == event).count();
            assert_eq!(told, 1, "{event} of {stage}: {}", said.err);
        }
        let end = lines.iter().find(|l| l["stage"] == stage && l["event"] == "end").unwrap();
        assert_eq!(end["done"], end["total"], "{stage}");
    }
    let plain = run(&mesh, &folder.path().join("plain"), &published);
    assert!(plain.err.contains("curvature: ") && !plain.err.contains('\r'), "{}", plain.err);
    // The sizes that are printed are those of the summary, of both counts.
    let summary = std::fs::read(folder.path().join("plain/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    for (count, said) in
        [("area", "each grain counted once"), ("grid", "as a pebble count at the knots of a grid finds it")]
    {
        let mm = |key: &str| 1e3 * summary[format!("b_axis_{count}_by_number")][key].as_f64().unwrap();
        let [d16, d50, d84] = ["d16_m", "d50_m", "d84_m"].map(mm);
        let line = format!("b axis, {said}: D16 {d16:.1} mm, D50 {d50:.1} mm, D84 {d84:.1} mm");
        assert!(plain.err.contains(&line), "`{line}` is not in: {}", plain.err);
    }
}

#[test]
fn every_stage_and_its_cost_are_in_the_table_and_in_run_json() {
    let (folder, mesh) = scene();
    let out = folder.path().join("out");
    let said = run(&mesh, &out, &["--set", "segment.method=rheinwalt2025"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let surface = bed(21, 60, 50);
    let triangles = surface.triangles.len() as u64;
    let in_use: std::collections::BTreeSet<u64> = surface.triangles.iter().flatten().copied().collect();
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
    let expected = [
        ("open", std::fs::metadata(&mesh).unwrap().len(), "bytes"),
        ("index", triangles, "triangles"),
        ("spacing", in_use.len() as u64, "vertices"),
        ("curvature", in_use.len() as u64, "vertices"),
        ("grains", triangles, "triangles"),
        ("write", 5, "files"),
    ];
    let stages = report["stages"].as_array().unwrap();
    assert_eq!(stages.len(), expected.len(), "{stages:?}");
    let mut wall_s = 0.0;
    for (stage, (name, amount, unit)) in stages.iter().zip(expected) {
        assert_eq!((&stage["name"], &stage["amount"], &stage["unit"]), (&name.into(), &amount.into(), &unit.into()));
        wall_s += stage["wall_s"].as_f64().unwrap();
        let row = said.err.lines().find(|l| l.starts_with(&format!("{name} "))).unwrap_or_else(|| panic!("{name}"));
        assert!(row.contains(&format!(" {amount} {unit} ")), "{row}");
    }
    assert!(wall_s > 0.0 && wall_s <= report["wall_s"].as_f64().unwrap() + 1e-5, "{report}");
    assert!(said.err.contains(&format!(" {triangles} triangles ")) && said.err.contains("peak memory"), "{}", said.err);
    assert!(report["facts"]["segmented_per_triangle"].as_f64().unwrap() >= 1.0);
    if cfg!(target_os = "linux") {
        let cpu_s = |value: &serde_json::Value| value["cpu_s"].as_f64().unwrap();
        assert!(stages.iter().map(cpu_s).sum::<f64>() <= cpu_s(&report) + 1e-5, "{report}");
        assert!(report["peak_memory_bytes"].as_u64().unwrap() > 1 << 20, "{report}");
    }
}

#[test]
fn inspect_tells_people_and_programs_the_same() {
    let (_folder, mesh) = scene();
    let plain = gravelometer(["inspect".as_ref(), mesh.as_os_str()]);
    let json = gravelometer(["inspect".as_ref(), mesh.as_os_str(), "--json".as_ref()]);
    assert_eq!((plain.code, json.code), (0, 0), "{} {}", plain.err, json.err);
    let value: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    let surface = bed(21, 60, 50);
    let text = value.to_string();
    for count in [surface.positions.len(), surface.triangles.len()] {
        assert!(text.contains(&count.to_string()), "{text}");
    }
    assert_eq!(value["survey"]["has_colors"], true);
    assert!(plain.out.contains("bed.ply") && plain.out.contains("survey (1 file)"), "{}", plain.out);
    let scaled = gravelometer(words(&format!("inspect {} --unit mm --crs EPSG:2193 --json", mesh.display())));
    let value: serde_json::Value = serde_json::from_str(&scaled.out).unwrap();
    assert_eq!(value["survey"]["georeference"]["metres_per_input_unit"], 1e-3);
    assert_eq!(value["survey"]["georeference"]["authority"], "EPSG:2193");
}

#[test]
fn what_lies_beside_a_survey_is_applied_and_recorded_by_run_and_inspect_alike() {
    let (folder, mesh) = scene();
    let coords = folder.path().join("coords.txt");
    std::fs::write(&coords, "WGS84 UTM 59S\n480000 4420000\n1 2 3\n").unwrap();
    let coords = coords.to_str().unwrap();
    std::fs::write(folder.path().join("bed.prj"), "EPSG:32759").unwrap();
    let out = folder.path().join("out");
    let said = run(&mesh, &out, &["--offset-file", coords]);
    assert_eq!(said.code, 0, "{}", said.err);
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
    let place = &report["facts"]["georeference"];
    assert_eq!((&place["crs"], &place["authority"]), (&"WGS 84 / UTM zone 59S".into(), &"EPSG:32759".into()));
    assert_eq!(place["offset_map_units"], serde_json::json!([480_000.0, 4_420_000.0, 0.0]));
    assert_eq!((&place["unit"], &place["metres_per_map_unit"]), (&"metre".into(), &1.0.into()));
    assert_eq!(place["vertical_shift_map_units"], 0.0);
    for (from, name) in [("crs_from", "coords.txt"), ("offset_from", "coords.txt (OpenDroneMap)")] {
        assert!(place[from].as_str().unwrap().contains(name), "{place}");
        assert!(said.err.contains(name), "{}", said.err);
    }
    let inspect = |more: &[&str]| {
        let mut args = vec!["inspect", mesh.to_str().unwrap(), "--offset-file", coords];
        args.extend(more);
        gravelometer(args)
    };
    let json: serde_json::Value = serde_json::from_str(&inspect(&["--json"]).out).unwrap();
    assert_eq!(&json["survey"]["georeference"], place);
    let text = inspect(&[]).out;
    for part in ["(EPSG:32759), from ", "480000, 4420000, 0 map units, from ", "metre (the CRS)", "note: the CRS is"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // What the side files say is part of what was run; how they are called is not.
    let again = |offset_file: &str| run(&mesh, &out, &["--offset-file", offset_file, "--resume"]);
    assert!(again(coords).err.contains("nothing is left to do"));
    let copy = folder.path().join("copy.txt");
    std::fs::copy(coords, &copy).unwrap();
    assert!(again(copy.to_str().unwrap()).err.contains("nothing is left to do"));
    std::fs::write(coords, "WGS84 UTM 59S\n480001 4420000\n").unwrap();
    again(coords).fails(2, &["input.offset was \"[480000.0, 4420000.0, 0.0]\"", "480001", "\nhelp: "]);
    std::fs::write(coords, "480000 4420000\n").unwrap();
    std::fs::write(folder.path().join("bed.prj"), "EPSG:32760").unwrap();
    again(coords).fails(2, &["input.crs was", "EPSG:32759", "EPSG:32760"]);
}

#[test]
fn a_folder_a_pattern_and_a_list_are_the_files_in_them() {
    let folder = tempfile::tempdir().unwrap();
    let blocks = folder.path().join("blocks");
    std::fs::create_dir(&blocks).unwrap();
    let mut second = bed(22, 40, 40);
    second.positions.iter_mut().for_each(|p| p.x += 5.0);
    write_ply(&blocks.join("b10.ply"), &second);
    write_ply(&blocks.join("b2.PLY"), &bed(21, 40, 40));
    std::fs::write(blocks.join("labelled_mesh.ply"), "of a run").unwrap();
    std::fs::write(blocks.join("notes.txt"), "mine").unwrap();
    let list = folder.path().join("list.txt");
    std::fs::write(&list, "# from south to north\nblocks/b10.ply\n\nblocks/b2.PLY\n").unwrap();
    let grains = |name: &str, inputs: &[&Path]| {
        let out = folder.path().join(name);
        let mut args: Vec<_> = inputs.iter().map(|path| path.as_os_str().to_owned()).collect();
        args.splice(0..0, ["run".into()]);
        args.extend(["-o".into(), out.as_os_str().to_owned()]);
        let said = gravelometer(args);
        assert_eq!(said.code, 0, "{name}: {}", said.err);
        (std::fs::read_to_string(out.join("grains.csv")).unwrap(), said.err)
    };
    let (named, _) = grains("named", &[&blocks.join("b10.ply"), &blocks.join("b2.PLY")]);
    assert!(named.lines().count() > 2, "{named}");
    let (of_folder, said) = grains("folder", &[&blocks]);
    assert_eq!(of_folder, named);
    assert!(said.contains("labelled_mesh.ply is left out"), "{said}");
    assert_eq!(grains("pattern", &[&blocks.join("b*.[pP][lL][yY]")]).0, named);
    assert_eq!(grains("list", &[Path::new(&format!("@{}", list.display()))]).0, named);
    let inspected = gravelometer(["inspect".as_ref(), blocks.as_os_str()]);
    assert!(inspected.out.contains("survey (2 files)") && inspected.out.contains("is left out"), "{}", inspected.out);
    gravelometer(["inspect".as_ref(), blocks.as_os_str(), blocks.join("b2.PLY").as_os_str()]).fails(1, &["twice"]);
}

/// Without a limit every one of the hundreds of tiles looks at the whole survey, so that the grain pass takes
/// minutes: the signal, sent when it begins, cannot come too late.
#[cfg(unix)]
#[test]
fn an_interrupted_run_ends_with_130_and_leaves_older_results_as_they_were() {
    use std::io::{BufRead, BufReader, Read};
    use std::process::{Command, Stdio};
    let folder = tempfile::tempdir().unwrap();
    let (mesh, out) = (folder.path().join("bed.ply"), folder.path().join("out"));
    write_ply(&mesh, &bed(22, 300, 200));
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("grains.csv"), "older").unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_gravelometer"))
        .args(["run", "--force", "--log", "json", "--max-grain", "0", "--tile-size", "0.01", "-o"])
        .args([&out, &mesh])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("\"grains\"") {
        line.clear();
        assert!(lines.read_line(&mut line).unwrap() > 0, "the run ended before its grain pass");
    }
    // The shell's own kill: a small system has no other.
    assert!(Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status().unwrap().success());
    let mut rest = String::new();
    lines.read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest}");
    assert!(rest.contains("interrupted") && !rest.contains("panicked"), "{rest}");
    assert_eq!(contents(&out), BTreeMap::from([(out.join("grains.csv"), b"older".to_vec())]));
}
