//! Files do not know how they were made: tiles, threads, memory and vector instructions change no byte of the results, and an
//! offset changes the coordinates by itself and nothing else.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gdal::Dataset;
use gdal::vector::LayerAccess;
use gravelometer::curvature::InstructionSet;
use gravelometer::pipeline::Control;
use gravelometer::progress::Silent;
use gravelometer::run::{Job, Outcome, run};
use gravelometer::settings::{InputSettings, Instructions, Method, Settings};
use std::path::{Path, PathBuf};
use support::bed::{bed, shuffled, write_ply};

/// How a run is worked.
struct Work {
    tile_size_m: f64,
    threads: usize,
    memory: &'static str,
    instructions: Instructions,
    offset: [f64; 3],
}

struct Scene {
    mesh: PathBuf,
    method: Method,
    max_grain_m: f64,
    min_grain_area_m2: f64,
    folder: tempfile::TempDir,
}

impl Scene {
    fn run(&self, name: &str, work: &Work) -> (PathBuf, Outcome, u64) {
        let mut settings = Settings::default();
        settings.segment.method = self.method;
        settings.segment.max_grain_m = self.max_grain_m;
        settings.segment.min_grain_area_m2 = self.min_grain_area_m2;
        settings.raster.cell_m = 0.5;
        settings.output.labelled_mesh = true;
        settings.work.tile_size_m = work.tile_size_m;
        settings.work.threads = work.threads;
        settings.work.memory = work.memory.into();
        settings.work.instructions = work.instructions;
        settings.input.offset = work.offset;
        let out = self.folder.path().join(name);
        let job = Job {
            inputs: vec![self.mesh.clone()],
            out: out.clone(),
            settings,
            force: false,
            resume: false,
            work: None,
        };
        let outcome = run(&job, &Silent, &Control::default()).unwrap();
        assert!(outcome.lost.is_empty(), "{:?}", outcome.lost);
        let report: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
        let tiles = report["facts"]["tiles"].as_u64().unwrap();
        (out, outcome, tiles)
    }
}

fn synthetic(method: Method) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("bed.ply");
    write_ply(&mesh, &shuffled(&bed(4, 150, 110), 8));
    Scene { mesh, method, max_grain_m: 1.0, min_grain_area_m2: 0.004, folder }
}

fn otira(method: Method) -> Option<Scene> {
    let mesh = support::data("otira/otira_poisson.ply")?;
    Some(Scene { mesh, method, max_grain_m: 1.2, min_grain_area_m2: 5e-3, folder: tempfile::tempdir().unwrap() })
}

/// Size of the raster, its west and north border and cell, and the bits of all values.
fn raster(out: &Path) -> ((usize, usize), [f64; 6], Vec<Vec<u32>>) {
    let data = Dataset::open(out.join("grain_size.tif")).unwrap();
    let bands = (1..=data.raster_count())
        .map(|i| {
            data.rasterband(i).unwrap().read_band_as::<f32>().unwrap().data().iter().map(|v| v.to_bits()).collect()
        })
        .collect();
    (data.raster_size(), data.geo_transform().unwrap(), bands)
}

/// All corners of all outlines, feature by feature.
fn outlines(out: &Path) -> Vec<(u64, Vec<[f64; 2]>)> {
    let data = Dataset::open(out.join("grains.gpkg")).unwrap();
    let mut layer = data.layer_by_name("grains").unwrap();
    let of_feature = |f: gdal::vector::Feature| {
        let shape = f.geometry().unwrap();
        let mut corners = Vec::new();
        for polygon in (0..shape.geometry_count()).map(|i| shape.get_geometry(i)) {
            for ring in (0..polygon.geometry_count()).map(|j| polygon.get_geometry(j)) {
                let mut points = Vec::new();
                ring.get_points(&mut points);
                corners.extend(points.iter().map(|&(x, y, _)| [x, y]));
            }
        }
        (f.fid().unwrap(), corners)
    };
    layer.features().map(of_feature).collect()
}

/// The vector instructions that `auto` would take if the best were not there.
fn second_best() -> Instructions {
    match InstructionSet::available().as_slice() {
        [.., InstructionSet::Avx2, _] => Instructions::Avx2,
        _ => Instructions::Scalar,
    }
}

fn is_invariant(scene: &Scene, sizes_m: [f64; 2]) -> Outcome {
    let none = [0.0; 3];
    let instructions = Instructions::Scalar;
    let one = Work { tile_size_m: 1e6, threads: 2, memory: "", instructions, offset: none };
    let (reference, outcome, tiles) = scene.run("one", &one);
    assert_eq!(tiles, 1);
    let sets = [Instructions::Auto, second_best()];
    for (i, (threads, memory)) in [(1, "96MiB"), (2, "96MiB")].into_iter().enumerate() {
        let work = Work { tile_size_m: sizes_m[i], threads, memory, instructions: sets[i], offset: none };
        let (out, _, tiles) = scene.run(&format!("tiled-{i}"), &work);
        assert!(tiles >= [9, 60][i], "{tiles} tiles");
        for name in ["grains.csv", "labelled_mesh.ply", "summary.json"] {
            let same = std::fs::read(reference.join(name)).unwrap() == std::fs::read(out.join(name)).unwrap();
            assert!(same, "{name} depends on the tiling ({tiles} tiles, {threads} threads, {memory}, {:?})", sets[i]);
        }
        assert!(raster(&reference) == raster(&out), "grain_size.tif depends on the tiling");
        assert!(outlines(&reference) == outlines(&out), "grains.gpkg depends on the tiling");
    }
    let offset = [1_480_000.0, 5_250_000.0, 700.0];
    let far = Work { tile_size_m: sizes_m[0], threads: 2, memory: "", instructions: Instructions::Auto, offset };
    let (far, _, _) = scene.run("far", &far);
    only_moved(&reference, &far, offset);
    outcome
}

fn micrometres(text: &str) -> i64 {
    let (whole, part) = text.split_once('.').unwrap();
    assert_eq!(part.len(), 6, "{text}");
    format!("{whole}{part}").parse().unwrap()
}

fn only_moved(near: &Path, far: &Path, offset: [f64; 3]) {
    let read = |out: &Path| csv::Reader::from_path(out.join("grains.csv")).unwrap();
    let header = read(near).headers().unwrap().clone();
    let mut rows = 0;
    for (a, b) in read(near).records().zip(read(far).records()) {
        let (a, b) = (a.unwrap(), b.unwrap());
        for (i, name) in header.iter().enumerate() {
            match ["centroid_x", "centroid_y", "centroid_z"].iter().position(|c| *c == name) {
                Some(k) => assert_eq!(micrometres(&b[i]) - micrometres(&a[i]), offset[k] as i64 * 1_000_000, "{name}"),
                None => assert_eq!(a[i], b[i], "{name}"),
            }
        }
        rows += 1;
    }
    assert_eq!(rows, read(far).records().count());
    let ((a_size, a_place, a_bands), (b_size, b_place, b_bands)) = (raster(near), raster(far));
    assert!(a_size == b_size && a_bands == b_bands, "grain_size.tif depends on the offset");
    assert_eq!([b_place[0] - a_place[0], b_place[3] - a_place[3]], [offset[0], offset[1]]);
    for ((a_fid, a), (b_fid, b)) in outlines(near).into_iter().zip(outlines(far)) {
        assert_eq!((a_fid, a.len()), (b_fid, b.len()));
        for (p, q) in a.iter().zip(&b) {
            assert_eq!([p[0] + offset[0], p[1] + offset[1]], *q, "grain {a_fid}");
        }
    }
    let summary = |out: &Path| std::fs::read(out.join("summary.json")).unwrap();
    let mesh = |out: &Path| std::fs::read(out.join("labelled_mesh.ply")).unwrap();
    assert!(summary(near) == summary(far), "summary.json depends on the offset");
    assert!(labels(&mesh(near)) == labels(&mesh(far)), "labelled_mesh.ply depends on the offset");
}

/// What follows the header: the comments may tell the offset.
fn labels(mesh: &[u8]) -> &[u8] {
    let end = mesh.windows(11).position(|w| w == b"end_header\n").unwrap();
    &mesh[end..]
}

#[test]
fn results_of_a_made_up_bed_depend_on_neither_tiles_nor_threads_nor_memory_nor_the_offset() {
    for method in [Method::Valleys, Method::Rheinwalt2025] {
        let outcome = is_invariant(&synthetic(method), [0.9, 0.25]);
        let (grains, oversize) = (outcome.catalogue.grains.len(), outcome.catalogue.oversize.len());
        println!("{method:?}: {grains} grains, {oversize} oversize");
        assert!(grains > 20 && (oversize > 0) == (method == Method::Rheinwalt2025));
    }
}

#[test]
fn results_of_the_otira_depend_on_neither_tiles_nor_threads_nor_memory_nor_the_offset() {
    for (method, found) in [(Method::Valleys, (440, 0)), (Method::Rheinwalt2025, (290, 2))] {
        let Some(scene) = otira(method) else { return };
        let outcome = is_invariant(&scene, [2.5, 0.7]);
        assert_eq!((outcome.catalogue.grains.len(), outcome.catalogue.oversize.len()), found, "{method:?}");
    }
}

#[test]
fn how_a_survey_is_placed_on_the_map_changes_its_positions_and_nothing_else() {
    let scene = Scene { min_grain_area_m2: 1e-3, ..synthetic(Method::Valleys) };
    let beside = |name: &str, text: &str| {
        let path = scene.folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let placed = |name: &str, input: InputSettings| {
        let mut settings = Settings { input, ..Settings::default() };
        settings.segment.max_grain_m = scene.max_grain_m;
        settings.segment.min_grain_area_m2 = scene.min_grain_area_m2;
        settings.raster.cell_m = 0.5;
        settings.output.labelled_mesh = true;
        let (inputs, out) = (vec![scene.mesh.clone()], scene.folder.path().join(name));
        let job = Job { inputs, out: out.clone(), settings, force: false, resume: false, work: None };
        assert!(run(&job, &Silent, &Control::default()).unwrap().lost.is_empty());
        out
    };
    let nowhere = placed("nowhere", InputSettings::default());
    let forms = [
        ("odm", "WGS84 UTM 33N\n500000 4600000\n0.5 0.5 12\n", [5e5, 46e5, 0.0]),
        ("pix4d_offset.xyz", "500000.000 4600000.000 100.000\n", [5e5, 46e5, 100.0]),
        ("shift", "EPSG:32633 500000 4600000 100\n", [5e5, 46e5, 100.0]),
        ("plain", "-500000\n4600000\n-7\n", [-5e5, 46e5, -7.0]),
    ];
    for (name, text, offset) in forms {
        let input = InputSettings { offset_file: beside(name, text), ..InputSettings::default() };
        only_moved(&nowhere, &placed(&format!("{name}-out"), input), offset);
    }
    beside("bed.prj", "EPSG:2193");
    only_moved(&nowhere, &placed("prj-out", InputSettings::default()), [0.0; 3]);
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(scene.folder.path().join("prj-out/run.json")).unwrap()).unwrap();
    assert_eq!(report["facts"]["georeference"]["authority"], "EPSG:2193");
}
