//! A made-up gravel bed that is full of what rarely occurs: stones of very different size that overlap, bodies
//! wider than any grain, holes, islands, fins, doubled faces, faces without area, vertices without faces.
#![allow(dead_code, unreachable_pub, missing_docs, clippy::unwrap_used)]

use gravelometer::geometry::DVec3;
use gravelometer::open::MemorySurface;
use std::io::Write;
use std::path::Path;

/// Seeded numbers (splitmix64), so that a bed is the same wherever it is made.
pub struct Rng(pub u64);

impl Rng {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// From `low` up to `high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub fn shuffled(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}

/// Distance between neighbouring vertices in plan, metres.
pub const SPACING_M: f64 = 0.02;

/// A stone: an ellipsoid, part of which shows.
struct Stone {
    centre: DVec3,
    half: DVec3,
    turn: f64,
}

impl Stone {
    fn top(&self, x: f64, y: f64) -> Option<f64> {
        let (sin, cos) = self.turn.sin_cos();
        let (dx, dy) = (x - self.centre.x, y - self.centre.y);
        let (u, v) = ((cos * dx + sin * dy) / self.half.x, (cos * dy - sin * dx) / self.half.y);
        let rest = 1.0 - u * u - v * v;
        (rest > 0.0).then(|| self.centre.z + self.half.z * rest.sqrt())
    }
}

fn stones(rng: &mut Rng, width_m: f64, height_m: f64) -> Vec<Stone> {
    let mut stones = Vec::new();
    // Half-axes from 5 cm to 70 cm: the widest exceed every limit the tests set, the next are wider than a
    // small tile's core.
    for (count, low, high) in [(1, 0.55, 0.65), (4, 0.25, 0.45), (25, 0.12, 0.22), (120, 0.06, 0.11)] {
        for _ in 0..count {
            let a = rng.within(low, high);
            let half = DVec3::new(a, a * rng.within(0.65, 1.0), a * rng.within(0.5, 0.8));
            let centre =
                DVec3::new(rng.within(0.0, width_m), rng.within(0.0, height_m), half.z * rng.within(-0.35, 0.1));
            stones.push(Stone { centre, half, turn: rng.within(0.0, 3.2) });
        }
    }
    stones
}

/// A bed of about `2 columns rows` triangles, 2 cm wide each, its triangles in the order of the rows.
pub fn bed(seed: u64, columns: usize, rows: usize) -> MemorySurface {
    let mut rng = Rng(seed);
    let mut surface = MemorySurface::default();
    let stones = stones(&mut rng, columns as f64 * SPACING_M, rows as f64 * SPACING_M);
    for j in 0..=rows {
        for i in 0..=columns {
            let mut jitter = || rng.within(-0.3, 0.3) * SPACING_M;
            let (x, y) = (i as f64 * SPACING_M + jitter(), j as f64 * SPACING_M + jitter());
            let ground = rng.within(-0.006, 0.006);
            let stone = stones.iter().filter_map(|s| s.top(x, y)).fold(f64::NEG_INFINITY, f64::max);
            // Now and then a pit in a stone, which must not tear it apart.
            let pit = if rng.below(60) == 0 { 0.012 } else { 0.0 };
            let z = if stone > ground { stone + rng.within(-0.0008, 0.0008) - pit } else { ground };
            push_vertex(&mut surface, &mut rng, DVec3::new(x, y, z));
        }
    }
    let at = |i: usize, j: usize| (j * (columns + 1) + i) as u64;
    for j in 0..rows {
        for i in 0..columns {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            surface.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let size = DVec3::new(columns as f64 * SPACING_M, rows as f64 * SPACING_M, 0.0);
    punch(&mut surface, &mut rng, size);
    spoil(&mut surface, &mut rng);
    scatter(&mut surface, &mut rng, size);
    surface
}

fn push_vertex(surface: &mut MemorySurface, rng: &mut Rng, p: DVec3) -> u64 {
    surface.positions.push(p);
    let shade =
        (rng.below(256) as f64, (p.x * 40.0).rem_euclid(256.0).floor(), (p.z * 200.0).rem_euclid(256.0).floor());
    surface.colors.push([shade.0 as u8, shade.1 as u8, shade.2 as u8]);
    surface.positions.len() as u64 - 1
}

/// Holes: many small ones, on stones and beside them, one large and a gap that cuts an island off.
fn punch(surface: &mut MemorySurface, rng: &mut Rng, size: DVec3) {
    let mut holes: Vec<(DVec3, f64)> = (0..60)
        .map(|_| (DVec3::new(rng.within(0.0, size.x), rng.within(0.0, size.y), 0.0), rng.within(0.005, 0.05)))
        .collect();
    holes.push((DVec3::new(0.8 * size.x, 0.3 * size.y, 0.0), 0.12 * size.x));
    let positions = &surface.positions;
    let gap = 0.93 * size.x;
    surface.triangles.retain(|t| {
        let mut c = (positions[t[0] as usize] + positions[t[1] as usize] + positions[t[2] as usize]) / 3.0;
        c.z = 0.0;
        (c.x - gap).abs() > 0.03 && holes.iter().all(|(p, r)| (c - *p).length() > *r)
    });
}

/// Doubled faces (also turned over), fins on inner edges, faces without area.
fn spoil(surface: &mut MemorySurface, rng: &mut Rng) {
    let sound = surface.triangles.len();
    for _ in 0..30 {
        let [a, b, c] = surface.triangles[rng.below(sound)];
        surface.triangles.extend([[a, b, c], [c, b, a]]);
    }
    for _ in 0..30 {
        let [a, b, _] = surface.triangles[rng.below(sound)];
        let tip = (surface.positions[a as usize] + surface.positions[b as usize]) / 2.0;
        let tip = push_vertex(surface, rng, tip + DVec3::new(0.001, 0.002, 0.03));
        surface.triangles.push([a, b, tip]);
    }
    for i in 0..30 {
        let [a, b, c] = surface.triangles[rng.below(sound)];
        surface.triangles.push(if i % 2 == 0 { [a, a, b] } else { [c, c, c] });
    }
    for _ in 0..10 {
        let [a, b, _] = surface.triangles[rng.below(sound)];
        let twin = push_vertex(surface, rng, surface.positions[a as usize]);
        surface.triangles.push([a, b, twin]);
    }
}

/// Closed balls that hover above the bed and beside it, single triangles, and vertices without triangles.
fn scatter(surface: &mut MemorySurface, rng: &mut Rng, size: DVec3) {
    for k in 0..5 {
        let radius = rng.within(0.08, 0.14);
        let x = if k == 0 { size.x + 1.1 } else { rng.within(0.1, 0.9) * size.x };
        let centre = DVec3::new(x, rng.within(0.1, 0.9) * size.y, 0.9 + 0.3 * f64::from(k));
        let first = surface.positions.len() as u64;
        let ball = ball(radius, 14, 28);
        for p in ball.positions {
            push_vertex(surface, rng, centre + p);
        }
        surface.triangles.extend(ball.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    for _ in 0..4 {
        let at = DVec3::new(size.x + rng.within(0.3, 0.9), rng.within(0.0, 1.0) * size.y, 0.1);
        let [a, b, c] = [DVec3::ZERO, DVec3::new(0.02, 0.001, 0.0), DVec3::new(0.003, 0.02, 0.004)]
            .map(|d| push_vertex(surface, rng, at + d));
        surface.triangles.push([a, b, c]);
    }
    for _ in 0..6 {
        let at = DVec3::new(size.x + rng.within(0.3, 2.0), size.y * rng.within(0.0, 1.0), rng.within(0.0, 1.0));
        push_vertex(surface, rng, at);
    }
}

/// A closed sphere about zero, normals outward.
pub fn ball(radius: f64, rings: u64, slices: u64) -> MemorySurface {
    let mut ball = MemorySurface::default();
    ball.positions.push(DVec3::new(0.0, 0.0, radius));
    for i in 1..rings {
        let polar = std::f64::consts::PI * i as f64 / rings as f64;
        for k in 0..slices {
            let turn = std::f64::consts::TAU * (k as f64 + 0.5 * (i % 2) as f64) / slices as f64;
            let flat = DVec3::new(turn.cos(), turn.sin(), 0.0) * polar.sin();
            ball.positions.push((flat + DVec3::Z * polar.cos()) * radius);
        }
    }
    ball.positions.push(DVec3::new(0.0, 0.0, -radius));
    let last = ball.positions.len() as u64 - 1;
    let at = |i: u64, k: u64| 1 + (i - 1) * slices + k % slices;
    for k in 0..slices {
        ball.triangles.push([0, at(1, k), at(1, k + 1)]);
        for i in 1..rings - 1 {
            // Rings are turned by half a slice against each other: which neighbour is nearer alternates.
            let s = i % 2;
            let [a, b, c, d] = [at(i, k), at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)];
            ball.triangles.extend(if s == 1 { [[a, d, b], [a, c, d]] } else { [[a, c, b], [b, c, d]] });
        }
        ball.triangles.push([last, at(rings - 1, k + 1), at(rings - 1, k)]);
    }
    ball
}

/// The same surface with its vertices and triangles in another order; each triangle keeps its corners' order.
pub fn shuffled(surface: &MemorySurface, seed: u64) -> MemorySurface {
    let mut rng = Rng(seed);
    let vertices = rng.shuffled(surface.positions.len());
    let mut new_number = vec![0u64; vertices.len()];
    vertices.iter().enumerate().for_each(|(new, &old)| new_number[old] = new as u64);
    let triangles = rng.shuffled(surface.triangles.len());
    MemorySurface {
        positions: vertices.iter().map(|&v| surface.positions[v]).collect(),
        colors: vertices.iter().map(|&v| surface.colors[v]).collect(),
        triangles: triangles.iter().map(|&t| surface.triangles[t].map(|v| new_number[v as usize])).collect(),
    }
}

/// Writes a surface as binary PLY with double coordinates and byte colours.
pub fn write_ply(path: &Path, surface: &MemorySurface) {
    std::fs::write(path, ply(surface)).unwrap();
}

pub fn ply(surface: &MemorySurface) -> Vec<u8> {
    let mut out = Vec::new();
    let color =
        if surface.colors.is_empty() { "" } else { "property uchar red\nproperty uchar green\nproperty uchar blue\n" };
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\n{color}element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        surface.positions.len(),
        surface.triangles.len()
    )
    .unwrap();
    for (i, p) in surface.positions.iter().enumerate() {
        p.to_array().iter().for_each(|v| out.extend(v.to_le_bytes()));
        if let Some(color) = surface.colors.get(i) {
            out.extend(color);
        }
    }
    for t in &surface.triangles {
        out.push(3);
        t.iter().for_each(|&v| out.extend((v as u32).to_le_bytes()));
    }
    out
}
