//! Clouds of other software, held against laspy; damaged ones, against nothing but patience.

use super::las::{LasPoints, decode};
use super::las_crs::CloudCrs;
use super::mapped::MappedFile;
use super::progress::Progress;
use super::scalar::Scalar;
use super::vertices::Vertices;
use super::{OpenError, Warning};
use crate::open::records::Source;
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
        assert_eq!((points.noise, points.withheld, points.skipped), (noise, withheld, skipped), "{name}");
        assert_eq!(kind_of_colors(&points), colors, "{name}");
        assert_eq!(points.trailing_bytes, 0, "{name}");
        check_records(&points);
    }
}

/// The records read like those of a PLY file, and add up to what was said of them.
fn check_records(points: &LasPoints) {
    let source = Source { path: "cloud", bytes: &points.bytes };
    let tell = |_, _| {};
    let progress = Progress::new(1, &tell);
    let element = &points.header.elements[0];
    let (mut vertices, end) = Vertices::locate(source, element, 0, &progress).expect("records");
    assert_eq!(end, points.bytes.len() as u64);
    assert_eq!(vertices.validate(source, &progress).expect("finite"), points.bounds);
    let skipped = vertices.scalars.iter().find(|s| s.name == "skipped").expect("skipped");
    let flags = (0..element.count).map(|v| u64::from(vertices.record(&points.bytes, v)[skipped.offset]));
    assert_eq!(flags.sum::<u64>(), points.skipped);
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
