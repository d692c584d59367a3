//! Point clouds from file to grains: the format, the order of points and the tiling do not matter.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use gravelometer::pipeline::Control;
use gravelometer::progress::Silent;
use gravelometer::run::{Job, Outcome, run};
use gravelometer::settings::Settings;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const OTIRA: [&str; 3] =
    ["otira/Otira_1cm_grains.ply", "otira/otira_cloud_1.2_pf3.las", "otira/otira_cloud_1.4_pf7.laz"];

fn settings() -> Settings {
    let mut settings = Settings::default();
    settings.segment.min_grain_area_m2 = 5e-3;
    settings.segment.max_grain_m = 1.2;
    settings.output.labelled_cloud = true;
    settings
}

fn job(input: &Path, out: &Path, settings: Settings) -> Job {
    Job { inputs: vec![input.to_owned()], out: out.to_owned(), settings, force: false, resume: false, work: None }
}

fn run_on(input: &Path, out: &Path, settings: Settings) -> Outcome {
    let outcome = run(&job(input, out, settings), &Silent, &Control::default()).unwrap();
    assert!(outcome.lost.is_empty());
    outcome
}

/// Places of grains, local metres, and their b axes.
fn grains(outcome: &Outcome) -> Vec<([f64; 3], f64)> {
    outcome.catalogue.grains.iter().map(|g| (g.grain.centroid.to_array(), g.grain.axes_m[1])).collect()
}

#[test]
fn las_and_laz_give_the_same_bytes_and_the_ply_gives_the_same_grains_but_at_thresholds() {
    let paths: Vec<PathBuf> = OTIRA.into_iter().filter_map(support::data).collect();
    let [ply, las, laz] = paths.as_slice() else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let of_las = run_on(las, &out("las"), settings());
    run_on(laz, &out("laz"), settings());
    let read = |name: &str| std::fs::read(out(name).join("grains.csv")).unwrap();
    assert!(read("las") == read("laz"), "LAS and LAZ differ");
    let of_ply = run_on(ply, &out("ply"), settings());
    // The LAS file holds the points rounded to 0.1 mm. Where a body is as large or as round as the limit, or four points
    // lie on one circle, that decides: few grains, and those of nearly the same size.
    let (ours, theirs) = (grains(&of_las), grains(&of_ply));
    let twins = ours.iter().filter(|(p, b)| {
        let near = |(q, c): &&([f64; 3], f64)| {
            (0..2).all(|i| (p[i] - q[i]).abs() < 0.05 * b) && (p[2] - q[2]).abs() < 0.1 * b && (b / c - 1.0).abs() < 0.1
        };
        theirs.iter().filter(near).count() == 1
    });
    let twins = twins.count();
    println!("{twins} twins of {} grains of the LAS and {} of the PLY", ours.len(), theirs.len());
    assert!(ours.len() > 200 && ours.len().abs_diff(theirs.len()) * 25 < ours.len(), "{} {}", ours.len(), theirs.len());
    assert!(twins * 20 > ours.len() * 17, "{twins} of {}", ours.len());
}

#[test]
fn tiles_threads_and_memory_change_no_byte_of_a_cloud_s_results() {
    let Some(cloud) = support::data(OTIRA[2]) else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut reference: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
    for (name, tile_size_m, threads, memory) in
        [("one", 0.0, 2, ""), ("nine", 2.5, 1, "96MiB"), ("many", 0.7, 3, "96MiB")]
    {
        let mut settings = settings();
        settings.work.tile_size_m = tile_size_m;
        settings.work.threads = threads;
        settings.work.memory = memory.into();
        settings.output.labelled_mesh = true;
        let out = folder.path().join(name);
        let outcome = run_on(&cloud, &out, settings);
        assert!(outcome.catalogue.grains.len() > 200);
        for file in ["grains.csv", "labelled_mesh.ply", "labelled_cloud.laz", "grain_size.tif"] {
            let bytes = std::fs::read(out.join(file)).unwrap();
            let first = reference.entry(file).or_insert_with(|| bytes.clone());
            assert!(*first == bytes, "{file} of {name}");
        }
    }
}

#[test]
fn an_index_that_is_used_again_gives_the_same_labels() {
    let Some(cloud) = support::data(OTIRA[1]) else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut results = Vec::new();
    for name in ["first", "again"] {
        let mut job = job(&cloud, &folder.path().join(name), settings());
        job.work = Some(folder.path().join("work"));
        run(&job, &Silent, &Control::default()).unwrap();
        let report = std::fs::read_to_string(job.out.join("run.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        let read = |file: &str| std::fs::read(job.out.join(file)).unwrap();
        assert_eq!(report["facts"]["surface"]["points"], 100_769);
        results.push((report["facts"]["surface"].clone(), read("labelled_cloud.laz"), read("grains.csv")));
    }
    assert!(results[0] == results[1]);
}

#[test]
fn a_labelled_cloud_of_a_mesh_and_a_survey_of_both_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("bed.ply");
    support::bed::write_ply(&mesh, &support::bed::bed(4, 40, 40));
    let refused = run(&job(&mesh, &folder.path().join("out"), settings()), &Silent, &Control::default()).unwrap_err();
    assert!(refused.to_string().contains("--labelled-cloud: the inputs are meshes"), "{refused}");
    let cloud = folder.path().join("points.ply");
    let points = support::bed::bed(4, 40, 40);
    let points = gravelometer::open::MemorySurface { triangles: Vec::new(), ..points };
    support::bed::write_ply(&cloud, &points);
    let mut both = job(&mesh, &folder.path().join("both"), Settings::default());
    both.inputs.push(cloud);
    let refused = run(&both, &Silent, &Control::default()).unwrap_err().to_string();
    assert!(refused.contains("bed.ply is a mesh and") && refused.contains("points.ply a point cloud"), "{refused}");
}

#[test]
fn coordinates_that_step_by_as_much_as_points_lie_apart_are_refused_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = folder.path().join("points.ply");
    let mut points = gravelometer::open::MemorySurface { triangles: Vec::new(), ..support::bed::bed(4, 60, 60) };
    // What 32 bits leave of a northing.
    points.positions.iter_mut().for_each(|p| p.y = f64::from((p.y + 5_250_000.0) as f32));
    points.positions.iter_mut().for_each(|p| p.x = f64::from((p.x + 500_000.0) as f32));
    write_float_cloud(&cloud, &points.positions);
    let refused =
        run(&job(&cloud, &folder.path().join("out"), Settings::default()), &Silent, &Control::default()).unwrap_err();
    assert!(refused.to_string().contains("coordinates step by 5.000e-1 m"), "{refused}");
}

fn write_float_cloud(path: &Path, points: &[gravelometer::geometry::DVec3]) {
    let mut bytes = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", points.len()).into_bytes();
    bytes.extend(b"property float x\nproperty float y\nproperty float z\nend_header\n");
    bytes.extend(points.iter().flat_map(|p| p.as_vec3().to_array()).flat_map(f32::to_le_bytes));
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn points_on_an_exact_grid_are_no_destroyed_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = folder.path().join("grid.ply");
    let mut text = String::from("ply\nformat ascii 1.0\nelement vertex 2500\n");
    text += "property float x\nproperty float y\nproperty float z\nend_header\n";
    for i in 0..2500u32 {
        let (x, y) = (f64::from(i % 50) / 10.0, f64::from(i / 50) / 10.0);
        text += &format!("{x:.1} {y:.1} {:.5}\n", 0.2 * (2.0 * x).sin() * (2.0 * y).sin());
    }
    std::fs::write(&cloud, text).unwrap();
    let outcome = run_on(&cloud, &folder.path().join("out"), Settings::default());
    assert_eq!(outcome.triangles, 2 * 49 * 49);
}
