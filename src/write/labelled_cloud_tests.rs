//! Labelled clouds are read back by the `las` crate and by the program's own reader.

use super::atomic::Pending;
use super::labelled_cloud::{LabelledCloud, write_las, write_vertices};
use super::laz_stream::EXTRA_BYTES_RECORD;
use crate::open::{COPC_USER, LASZIP_RECORD, LasInput, Reach};
use crate::settings::InputSettings;
use las::point::{Classification, Format};
use las::{Builder, Color, Point, Reader, Transform, Vector, Vlr, Writer};
use laz::DecompressionSelection;
use std::path::{Path, PathBuf};

/// A grain for most points.
fn label(point: u64) -> i32 {
    if point.is_multiple_of(7) { -1 } else { (point * 2_654_435_761 % 1_000_003) as i32 }
}

fn labelled(folder: &Path, input: &Path) -> (PathBuf, LabelledCloud) {
    let file = Pending { partial: folder.join("cloud.partial"), target: folder.join("cloud.laz") };
    let written = write_las(&file, input, &label).unwrap_or_else(|e| panic!("{e}"));
    std::fs::rename(&file.partial, &file.target).expect("rename");
    (file.target.clone(), written)
}

/// All records of a file, one behind the other, and the bytes of one.
fn records(path: &Path) -> (Vec<u8>, usize) {
    let input = LasInput::open(path).expect("open");
    let file = input.parse().expect("parse");
    let mut all = Vec::new();
    for chunk in &file.chunks {
        let take = |_, slab: &[u8]| -> Result<(), crate::open::OpenError> {
            all.extend_from_slice(slab);
            Ok(())
        };
        file.each_slab(chunk, DecompressionSelection::all(), take).expect("points");
    }
    (all, file.record_bytes())
}

/// Holds the output against its input, field by field.
fn compare(input: &Path) {
    let folder = tempfile::tempdir().expect("folder");
    let (output, written) = labelled(folder.path(), input);
    let ((before, short), (after, long)) = (records(input), records(&output));
    assert_eq!(long, short + 4);
    assert_eq!(before.len() / short, after.len() / long);
    for (point, (old, new)) in before.chunks(short).zip(after.chunks(long)).enumerate() {
        assert_eq!(&new[..short], old, "{}: point {point}", input.display());
        assert_eq!(new[short..], label(point as u64).to_le_bytes());
    }
    let points = written.points;
    assert_eq!(points, (before.len() / short) as u64);
    assert_eq!(written.in_grains, points - points.div_ceil(7));
    compare_records(input, &output);
    // The crate knows no version 1.5.
    if std::fs::read(input).expect("read")[25] == 4 {
        compare_by_crate(input, &output);
    }
}

/// Records of variable length are those of the input, but for those that speak of what has changed.
fn compare_records(input: &Path, output: &Path) {
    let (input, output) = (LasInput::open(input).expect("open"), LasInput::open(output).expect("open"));
    let (before, after) = (input.parse().expect("input"), output.parse().expect("output"));
    assert_eq!((before.minor, before.number), (after.minor, after.number));
    assert_eq!(before.header.global_encoding, after.header.global_encoding);
    assert_eq!(before.transforms(), after.transforms());
    assert_eq!(before.crs(), after.crs());
    for (old, new) in [(&before.records, &after.records), (&before.extended, &after.extended)] {
        let kept = |r: &&crate::open::VariableRecord<'_>| {
            !r.is(EXTRA_BYTES_RECORD) && !r.is(LASZIP_RECORD) && !r.is_of(COPC_USER)
        };
        let wholes = |of: &[crate::open::VariableRecord<'_>]| -> Vec<Vec<u8>> {
            of.iter().filter(kept).map(|r| r.whole.to_vec()).collect()
        };
        assert_eq!(wholes(old), wholes(new));
    }
    let described = after.records.iter().find(|r| r.is(EXTRA_BYTES_RECORD)).expect("described").data;
    assert!(described[described.len() - 192..][4..].starts_with(b"grain_id\0"));
    let old = before.records.iter().find(|r| r.is(EXTRA_BYTES_RECORD)).map_or(&[][..], |r| r.data);
    assert!(described.starts_with(old));
}

fn compare_by_crate(input: &Path, output: &Path) {
    let (mut before, mut after) =
        (Reader::from_path(input).expect("input"), Reader::from_path(output).expect("output"));
    let (old, new) = (before.read_all().expect("input"), after.read_all().expect("output"));
    let mut by_return = [0u64; 16];
    for (old, new) in old.points().zip(new.points()) {
        let (old, mut new) = (old.expect("point"), new.expect("point"));
        by_return[usize::from(new.return_number)] += 1;
        new.extra_bytes.truncate(old.extra_bytes.len());
        assert_eq!(format!("{old:?}"), format!("{new:?}"), "NaN of waveforms is equal here");
    }
    let header = after.header();
    assert_eq!(header.number_of_points(), old.len() as u64);
    for (number, &count) in by_return.iter().enumerate().skip(1) {
        assert_eq!(header.number_of_points_by_return(number as u8).unwrap_or(0), count);
    }
    let (min, max) = (header.bounds().min, header.bounds().max);
    assert_eq!((min.x, max.x), (old.x().fold(f64::INFINITY, f64::min), old.x().fold(f64::NEG_INFINITY, f64::max)));
    assert_eq!((min.z, max.z), (old.z().fold(f64::INFINITY, f64::min), old.z().fold(f64::NEG_INFINITY, f64::max)));
}

/// A file of this version and format, with a bit of everything.
fn made(folder: &Path, name: &str, minor: u8, format: u8, points: u32) -> PathBuf {
    let mut builder = Builder::from((1, minor));
    builder.point_format = Format::new(format).expect("format");
    builder.point_format.extra_bytes = 3;
    let axis = |offset| Transform { scale: 0.001, offset };
    builder.transforms = Vector { x: axis(500_000.0), y: axis(5_000_000.0), z: axis(0.0) };
    builder.vlrs.push(Vlr { user_id: "somebody".to_owned(), record_id: 9, data: vec![1, 2, 3], ..Vlr::default() });
    if minor == 4 {
        builder.evlrs.push(Vlr { user_id: "behind".to_owned(), record_id: 8, data: vec![7; 70_000], ..Vlr::default() });
    }
    let path = folder.join(name);
    let header = builder.into_header().expect("header");
    let format = *header.point_format();
    let mut writer = Writer::from_path(&path, header).expect("writer");
    for i in 0..points {
        let (n, t) = (i as u16, f64::from(i) * 0.01);
        let point = Point {
            x: 500_000.0 + t.cos() * 20.0,
            y: 5_000_000.0 + t.sin() * 20.0,
            z: t * 0.01,
            intensity: n,
            return_number: (i % 3) as u8 + 1,
            number_of_returns: 3,
            classification: Classification::new((i % 7) as u8).expect("class"),
            is_withheld: i % 11 == 0,
            gps_time: format.has_gps_time.then_some(t),
            color: format.has_color.then(|| Color::new(n % 300, n, 0)),
            extra_bytes: vec![i as u8, 5, 6],
            ..Point::default()
        };
        writer.write_point(point).expect("point");
    }
    writer.close().expect("close");
    path
}

#[test]
fn everything_of_a_point_is_kept_and_its_grain_comes_behind() {
    let folder = tempfile::tempdir().expect("folder");
    for (name, minor, format, points) in [
        ("a.las", 2, 3, 1000),
        ("b.laz", 2, 1, 1000),
        ("c.laz", 4, 7, 120_001),
        ("d.las", 4, 6, 1),
        ("e.las", 0, 0, 50),
    ] {
        compare(&made(folder.path(), name, minor, format, points));
    }
}

#[test]
fn every_sample_of_other_software_is_kept_whole() {
    let root = std::env::var_os("GRAVELOMETER_DATA").map(PathBuf::from);
    let root = root.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"));
    let Ok(files) = root.join("formats/las").read_dir() else {
        eprintln!("skipped: {} is not there (set GRAVELOMETER_DATA)", root.display());
        return;
    };
    let files: Vec<PathBuf> = files.map(|entry| entry.expect("entry").path()).collect();
    assert!(files.len() > 25);
    files.iter().for_each(|file| compare(file));
}

#[test]
fn a_cloud_labelled_twice_keeps_the_first_label_under_another_name() {
    let folder = tempfile::tempdir().expect("folder");
    let (once, _) = labelled(folder.path(), &made(folder.path(), "a.laz", 4, 7, 500));
    let again = folder.path().join("again");
    std::fs::create_dir(&again).expect("folder");
    let (twice, _) = labelled(&again, &once);
    let input = LasInput::open(&twice).expect("open");
    let file = input.parse().expect("parse");
    let described = file.records.iter().find(|r| r.is(EXTRA_BYTES_RECORD)).expect("described").data;
    let names: Vec<&[u8]> = described.chunks(192).map(|d| d[4..36].split(|&b| b == 0).next().unwrap_or(d)).collect();
    assert_eq!(names, [&b"undocumented"[..], b"input_grain_id", b"grain_id"]);
    let (all, bytes) = records(&twice);
    for (point, record) in all.chunks(bytes).enumerate() {
        assert_eq!(record[bytes - 8..bytes - 4], record[bytes - 4..]);
        assert_eq!(record[bytes - 4..], label(point as u64).to_le_bytes());
    }
}

#[test]
fn threads_change_no_byte() {
    let folder = tempfile::tempdir().expect("folder");
    let input = made(folder.path(), "a.laz", 4, 7, 160_000);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        std::fs::read(pool.install(|| labelled(folder.path(), &input)).0).expect("read")
    };
    assert!(with(1) == with(3));
}

#[test]
fn vertices_of_a_mesh_become_points_on_the_map() {
    let folder = tempfile::tempdir().expect("folder");
    let input = folder.path().join("mesh.ply");
    let places = [[0.0, 0.0, 0.1], [1.0, 0.0, 0.2], [0.0, 1.000_004, 0.3]];
    let mut text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
                    property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
                    property list uchar int vertex_indices\nend_header\n"
        .to_owned();
    for [x, y, z] in places {
        text += &format!("{x} {y} {z} 255 128 0\n");
    }
    std::fs::write(&input, text + "3 0 1 2\n").expect("write");
    let settings =
        InputSettings { crs: "EPSG:2193".to_owned(), offset: [1.5e6, 5.2e6, 0.0], ..InputSettings::default() };
    let (reach, _) = Reach::open(&[input], &settings, &|_, _| {}).unwrap_or_else(|e| panic!("{e}"));
    let file = Pending { partial: folder.path().join("c.partial"), target: folder.path().join("c.laz") };
    let written = write_vertices(&file, &reach, 0..3, &|v| v as i32 - 1).expect("write");
    assert_eq!(written, LabelledCloud { points: 3, in_grains: 2, scale: [1e-5; 3] });
    let mut reader = Reader::new(std::io::Cursor::new(std::fs::read(&file.partial).expect("read"))).expect("reader");
    let wkt = String::from_utf8_lossy(reader.header().get_wkt_crs_bytes().expect("wkt")).into_owned();
    assert!(reader.header().has_wkt_crs() && wkt.contains("\"2193\""), "{wkt}");
    let points = reader.read_all().expect("points");
    for (i, point) in points.points().enumerate() {
        let point = point.expect("point");
        let [x, y, z] = places[i];
        for (found, expected) in [(point.x, x + 1.5e6), (point.y, y + 5.2e6), (point.z, z)] {
            assert!((found - expected).abs() <= 0.5e-5 + 1e-9, "{found} {expected}");
        }
        assert_eq!(point.color, Some(Color::new(65_535, 128 * 257, 0)));
        assert_eq!(point.extra_bytes, (i as i32 - 1).to_le_bytes());
        assert_eq!((point.return_number, point.number_of_returns), (1, 1));
    }
}
