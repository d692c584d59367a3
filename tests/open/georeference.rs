//! Units, offsets and coordinate systems.

use crate::ply_bytes::{faces, file, vertices};
use crate::{assert_contains, open_with};
use gravelometer::open::GeoReference;
use gravelometer::settings::{InputSettings, Unit};

fn reference(text: &str) -> GeoReference {
    GeoReference::from_setting(text).unwrap_or_else(|e| panic!("{e}")).expect("not empty")
}

fn refused(text: &str) -> String {
    let message = GeoReference::from_setting(text).expect_err("must be refused").to_string();
    assert_contains(&message, &["--crs ", "\nhelp: "]);
    message
}

#[test]
fn a_code_gives_name_code_and_metres() {
    let utm = reference("EPSG:32633");
    assert_eq!(utm.crs.name, "WGS 84 / UTM zone 33N");
    assert_eq!(utm.crs.authority.as_deref(), Some("EPSG:32633"));
    assert_eq!(utm.metres_per_unit, 1.0);
    assert!(utm.crs.wkt.starts_with("PROJCS["), "{}", utm.crs.wkt);
    assert_eq!(GeoReference::from_setting("  ").expect("empty is none"), None);
}

#[test]
fn feet_are_exact() {
    assert_eq!(reference("EPSG:2225").metres_per_unit, 1200.0 / 3937.0);
    assert_eq!(reference("EPSG:2222").metres_per_unit, 0.3048);
}

#[test]
fn wkt_and_files_that_hold_it_give_the_same_system() {
    let utm = reference("EPSG:32633");
    assert_eq!(reference(&utm.crs.wkt).crs.name, utm.crs.name);
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("site.prj");
    let esri = r#"PROJCS["WGS_1984_UTM_Zone_33N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",500000.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",15.0],PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]]"#;
    std::fs::write(&path, esri).expect("write");
    let from_file = reference(path.to_str().expect("UTF-8"));
    assert_eq!(from_file.metres_per_unit, 1.0);
    assert_eq!(from_file.crs.authority, None, "an ESRI file carries no code");
    assert!(from_file.crs.name.contains("UTM"), "{}", from_file.crs.name);
    std::fs::write(&path, "EPSG:32633\n").expect("write");
    assert_eq!(reference(path.to_str().expect("UTF-8")), utm);
    std::fs::write(&path, "hello").expect("write");
    assert_contains(&refused(path.to_str().expect("UTF-8")), &["site.prj", "no WKT"]);
}

#[test]
fn systems_without_plane_coordinates_are_refused() {
    assert_contains(&refused("EPSG:4326"), &["WGS 84 is geographic (degrees)", "project the mesh"]);
    assert_contains(&refused("EPSG:4978"), &["geocentric", "project the mesh"]);
    assert_contains(&refused("EPSG:5773"), &["without coordinates in plan"]);
}

#[test]
fn heights_in_another_unit_than_plan_are_refused() {
    assert_contains(&refused("EPSG:32633+6360"), &["plan in units of 1 m", "height in units of 0.3048"]);
    assert_eq!(reference("EPSG:32633+5773").metres_per_unit, 1.0);
}

#[test]
fn unknown_codes_carry_gdals_message() {
    assert_contains(&refused("EPSG:999999"), &["EPSG:999999", "not found"]);
    assert_contains(&refused("PROJCS[\"half"), &["PROJCS[", "GDAL"]);
    assert_contains(&refused("somewhere.prj"), &["somewhere.prj", "neither EPSG:n"]);
}

#[test]
fn units_come_from_the_setting_or_else_from_the_system() {
    let bytes = file(&[&vertices(), &faces()]);
    let open = |unit, crs: &str| {
        let input = InputSettings { unit, crs: crs.into(), offset: [1000.0, 2000.0, 5.0], ..InputSettings::default() };
        open_with("reach.ply", &bytes, &input).expect("readable").0
    };
    for (unit, crs, input_m, map_m) in [
        (Unit::Auto, "", 1.0, 1.0),
        (Unit::Mm, "", 1e-3, 1.0),
        (Unit::Ft, "", 0.3048, 1.0),
        (Unit::Auto, "EPSG:2225", 1200.0 / 3937.0, 1200.0 / 3937.0),
        (Unit::M, "EPSG:2225", 1.0, 1200.0 / 3937.0),
        (Unit::Auto, "EPSG:32633", 1.0, 1.0),
    ] {
        let reach = open(unit, crs);
        let frame = reach.frame();
        assert_eq!((frame.metres_per_input_unit, frame.metres_per_map_unit), (input_m, map_m), "{unit:?} {crs}");
        assert_eq!(frame.offset_map, [1000.0, 2000.0, 5.0]);
        assert_eq!(reach.position(0).y, 0.0);
        assert_eq!(reach.position(2).y, input_m);
    }
}
