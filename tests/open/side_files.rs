//! What lies beside a survey: offset files and `.prj` files, and who wins where several name the system.

use crate::assert_contains;
use crate::ply_bytes::{faces, file, vertices};
use gravelometer::open::{CrsCandidate, CrsSource, OpenError, Reach, Warning, resolve_crs};
use gravelometer::settings::{InputSettings, Unit};
use std::path::{Path, PathBuf};

/// As Esri's software writes EPSG:2193, whose EPSG definition has northings first.
const NZTM: &str = r#"PROJCS["NZGD_2000_New_Zealand_Transverse_Mercator",GEOGCS["GCS_NZGD_2000",DATUM["D_NZGD_2000",SPHEROID["GRS_1980",6378137.0,298.257222101]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",1600000.0],PARAMETER["False_Northing",10000000.0],PARAMETER["Central_Meridian",173.0],PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]]"#;
/// As Pix4D and many others write EPSG:32633.
const UTM_33: &str = r#"PROJCS["WGS 84 / UTM zone 33N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]],PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",15],PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1,AUTHORITY["EPSG","9001"]],AUTHORITY["EPSG","32633"]]"#;

/// A folder with some files: the endings say which are surveys, the others hold the texts.
struct Site(tempfile::TempDir);

impl Site {
    fn new(files: &[(&str, &str)]) -> Site {
        let folder = tempfile::tempdir().expect("temporary directory");
        for (name, text) in files {
            let bytes = if name.ends_with(".ply") { file(&[&vertices(), &faces()]) } else { text.as_bytes().to_vec() };
            std::fs::write(folder.path().join(name), bytes).expect("write");
        }
        Site(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn input(&self, offset_file: &str, crs: &str) -> InputSettings {
        let path = |name: &str| self.path(name).to_str().expect("UTF-8").to_owned();
        let offset_file = if offset_file.is_empty() { String::new() } else { path(offset_file) };
        InputSettings { crs: crs.to_owned(), offset_file, ..InputSettings::default() }
    }

    fn open(&self, names: &[&str], input: &InputSettings) -> Result<(Reach, Vec<Warning>), OpenError> {
        let paths: Vec<_> = names.iter().map(|name| self.path(name)).collect();
        Reach::open(&paths, input, &|_, _| {})
    }

    fn opened(&self, offset_file: &str, crs: &str) -> Reach {
        self.open(&["reach.ply"], &self.input(offset_file, crs)).unwrap_or_else(|e| panic!("{e}")).0
    }

    fn refused(&self, offset_file: &str, crs: &str) -> String {
        refusal(self.open(&["reach.ply"], &self.input(offset_file, crs)))
    }
}

fn refusal(opened: Result<(Reach, Vec<Warning>), OpenError>) -> String {
    let error = opened.expect_err("must be refused");
    assert!(error.is_about_settings(), "{error}");
    let message = error.to_string();
    assert_contains(&message, &["\nhelp: "]);
    message
}

#[test]
fn an_offset_file_gives_offset_and_system_whatever_its_name() {
    let odm = "WGS84 UTM 33S\n480000.5 4420000.25\n1.5 2.5 130.125\n3.5 4.5 131\n";
    for (text, offset, code) in [
        (odm, [480_000.5, 4_420_000.25, 0.0], Some("EPSG:32733")),
        ("EPSG:32633 500000 4600000 100\n", [5e5, 46e5, 100.0], Some("EPSG:32633")),
        ("32633 500000 4600000 100", [5e5, 46e5, 100.0], Some("EPSG:32633")),
        ("500000.000 4600000.000 100.000\n", [5e5, 46e5, 100.0], None),
        ("500000\n4600000\n", [5e5, 46e5, 0.0], None),
    ] {
        let site = Site::new(&[("reach.ply", ""), ("anything.dat", text)]);
        let reach = site.opened("anything.dat", "");
        assert_eq!(reach.frame().offset_map, offset, "{text}");
        assert_eq!(reach.frame().crs.as_ref().and_then(|c| c.authority.as_deref()), code, "{text}");
        let place = reach.georeference();
        assert_eq!((place.offset_map_units, place.authority.as_deref()), (offset, code));
        assert_contains(place.offset_from.as_ref().expect("a source"), &["anything.dat"]);
        assert_eq!(place.crs_from.as_ref().is_some_and(|from| from.contains("anything.dat")), code.is_some());
        assert!(place.notes.iter().any(|note| note.contains("the offset is ")), "{:?}", place.notes);
    }
}

#[test]
fn an_offset_file_that_is_none_is_refused_with_line_and_example() {
    let site = Site::new(&[("reach.ply", ""), ("coords.txt", "WGS84 UTM 33N\nfar away\n")]);
    let message = site.refused("coords.txt", "");
    assert_contains(&message, &["coords.txt: line 2: `far` is no number", "EAST NORTH", "480000 4420000"]);
    assert_contains(&site.refused("nowhere.txt", ""), &["--offset-file ", "nowhere.txt: cannot be read"]);
    assert_contains(&site.refused("reach.ply", ""), &["reach.ply: line 1"]);
}

#[test]
fn an_offset_and_an_offset_file_are_one_too_many() {
    let site = Site::new(&[("reach.ply", ""), ("offset.txt", "1 2 3")]);
    let input = InputSettings { offset: [7.0, 8.0, 9.0], ..site.input("offset.txt", "") };
    let message = refusal(site.open(&["reach.ply"], &input));
    assert_contains(&message, &["[7.0, 8.0, 9.0]", "offset.txt", "only one of them"]);
}

#[test]
fn a_system_in_the_offset_file_that_contradicts_the_flag_is_refused_with_both() {
    let site = Site::new(&[("reach.ply", ""), ("coords.txt", "WGS84 UTM 33N\n1 2\n")]);
    let message = site.refused("coords.txt", "EPSG:32634");
    assert_contains(&message, &["--crs says", "EPSG:32634", "coords.txt says", "EPSG:32633", "leave out --crs"]);
    assert_eq!(site.opened("coords.txt", UTM_33).georeference().crs_from.as_deref(), Some("--crs"));
}

#[test]
fn the_system_of_pix4d_lies_beside_its_offset() {
    let site =
        Site::new(&[("reach.ply", ""), ("site_offset.xyz", "500000.0,4600000.0,100.0"), ("site_wkt.prj", UTM_33)]);
    let place = site.opened("site_offset.xyz", "").georeference().clone();
    assert_eq!(place.authority.as_deref(), Some("EPSG:32633"));
    assert_contains(place.crs_from.as_ref().expect("a source"), &["site_wkt.prj"]);
    assert_eq!(place.vertical_shift_map_units, 100.0);
    let place = site.opened("site_offset.xyz", "EPSG:25833").georeference().clone();
    assert_eq!(place.authority.as_deref(), Some("EPSG:25833"));
    assert!(place.notes.iter().any(|n| n.contains("EPSG:25833") && n.contains("site_wkt.prj")), "{:?}", place.notes);
}

#[test]
fn a_prj_file_beside_the_survey_is_taken_where_nothing_else_names_a_system() {
    for name in ["reach.prj", "reach_wkt.prj", "reach.PRJ"] {
        let site = Site::new(&[("reach.ply", ""), (name, UTM_33), ("other.prj", NZTM)]);
        let place = site.opened("", "").georeference().clone();
        assert_eq!(place.authority.as_deref(), Some("EPSG:32633"), "{name}");
        assert_contains(place.crs_from.as_ref().expect("a source"), &[name]);
    }
    let site = Site::new(&[("reach.ply", ""), ("reach.prj", UTM_33), ("shift.txt", "EPSG:32634 1 2 3")]);
    let message = site.refused("shift.txt", "");
    assert_contains(&message, &["shift.txt says", "EPSG:32634", "reach.prj says", "EPSG:32633"]);
}

#[test]
fn a_prj_file_that_is_none_is_told_and_one_in_degrees_is_refused() {
    let site = Site::new(&[("reach.ply", ""), ("reach.prj", "some program's project")]);
    let place = site.opened("", "").georeference().clone();
    assert_eq!(place.crs, None);
    assert!(place.notes.iter().any(|n| n.contains("reach.prj") && n.contains("ignored")), "{:?}", place.notes);
    let degrees = r#"GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]"#;
    let site = Site::new(&[("reach.ply", ""), ("reach.prj", degrees)]);
    assert_contains(&site.refused("", ""), &["reach.prj: ", "geographic (degrees)", "--crs"]);
    assert_eq!(site.opened("", "EPSG:2193").georeference().authority.as_deref(), Some("EPSG:2193"));
}

#[test]
fn prj_files_of_several_surveys_must_be_one_system_but_not_one_text() {
    let names = ["a.ply", "b.ply", "c.ply"];
    let site = Site::new(&[("a.ply", ""), ("b.ply", ""), ("c.ply", ""), ("a.prj", NZTM), ("c.prj", "EPSG:2193")]);
    let (reach, _) = site.open(&names, &InputSettings::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_contains(reach.georeference().crs_from.as_ref().expect("a source"), &["a.prj"]);
    std::fs::write(site.path("c.prj"), UTM_33).expect("write");
    let message = refusal(site.open(&names, &InputSettings::default()));
    assert_contains(&message, &["a.prj says", "New Zealand", "c.prj says", "EPSG:32633", "--crs"]);
}

fn candidate(source: CrsSource, text: &str) -> CrsCandidate {
    CrsCandidate { source, text: text.to_owned() }
}

#[test]
fn headers_come_last_must_agree_with_the_others_and_yield_to_the_flag() {
    let header = |text| candidate(CrsSource::Header("cloud.laz".into()), text);
    let beside = |text| candidate(CrsSource::Beside("cloud.prj".into()), text);
    let flag = |text| candidate(CrsSource::Setting, text);
    let resolved = |candidates: &[CrsCandidate]| {
        let (named, notes) = resolve_crs(candidates).unwrap_or_else(|e| panic!("{e}"));
        (named.and_then(|n| n.reference.crs.authority), notes)
    };
    let (code, notes) = resolved(&[flag(""), header(UTM_33)]);
    assert_eq!(code.as_deref(), Some("EPSG:32633"));
    assert_contains(&notes.join("\n"), &["from the header of cloud.laz"]);
    assert_eq!(resolved(&[flag(""), beside("EPSG:2193"), header(NZTM)]).0.as_deref(), Some("EPSG:2193"));
    assert_eq!(resolved(&[flag("")]), (None, Vec::new()));
    // Heights contradict only where both sides name theirs.
    assert_eq!(resolved(&[beside("EPSG:32633"), header("EPSG:32633+5773")]).0.as_deref(), Some("EPSG:32633"));
    assert!(resolve_crs(&[beside("EPSG:32633+5703"), header("EPSG:32633+5773")]).is_err());
    let message = resolve_crs(&[beside("EPSG:32633"), header("EPSG:32634")]).expect_err("two zones").to_string();
    assert_contains(&message, &["cloud.prj says", "zone 33N", "the header of cloud.laz says", "zone 34N"]);
    let (code, notes) = resolved(&[flag("EPSG:25833"), beside("EPSG:32633"), header("EPSG:4326")]);
    assert_eq!((code.as_deref(), notes.len()), (Some("EPSG:25833"), 2), "{notes:?}");
}

#[test]
fn feet_are_told_and_us_survey_feet_are_exact() {
    let site = Site::new(&[("reach.ply", "")]);
    let place = |unit, crs: &str| {
        let input = InputSettings { unit, crs: crs.to_owned(), ..InputSettings::default() };
        site.open(&["reach.ply"], &input).unwrap_or_else(|e| panic!("{e}")).0.georeference().clone()
    };
    let us = place(Unit::UsFt, "");
    assert_eq!((us.metres_per_input_unit, us.input_unit.as_str()), (1200.0 / 3937.0, "US survey foot"));
    assert_eq!((us.metres_per_map_unit, us.notes.len()), (1.0, 0));
    let of_crs = place(Unit::Auto, "EPSG:2225");
    assert_eq!((of_crs.metres_per_input_unit, of_crs.input_unit_from), (1200.0 / 3937.0, "the CRS"));
    assert_contains(&of_crs.notes.join("\n"), &["US survey foot", "EPSG:2225", "grains are measured in metres"]);
    let mixed = place(Unit::Ft, "EPSG:2225");
    assert_contains(&mixed.notes.join("\n"), &["US survey foot", "international foot", "as --unit says"]);
    assert_eq!(place(Unit::Auto, "EPSG:2193").notes, Vec::<String>::new());
}

#[test]
fn an_offset_for_coordinates_that_are_on_the_map_already_is_told() {
    let site = Site::new(&[("reach.ply", "")]);
    let warnings = |offset| {
        let input = InputSettings { offset, ..InputSettings::default() };
        site.open(&["reach.ply"], &input).unwrap_or_else(|e| panic!("{e}")).1
    };
    assert_eq!(warnings([480_000.0, 4_420_000.0, 0.0]), []);
    let far = file(&[&crate::plausible::moved([480_000.0, 4_420_000.0, 0.0]), &faces()]);
    std::fs::write(site.path("reach.ply"), far).expect("write");
    assert_eq!(warnings([0.0; 3]), []);
    assert_eq!(warnings([500_000.0, 0.0, 0.0]), []);
    let found = warnings([480_000.0, 4_420_000.0, 0.0]);
    assert!(matches!(found.as_slice(), [Warning::LooksShifted { .. }]), "{found:?}");
    assert_contains(&found[0].to_string(), &["480000", "already", "\nhelp: "]);
}

#[test]
fn a_missing_survey_is_told_by_its_own_name_whatever_lies_beside_it() {
    let site = Site::new(&[("gone.prj", UTM_33)]);
    let error = site.open(&["gone.ply"], &InputSettings::default()).expect_err("not there").to_string();
    assert_contains(&error, &["gone.ply: there is no such file"]);
    assert!(Path::new(&site.path("gone.prj")).exists());
}
