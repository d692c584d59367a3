//! Clouds of other software, held against laspy; damaged ones, against nothing but patience.

use super::las::{LasPoints, decode};
use super::las_crs::CloudCrs;
use super::mapped::MappedFile;
use super::progress::Progress;
use super::vertices::Vertices;
use super::{OpenError, Warning};
use crate::open::records::Source;
use las::point::{Classification, Format};
use las::{Builder, Color, Point, Vlr, Writer};
use proptest::prelude::*;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// The shared data's directory, or a printed reason to skip.
fn shared(below: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GRAVELOMETER_DATA")
        .map(PathBuf::from)
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"));
    let path = root.join(below);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there (set GRAVELOMETER_DATA)", path.display());
    None
}

fn read(path: &Path) -> Result<LasPoints, OpenError> {
    let source = MappedFile::open(path)?;
    let tell = |_, _| {};
    decode(&path.display().to_string(), &source, &Progress::new(source.len() as u64, &tell))
}

fn read_bytes(bytes: &[u8]) -> Result<LasPoints, OpenError> {
    let file = tempfile::NamedTempFile::new().expect("temporary file");
    std::fs::write(file.path(), bytes).expect("write");
    read(file.path())
}

/// File, points, bounds, colours, and points that are noise, withheld, either; by `tools/las_counts --rust`, which
/// asks laspy.
type Found = (&'static str, u64, ([f64; 3], [f64; 3]), &'static str, [u64; 3]);

#[rustfmt::skip]
const FOUND: [Found; 31] = [
    ("lasrs_32-1-472-150-76.laz", 5658, ([326400.01, 6724172.5200000005, -0.37], [327199.99, 6724199.99, 202.74]), "none", [30, 0, 30]),
    ("lasrs_autzen.copc.laz", 107, ([635729.26, 848971.3300000001, 408.14], [638864.3, 853480.01, 505.74]), "bytes", [0, 0, 0]),
    ("lasrs_autzen.las", 106, ([635616.31, 848977.79, 407.35], [638864.6, 853362.37, 536.84]), "none", [0, 0, 0]),
    ("lasrs_autzen.laz", 106, ([635616.31, 848977.79, 407.35], [638864.6, 853362.37, 536.84]), "none", [0, 0, 0]),
    ("lasrs_extrabytes.laz", 1065, ([635619.85, 848899.7000000001, 406.59000000000003], [638982.55, 853535.43, 586.38]), "bytes", [0, 0, 0]),
    ("loadersgl_ellipsoid-1.4.laz", 100000, ([-8242746.0, 4966506.0, -50.0], [-8242446.0, 4966706.0, 50.0]), "bytes", [32900, 0, 32900]),
    ("loadersgl_ellipsoid.copc.laz", 100000, ([-8242746.0, 4966506.0, -50.0], [-8242446.0, 4966706.0, 50.0]), "bytes", [32900, 0, 32900]),
    ("loadersgl_ellipsoid.laz", 100000, ([-8242746.0, 4966506.0, -50.0], [-8242446.0, 4966706.0, 50.0]), "bytes", [32900, 0, 32900]),
    ("loadersgl_extrabytes.laz", 1065, ([635619.85, 848899.7000000001, 406.59000000000003], [638982.55, 853535.43, 586.38]), "bytes", [0, 0, 0]),
    ("loadersgl_pdrf10-1.4.las", 1024, ([-2141890547.0, -2147415624.0, -2147101580.0], [2146619417.0, 2139249378.0, 2146599318.0]), "words", [7, 483, 490]),
    ("loadersgl_pdrf10-1.4.laz", 1024, ([-2141890547.0, -2147415624.0, -2147101580.0], [2146619417.0, 2139249378.0, 2146599318.0]), "words", [7, 483, 490]),
    ("loadersgl_pdrf10-1.5.las", 1024, ([-2141890547.0, -2147415624.0, -2147101580.0], [2146619417.0, 2139249378.0, 2146599318.0]), "words", [7, 483, 490]),
    // Not read by lazrs: the figures of the uncompressed twin.
    ("loadersgl_pdrf10-1.5.laz", 1024, ([-2141890547.0, -2147415624.0, -2147101580.0], [2146619417.0, 2139249378.0, 2146599318.0]), "words", [7, 483, 490]),
    ("loadersgl_pdrf4-1.3.las", 1024, ([-70.0, -22.53, -10.0], [103.91, 90.0, 12.08]), "none", [64, 0, 64]),
    ("loadersgl_pdrf4-1.3.laz", 1024, ([-70.0, -22.53, -10.0], [103.91, 90.0, 12.08]), "none", [64, 0, 64]),
    ("loadersgl_pdrf5-1.3.las", 1024, ([-70.0, -22.53, -10.0], [103.91, 90.0, 12.08]), "words", [64, 0, 64]),
    ("loadersgl_pdrf5-1.3.laz", 1024, ([-70.0, -22.53, -10.0], [103.91, 90.0, 12.08]), "words", [64, 0, 64]),
    ("loadersgl_pdrf6-1.4.las", 1024, ([-2141972467.0, -2147415560.0, -2147167116.0], [2131726195.0, 2139347682.0, 2146599318.0]), "none", [9, 494, 500]),
    ("loadersgl_pdrf6-1.4.laz", 1024, ([-2141972467.0, -2147415560.0, -2147167116.0], [2131726195.0, 2139347682.0, 2146599318.0]), "none", [9, 494, 500]),
    ("loadersgl_pdrf7-v4-1.4.las", 1024, ([-1500.01, 250.0, -350.04], [498.09000000000003, 1748.94, 449.38]), "words", [8, 512, 520]),
    // Not read by lazrs: the figures of the uncompressed twin.
    ("loadersgl_pdrf7-v4-1.4.laz", 1024, ([-1500.01, 250.0, -350.04], [498.09000000000003, 1748.94, 449.38]), "words", [8, 512, 520]),
    ("loadersgl_pdrf8-1.4.las", 1024, ([-2141890547.0, -2147415624.0, -2147101580.0], [2146619417.0, 2139249378.0, 2146599318.0]), "words", [7, 483, 490]),
    ("loadersgl_pdrf8-1.4.laz", 1024, ([-2141890547.0, -2147415624.0, -2147101580.0], [2146619417.0, 2139249378.0, 2146599318.0]), "words", [7, 483, 490]),
    ("loadersgl_pdrf9-1.4.las", 1024, ([-2141972467.0, -2147415560.0, -2147167116.0], [2131726195.0, 2139347682.0, 2146599318.0]), "none", [9, 494, 500]),
    ("loadersgl_pdrf9-1.4.laz", 1024, ([-2141972467.0, -2147415560.0, -2147167116.0], [2131726195.0, 2139347682.0, 2146599318.0]), "none", [9, 494, 500]),
    ("loadersgl_pdrf9-1.5.las", 1024, ([-2141972467.0, -2147415560.0, -2147167116.0], [2131726195.0, 2139347682.0, 2146599318.0]), "none", [9, 494, 500]),
    // Not read by lazrs: the figures of the uncompressed twin.
    ("loadersgl_pdrf9-1.5.laz", 1024, ([-2141972467.0, -2147415560.0, -2147167116.0], [2131726195.0, 2139347682.0, 2146599318.0]), "none", [9, 494, 500]),
    ("loadersgl_points-1.4.las", 3, ([0.0, 0.0, 0.0], [2.0, 1.0, 0.5]), "bytes", [0, 0, 0]),
    ("loadersgl_ripple.las", 10201, ([-5.0, -5.0, -0.6664100289344788], [5.0, 5.0, 1.100000023388559]), "bytes", [0, 0, 0]),
    ("otira_cloud_1.2_pf3.las", 100769, ([19.1717, 13.2124, -11.9399], [27.6065, 19.8165, -10.676]), "none", [0, 0, 0]),
    ("otira_cloud_1.4_pf7.laz", 100769, ([19.1717, 13.2124, -11.9399], [27.6065, 19.8165, -10.676]), "none", [0, 0, 0]),
];

fn kind_of_colors(points: &LasPoints) -> &'static str {
    let red = points.header.elements[0].properties.iter().find(|p| p.name == "red");
    match red.map(|p| p.kind.to_string()).as_deref() {
        None => "none",
        Some("uchar") => "bytes",
        Some("ushort") => "words",
        Some(other) => panic!("{other}"),
    }
}

#[test]
fn every_sample_has_the_points_that_laspy_finds() {
    let Some(directory) = shared("formats/las") else { return };
    let mut names: Vec<String> = directory
        .read_dir()
        .expect("directory")
        .map(|entry| entry.expect("entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let known: Vec<&str> = FOUND.iter().map(|f| f.0).filter(|name| !name.starts_with("otira")).collect();
    assert_eq!(names, known, "every file of the folder is held against laspy");
    for (name, count, bounds, colors, [noise, withheld, skipped]) in FOUND {
        let folder = if name.starts_with("otira") { "otira" } else { "formats/las" };
        let Some(folder) = shared(folder) else { return };
        let points = read(&folder.join(name)).unwrap_or_else(|e| panic!("{e}"));
        let element = &points.header.elements[0];
        println!("{name}: {}, {:?}", points.format, points.crs);
        assert_eq!((element.count, points.bounds), (count, bounds), "{name}");
        assert_eq!((points.noise, points.withheld), (noise, withheld), "{name}");
        assert_eq!(kind_of_colors(&points), colors, "{name}");
        assert_eq!(points.trailing_bytes, 0, "{name}");
        assert_eq!(check_records(&points), skipped, "{name}");
    }
}

/// The records read like those of a PLY file. Returns how many points are to be left out.
fn check_records(points: &LasPoints) -> u64 {
    let source = Source { path: "cloud", bytes: &points.bytes };
    let tell = |_, _| {};
    let progress = Progress::new(1, &tell);
    let element = &points.header.elements[0];
    let (mut vertices, end) = Vertices::locate(source, element, 0, &progress).expect("records");
    assert_eq!(end, points.bytes.len() as u64);
    assert_eq!(vertices.validate(source, &progress).expect("finite"), points.bounds);
    (0..element.count).filter(|&v| vertices.is_skipped(&points.bytes, v)).count() as u64
}

#[test]
fn twins_packed_and_not_packed_have_the_same_bits() {
    let Some(directory) = shared("formats/las") else { return };
    let otira = shared("otira").map(|d| (d.join("otira_cloud_1.2_pf3.las"), d.join("otira_cloud_1.4_pf7.laz")));
    let twins = [
        "pdrf10-1.4",
        "pdrf10-1.5",
        "pdrf4-1.3",
        "pdrf5-1.3",
        "pdrf6-1.4",
        "pdrf7-v4-1.4",
        "pdrf8-1.4",
        "pdrf9-1.4",
        "pdrf9-1.5",
    ];
    let twin = |name, kind| directory.join(format!("loadersgl_{name}.{kind}"));
    for (las, laz) in twins.iter().map(|name| (twin(name, "las"), twin(name, "laz"))).chain(otira) {
        let (one, other) = (read(&las).expect("las"), read(&laz).expect("laz"));
        assert!(one.bytes[..] == other.bytes[..], "{} and {}", las.display(), laz.display());
    }
}

/// A file made by the `las` crate: some noise, some withheld points, colours as `color` has them.
fn made(minor: u8, format: u8, points: u32, color: impl Fn(u32) -> u16, vlrs: Vec<Vlr>) -> Vec<u8> {
    let mut builder = Builder::from((1, minor));
    builder.point_format = Format::new(format).expect("format");
    builder.point_format.is_compressed = format & 0x80 != 0;
    builder.vlrs = vlrs;
    let header = builder.into_header().expect("header");
    let format = *header.point_format();
    let mut writer = Writer::new(Cursor::new(Vec::new()), header).expect("writer");
    for i in 0..points {
        let t = f64::from(i);
        writer
            .write_point(Point {
                x: (t * 0.1).sin() * 10.0,
                y: t * 0.01,
                z: -t,
                classification: Classification::new(
                    [2, 7, 1, 18][i as usize % 4] % if format.is_extended { 32 } else { 18 },
                )
                .expect("class"),
                is_withheld: i.is_multiple_of(5),
                return_number: 1,
                number_of_returns: 1,
                gps_time: format.has_gps_time.then_some(t),
                color: format.has_color.then(|| Color::new(color(i), 0, color(i + 1))),
                ..Point::default()
            })
            .expect("point");
    }
    writer.into_inner().expect("written").into_inner()
}

const LAZ_7: u8 = 0x80 | 7;
const LAZ_3: u8 = 0x80 | 3;

#[test]
fn colours_are_kept_as_narrow_as_they_are_even_where_the_first_points_mislead() {
    let last = |i: u32, value| if i < 99_990 { 0 } else { value };
    for format in [2, 3, LAZ_3, 7, LAZ_7] {
        let minor = if format & 0x7f == 7 { 4 } else { 2 };
        let kind = |color: &dyn Fn(u32) -> u16| {
            let points = read_bytes(&made(minor, format, 100_000, color, Vec::new())).unwrap_or_else(|e| panic!("{e}"));
            check_records(&points);
            let red = points.header.elements[0].properties.iter().find(|p| p.name == "red");
            let of_last = red.map(|p| {
                let record = points.bytes.len() / 100_000;
                let at = points.bytes.len() - record + 24;
                if p.kind.to_string() == "uchar" {
                    u16::from(points.bytes[at])
                } else {
                    u16::from_le_bytes([points.bytes[at], points.bytes[at + 1]])
                }
            });
            let zero = points.warnings.iter().any(|w| matches!(w, Warning::ColorsAllZero { .. }));
            (kind_of_colors(&points), of_last, zero)
        };
        assert_eq!(kind(&|_| 0), ("none", None, true));
        assert_eq!(kind(&|i| (i % 256) as u16), ("bytes", Some((99_999 % 256) as u16), false));
        assert_eq!(kind(&|i| last(i, 200)), ("bytes", Some(200), false));
        assert_eq!(kind(&|i| last(i, 200 * 256)), ("bytes", Some(200), false));
        assert_eq!(kind(&|i| last(i, 200 * 257)), ("bytes", Some(200), false));
        assert_eq!(kind(&|i| last(i, 300)), ("words", Some(300), false));
        assert_eq!(kind(&|i| if i == 99_000 { 300 } else { 256 }), ("words", Some(256), false));
    }
}

#[test]
fn noise_and_withheld_points_are_marked() {
    for (minor, format, classes) in [(2, 1, [7, 0]), (4, 6, [7, 18]), (4, LAZ_7, [7, 18])] {
        let points = read_bytes(&made(minor, format, 1000, |_| 9, Vec::new())).unwrap_or_else(|e| panic!("{e}"));
        let noise = |i: &usize| {
            classes.contains(&([2, 7, 1, if minor == 4 { 18 } else { 0 }][i % 4])) && classes[i % 4 / 2] != 0
        };
        let withheld = |i: &usize| i.is_multiple_of(5);
        let count = |of: &dyn Fn(&usize) -> bool| (0..1000).filter(of).count() as u64;
        assert_eq!(points.noise, count(&noise), "{}", points.format);
        assert_eq!(points.withheld, 200);
        assert_eq!(check_records(&points), count(&|i| noise(i) || withheld(i)));
        check_records(&points);
    }
}

#[test]
fn bounds_come_from_the_points_and_not_from_the_header() {
    let mut bytes = made(2, 1, 1000, |_| 0, Vec::new());
    let right = read_bytes(&bytes).expect("read");
    bytes[179..187].copy_from_slice(&1e30f64.to_le_bytes());
    let wrong = read_bytes(&bytes).expect("read");
    assert_eq!(wrong.bounds, right.bounds);
}

fn projection(record_id: u16, data: Vec<u8>) -> Vlr {
    Vlr { user_id: "LASF_Projection".to_owned(), record_id, data, ..Vlr::default() }
}

fn keys(entries: &[[u16; 4]]) -> Vlr {
    let head = [1, 1, 0, entries.len() as u16];
    projection(34735, head.iter().chain(entries.as_flattened()).flat_map(|n| n.to_le_bytes()).collect())
}

#[test]
fn the_crs_is_what_the_file_states() {
    let crs = |vlrs| read_bytes(&made(2, 1, 3, |_| 0, vlrs)).unwrap_or_else(|e| panic!("{e}")).crs;
    let stated =
        |definition: &str, height_unit_m| CloudCrs::Stated { definition: definition.to_owned(), height_unit_m };
    assert_eq!(crs(Vec::new()), CloudCrs::Unstated);
    assert_eq!(crs(vec![keys(&[[1024, 0, 1, 1], [3072, 0, 1, 2193]])]), stated("EPSG:2193", None));
    assert_eq!(crs(vec![keys(&[[3072, 0, 1, 2193], [4099, 0, 1, 9003]])]), stated("EPSG:2193", Some(1200.0 / 3937.0)));
    assert_eq!(crs(vec![keys(&[[2048, 0, 1, 4326]])]), stated("EPSG:4326", None));
    let wkt = || projection(2112, b"LOCAL_CS[\"bed\"]\0\0".to_vec());
    assert_eq!(crs(vec![wkt()]), stated("LOCAL_CS[\"bed\"]", None));
    // Without the bit that says WKT, keys come first.
    assert_eq!(crs(vec![wkt(), keys(&[[3072, 0, 1, 2193]])]), stated("EPSG:2193", None));
    let own = [keys(&[[3072, 0, 1, 32767], [3073, 34737, 9, 0]]), projection(34737, b"Our grid|".to_vec())];
    match crs(own.to_vec()) {
        CloudCrs::Unusable { reason } => assert!(reason.contains("Our grid"), "{reason}"),
        other => panic!("{other:?}"),
    }
    let broken = [keys(&[[3072, 34737, 900, 7]]), projection(34737, b"short".to_vec())];
    assert!(matches!(crs(broken.to_vec()), CloudCrs::Unusable { .. }));
}

/// Bytes of address space this process ever had; 0 where the system does not tell.
fn most_memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmPeak:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) << 10
}

/// The error that a file must give, checked to name the file and a remedy.
fn refusal(bytes: &[u8]) -> String {
    let before = most_memory_bytes();
    let message = read_bytes(bytes).expect_err("must be refused").to_string();
    // Threads of other tests are in the same process: hence some room.
    assert!(most_memory_bytes() - before < 2 << 30, "{message}");
    assert!(message.contains("\nhelp: ") && message.starts_with('/'), "{message}");
    assert!(message.chars().all(|c| !c.is_control() || c == '\n'), "{message}");
    message
}

#[test]
fn what_a_header_declares_is_not_believed() {
    let las = made(2, 3, 200, |_| 9, vec![keys(&[[3072, 0, 1, 2193]])]);
    let laz = made(4, LAZ_7, 60_000, |i| (i % 7) as u16, Vec::new());
    let with = |bytes: &[u8], changes: &[(usize, &[u8])]| {
        let mut bytes = bytes.to_vec();
        for (at, new) in changes {
            bytes[*at..at + new.len()].copy_from_slice(new);
        }
        refusal(&bytes)
    };
    let points_at = u32::from_le_bytes([laz[96], laz[97], laz[98], laz[99]]) as usize;
    let table_at = u64::from_le_bytes(laz[points_at..points_at + 8].try_into().expect("eight")) as usize;
    let most = u64::MAX.to_le_bytes();
    let cases: [(String, &[&str]); 17] = [
        (with(&las, &[(0, b"LASX")]), &["not a LAS file", "`LASX`"]),
        (with(&las, &[(25, &[6])]), &["version 1.6", "1.0 to 1.5"]),
        (with(&las, &[(24, &[2])]), &["version 2.2"]),
        (with(&las, &[(104, &[11])]), &["points of format 11"]),
        (with(&las, &[(94, &[20, 0])]), &["20 bytes"]),
        (with(&las, &[(96, &[255; 4])]), &["start at byte 4294967295"]),
        (with(&las, &[(100, &[255; 4])]), &["record 1 of 4294967295"]),
        (with(&las, &[(105, &[10, 0])]), &["its points have 10 bytes, but those of format 3 have 34"]),
        (with(&las, &[(107, &[255; 4])]), &["declares 4294967295 points", "holds 200"]),
        (with(&las, &[(107, &[100, 0, 0, 0])]), &["declares 100 points", "holds 200"]),
        (with(&las, &[(131, &0f64.to_le_bytes())]), &["along x", "scale 0e0"]),
        (with(&las, &[(147, &f64::INFINITY.to_le_bytes())]), &["along z", "scale inf"]),
        (with(&las, &[(155, &1e20f64.to_le_bytes())]), &["along x", "offset 1e20"]),
        (with(&las, &[(155, &f64::NAN.to_le_bytes())]), &["along x", "offset NaN"]),
        // 1.4: an extended record of any length, anywhere.
        (
            with(&laz, &[(235, &(laz.len() as u64 - 10).to_le_bytes()), (243, &[1])]),
            &["extended record 0 of 1 at byte"],
        ),
        (with(&laz, &[(247, &most), (107, &[0; 4])]), &["declares 18446744073709551615 points"]),
        (with(&laz, &[(table_at + 4, &[255; 4])]), &["declares 4294967295 chunks"]),
    ];
    for (message, parts) in cases {
        parts.iter().for_each(|part| assert!(message.contains(part), "`{part}` is not in: {message}"));
    }
    // A layer of four billion bytes, behind the first point and the count.
    let layer = with(&laz, &[(points_at + 8 + 36 + 4, &[255; 4])]);
    assert!(layer.contains("points 0 to 49999") && layer.contains("layers need"), "{layer}");
    let count = with(&laz, &[(points_at + 8 + 36, &[255; 4])]);
    assert!(count.contains("holds 4294967295 points, but must hold 50000"), "{count}");
    assert!(refusal(&las[..las.len() - 1]).contains("declares 200 points, but the file"));
    assert!(refusal(&laz[..laz.len() - 9]).contains("cannot be unpacked"));
    assert!(refusal(&made(2, 1, 0, |_| 0, Vec::new())).contains("has 0 vertices"));
}

/// Small files of each kind, and of other software where the shared data are there.
fn victims() -> Vec<Vec<u8>> {
    let mut all = vec![
        made(2, 3, 300, |i| i as u16, vec![keys(&[[3072, 0, 1, 2193], [4099, 0, 1, 9001]])]),
        made(2, LAZ_3, 300, |i| i as u16, vec![projection(2112, b"LOCAL_CS[\"bed\"]".to_vec())]),
        made(4, LAZ_7, 300, |i| i as u16, Vec::new()),
    ];
    if let Some(folder) = shared("formats/las") {
        let names = [
            "lasrs_autzen.copc.laz",
            "lasrs_autzen.laz",
            "loadersgl_pdrf7-v4-1.4.laz",
            "loadersgl_pdrf5-1.3.laz",
            "loadersgl_pdrf10-1.5.laz",
            "lasrs_extrabytes.laz",
            "loadersgl_points-1.4.las",
        ];
        all.extend(names.map(|name| std::fs::read(folder.join(name)).expect("sample")));
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_and_cut_ends_never_panic(
        which in any::<prop::sample::Index>(),
        within_head in any::<bool>(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        static VICTIMS: std::sync::LazyLock<Vec<Vec<u8>>> = std::sync::LazyLock::new(victims);
        let mut bytes = which.get(&VICTIMS).clone();
        for (at, value) in flips {
            let end = if within_head { bytes.len().min(500) } else { bytes.len() };
            bytes[at.index(end)] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()).max(1));
        }
        let (before, start) = (most_memory_bytes(), std::time::Instant::now());
        match read_bytes(&bytes) {
            Ok(points) => assert!(check_records(&points) <= points.header.elements[0].count),
            Err(error) => assert!(error.to_string().contains("\nhelp: "), "{error}"),
        }
        prop_assert!(most_memory_bytes() - before < 2 << 30);
        prop_assert!(start.elapsed().as_secs() < 20);
    }
}
