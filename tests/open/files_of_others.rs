//! Files that other software wrote; skipped where the shared data are not there.

use crate::{assert_contains, shared};
use gravelometer::inspect::{Inspection, Preset, inspect};
use gravelometer::open::{OpenError, Reach};
use gravelometer::settings::InputSettings;
use std::path::{Path, PathBuf};

fn open(path: &Path) -> Result<Reach, OpenError> {
    Reach::open(&[path.to_owned()], &InputSettings::default(), &|_, _| {}).map(|(reach, _)| reach)
}

fn look(path: &Path) -> Inspection {
    inspect(&[path.to_owned()], &InputSettings::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Vertices, faces and triangles of every mesh among the files, as a plain reader of another language counts them.
const READABLE: [(&str, [u64; 3]); 27] = [
    ("assimp_cube.ply", [8, 6, 12]),
    ("assimp_cube_binary.ply", [8, 12, 12]),
    ("assimp_cube_binary_header_with_RN_newline.ply", [8, 12, 12]),
    ("assimp_cube_binary_starts_with_nl.ply", [8, 6, 12]),
    ("assimp_cube_uv.ply", [24, 6, 12]),
    ("assimp_float-color.ply", [3, 1, 1]),
    ("happly_platonic_shelf.ply", [50, 50, 80]),
    ("happly_platonic_shelf_ascii.ply", [50, 50, 80]),
    ("happly_platonic_shelf_big_endian.ply", [50, 50, 80]),
    ("loadersgl_bunny.ply", [34834, 69451, 69451]),
    ("loadersgl_cube_att.ply", [24, 12, 12]),
    ("trimesh_BoxTextured.ply", [24, 12, 12]),
    ("trimesh_cube_blender_uv.ply", [24, 6, 12]),
    ("trimesh_cube_blender_uv_meshlab.ply", [24, 12, 12]),
    ("trimesh_cycloidal.ply", [21384, 43368, 43368]),
    ("trimesh_featuretype.ply", [5096, 3476, 3476]),
    ("trimesh_fixed_top.ply", [2374, 4772, 4772]),
    ("trimesh_metadata.ply", [4, 2, 2]),
    ("trimesh_mirror.ply", [143, 286, 286]),
    ("trimesh_multi.ply", [4, 1, 2]),
    ("trimesh_octagonal_pocket.ply", [1658, 3262, 3262]),
    ("trimesh_plane.ply", [4, 1, 2]),
    ("trimesh_plane_tri.ply", [4, 2, 2]),
    ("trimesh_reference.ply", [845, 1610, 1610]),
    ("trimesh_sphere.ply", [642, 1280, 1280]),
    ("trimesh_suzanne.ply", [1966, 500, 968]),
    ("trimesh_tet.ply", [4, 4, 4]),
];

#[test]
fn every_sample_is_read_or_refused_by_name() {
    let Some(directory) = shared("formats/ply") else { return };
    let mut paths: Vec<PathBuf> =
        directory.read_dir().expect("directory").map(|entry| entry.expect("entry").path()).collect();
    paths.sort();
    assert!(paths.len() > 40);
    let mut read = Vec::new();
    for path in &paths {
        let name = path.file_name().expect("name").to_string_lossy().into_owned();
        match open(path) {
            Ok(reach) => {
                println!(
                    "{name}: {} vertices, {} faces, {} triangles",
                    reach.vertices(),
                    reach.faces(),
                    reach.triangles()
                );
                read.push((name, [reach.vertices(), reach.faces(), reach.triangles()]));
            }
            Err(error) => {
                let message = error.to_string();
                println!("{}", message.replace(&format!("{}/", directory.display()), ""));
                assert_contains(&message, &[&name, "\nhelp: "]);
            }
        }
    }
    let read: Vec<_> = read.iter().map(|(name, counts)| (name.as_str(), *counts)).collect();
    assert_eq!(read, READABLE);
}

#[test]
fn one_patch_written_by_many_programs_is_one_surface() {
    let Some(directory) = shared("formats/same_surface") else { return };
    let names = [
        "meshio_bin",
        "open3d_bin",
        "pymeshlab_bin",
        "pymeshlab_full",
        "trimesh_bin",
        "vtk_bin",
        "plyfile_utm_double_le_int_ushort",
    ];
    let figures: Vec<_> = names.iter().map(|n| look(&directory.join(format!("{n}.ply"))).survey).collect();
    for (name, survey) in names.iter().zip(&figures) {
        assert_eq!((survey.contents.vertices, survey.contents.triangles), (3356, 5999), "{name}");
        let (area, first) = (survey.surface.surface_area_m2, figures[0].surface.surface_area_m2);
        assert!((area / first - 1.0).abs() < 1e-5, "{name}: {area} against {first}");
    }
}

#[test]
fn a_surface_destroyed_by_floats_is_refused() {
    let Some(path) = shared("formats/same_surface/plyfile_utm_FLOAT32_degraded_le.ply") else { return };
    let error = open(&path).expect_err("destroyed");
    assert!(matches!(error, OpenError::FloatStep { .. }), "{error}");
    let remedy = ["double coordinates", "--offset or --offset-file", "FLOAT32_degraded_le.ply: "];
    assert_contains(&error.to_string(), &remedy);
}

#[test]
fn the_otira_bed_has_its_figures() {
    let Some(path) = shared("otira/otira_poisson.ply") else { return };
    let found = look(&path);
    let (contents, surface) = (&found.survey.contents, &found.survey.surface);
    assert_eq!((contents.vertices, contents.triangles), (214_358, 414_183));
    // Reckoned with NumPy from the same file. A 17th triangle, of 4.5e-13 m², is a sliver, not nothing.
    assert_eq!(surface.zero_area_triangles, 16);
    assert!((surface.surface_area_m2 - 42.887_903_270_6).abs() < 1e-9, "{}", surface.surface_area_m2);
    assert!((surface.mean_edge_m - 0.016_630_097_291).abs() < 1e-11, "{}", surface.mean_edge_m);
    assert_eq!(found.survey.suggestion.preset, Preset::LaserScan);
    assert_eq!(found.warnings, Vec::<String>::new());
    let text = found.to_string();
    assert_contains(&text, &["414183", "PLY binary_little_endian", "configs/laser-scan.toml", "zero-area triangles"]);
    println!("{text}");
    let json = serde_json::to_value(&found).expect("serializable");
    assert_eq!(json["survey"]["surface"]["zero_area_triangles"], 16);
}

#[test]
fn the_golden_beds_have_their_counts_and_colours() {
    for (name, vertices, triangles) in [("bed3d_1M", 481_851, 962_254), ("bed_0.3M", 150_544, 299_538)] {
        let Some(path) = shared(&format!("golden/{name}.ply")) else { return };
        let reach = open(&path).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((reach.vertices(), reach.triangles()), (vertices, triangles));
        assert!(reach.has_colors());
    }
}

#[test]
fn the_widest_scene_opens_in_seconds() {
    let Some(path) = shared("dev-scenes/wide_window/mesh.ply") else { return };
    let start = std::time::Instant::now();
    let reach = open(&path).unwrap_or_else(|e| panic!("{e}"));
    let seconds = start.elapsed().as_secs_f64();
    println!("{} triangles opened in {seconds:.3} s", reach.triangles());
    assert_eq!((reach.vertices(), reach.triangles()), (751_969, 1_494_646));
    assert!(seconds < 10.0, "{seconds} s");
}
