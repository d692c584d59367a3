//! The curvature kernel on a seeded sheet of 300,000 triangles, by instruction set, on one thread.
//!
//! `cargo bench --bench curvature` prints the time for all 150,000 vertices; divide.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, criterion_group, criterion_main};
use gravelometer::curvature::{InstructionSet, Stencil, divergence, nearest_centroid_m};
use gravelometer::geometry::{DVec3, PlanBox, triangle_area, triangle_centroid, triangle_normal};
use gravelometer::tile::NormalField;

/// Vertices along a side.
const SIDE: usize = 388;

fn noise(i: usize) -> f64 {
    let mut z = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z >> 11) as f64 / 9_007_199_254_740_992.0 - 0.5
}

/// A jittered sheet of domes 25 mm wide: vertices, normal field, mean triangle area.
fn sheet() -> (Vec<DVec3>, NormalField, f64) {
    let step_m = 4e-4;
    let vertices: Vec<DVec3> = (0..SIDE * SIDE)
        .map(|i| {
            let x = ((i % SIDE) as f64 + 0.5 * noise(3 * i)) * step_m;
            let y = ((i / SIDE) as f64 + 0.5 * noise(3 * i + 1)) * step_m;
            let dome = ((x * 250.0).sin() * (y * 250.0).cos()).max(-0.3) * 6e-3;
            DVec3::new(x, y, dome + noise(3 * i + 2) * 5e-5)
        })
        .collect();
    let mut field = NormalField {
        centroids: Vec::new(),
        normals: Vec::new(),
        loaded: PlanBox { min: [f64::NEG_INFINITY; 2], max: [f64::INFINITY; 2] },
    };
    let mut area = 0.0;
    for row in 0..SIDE - 1 {
        for column in 0..SIDE - 1 {
            let a = row * SIDE + column;
            for corners in [[a, a + 1, a + SIDE + 1], [a, a + SIDE + 1, a + SIDE]] {
                let corners = corners.map(|v| vertices[v]);
                field.centroids.push(triangle_centroid(corners));
                field.normals.push(triangle_normal(corners));
                area += triangle_area(corners);
            }
        }
    }
    let mean = area / field.centroids.len() as f64;
    (vertices, field, mean)
}

fn kernel(c: &mut Criterion) {
    let (vertices, field, area) = sheet();
    let side_m = area.sqrt();
    let near = nearest_centroid_m(&field, &vertices, side_m, InstructionSet::Scalar);
    let spacing_m = near.iter().map(|d| d.value().unwrap()).sum::<f64>() / near.len() as f64;
    let stencil = Stencil { spacing_m, offset_m: 2.0 * spacing_m, neighbours: 25, side_m };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut group = c.benchmark_group("curvature");
    group.sample_size(10);
    for set in InstructionSet::available() {
        group.bench_function(format!("divergence/{set:?}"), |b| {
            b.iter(|| one.install(|| divergence(&field, &vertices, &stencil, set)));
        });
        group.bench_function(format!("nearest/{set:?}"), |b| {
            b.iter(|| one.install(|| nearest_centroid_m(&field, &vertices, side_m, set)));
        });
    }
    group.finish();
}

criterion_group!(benches, kernel);
criterion_main!(benches);
