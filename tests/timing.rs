#![allow(missing_docs, clippy::unwrap_used)]
mod support;
use gravelometer::curvature::*;
use gravelometer::geometry::*;
use gravelometer::tile::NormalField;
fn read(path: &std::path::Path) -> (NormalField, Vec<DVec3>, f64) {
    let bytes = std::fs::read(path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |name: &str| -> usize {
        header.lines().find_map(|l| l.strip_prefix(&format!("element {name} "))).unwrap().parse().unwrap()
    };
    let (n, m) = (count("vertex"), count("face"));
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let int = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let p: Vec<DVec3> = (0..n).map(|i| { let at = end + 15 * i; DVec3::new(float(at), float(at + 4), float(at + 8)) }).collect();
    let mut f = NormalField { centroids: vec![], normals: vec![], loaded: PlanBox { min: [f64::NEG_INFINITY; 2], max: [f64::INFINITY; 2] } };
    let mut area = 0.0;
    for i in 0..m {
        let at = end + 15 * n + 13 * i;
        let c = [int(at + 1), int(at + 5), int(at + 9)].map(|v| p[v]);
        area += triangle_area(c);
        f.centroids.push(triangle_centroid(c));
        f.normals.push(triangle_normal(c));
    }
    (f, p, area / m as f64)
}
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    s.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
}
#[test]
#[ignore]
fn timing() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| {
        for name in std::env::var("BEDS").unwrap_or("bed_0.3M bed3d_1M".into()).split(' ') {
            let Some(path) = support::data(&format!("golden/{name}.ply")) else { return };
            let (f, p, area) = read(&path);
            let side = area.sqrt();
            let reps: usize = std::env::var("REPS").map_or(3, |r| r.parse().unwrap());
            for set in InstructionSet::available().into_iter().filter(|s| std::env::var("SET").map_or(true, |w| format!("{s:?}") == w)) {
                let (mut best, mut best_d) = (f64::MAX, f64::MAX);
                let mut hash = 0u64;
                for r in 0..reps {
                    let t = cpu();
                    let near = nearest_centroid_m_with(&f, &p, side, set);
                    best = best.min(cpu() - t);
                    let spacing = near.iter().map(|d| d.unwrap()).sum::<f64>() / p.len() as f64;
                    let st = Stencil { spacing_m: spacing, offset_m: 2.0 * spacing, neighbours: 25, side_m: side };
                    for t in &TALLY { t.store(0, std::sync::atomic::Ordering::Relaxed); }
                    let t = cpu();
                    let d = divergence_with(&f, &p, &st, set);
                    best_d = best_d.min(cpu() - t);
                    if r == 0 { hash = d.iter().fold(0, |h: u64, v| h.rotate_left(5).wrapping_mul(0x9E3779B97F4A7C15) ^ v.unwrap().to_bits()); }
                }
                let n = p.len() as f64;
                println!("{name} {set:?}: nearest {:.3} us/vertex, divergence {:.3} us/vertex, tally {:?}, {:016x}", best / n * 1e6, best_d / n * 1e6,
                    TALLY.iter().map(|t| t.load(std::sync::atomic::Ordering::Relaxed) as f64 / n).collect::<Vec<_>>(), hash);
            }
        }
    });
}
