//! Surfaces that are cut into blocks, each with vertices of its own.

use crate::support::bed::{SPACING_M, bed, write_ply};
use gravelometer::geometry::DVec3;
use gravelometer::open::{Frame, MemorySurface, Reach, Surface};
use gravelometer::settings::InputSettings;
use gravelometer::weld::{Part, WeldError, warnings, weld_parts};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// Some of a surface's triangles, with the vertices that they use, numbered in the order in which they come up.
pub fn block(surface: &MemorySurface, triangles: impl Iterator<Item = usize>) -> MemorySurface {
    let mut numbers = HashMap::new();
    let mut block = MemorySurface::default();
    for t in triangles {
        let corners = surface.triangles[t].map(|v| {
            *numbers.entry(v).or_insert_with(|| {
                block.positions.push(surface.positions[v as usize]);
                block.colors.extend(surface.colors.get(v as usize));
                block.positions.len() as u64 - 1
            })
        });
        block.triangles.push(corners);
    }
    block
}

pub fn centroid(surface: &MemorySurface, triangle: usize) -> DVec3 {
    surface.corners(triangle as u64).iter().sum::<DVec3>() / 3.0
}

/// Blocks of a surface by what `of` says of each triangle's centroid; those without triangles are left out.
pub fn cut(surface: &MemorySurface, of: impl Fn(DVec3) -> usize) -> Vec<MemorySurface> {
    let mut blocks: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for t in 0..surface.triangles.len() {
        blocks.entry(of(centroid(surface, t))).or_default().push(t);
    }
    blocks.into_values().map(|triangles| block(surface, triangles.into_iter())).collect()
}

pub fn bounds(surface: &MemorySurface) -> (DVec3, DVec3) {
    let grow = |(min, max): (DVec3, DVec3), p: &DVec3| (min.min(*p), max.max(*p));
    surface.positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), grow)
}

/// Blocks of `columns` by `rows`, whose borders wander by `ragged` metres.
pub fn grid(surface: &MemorySurface, columns: usize, rows: usize, ragged: f64) -> Vec<MemorySurface> {
    let (min, max) = bounds(surface);
    let along = |value: f64, axis: usize, n: usize| {
        let share = (value - min[axis]) / (max[axis] - min[axis]);
        ((share * n as f64).floor().max(0.0) as usize).min(n - 1)
    };
    cut(surface, |p| {
        let wander = ragged * ((p.x * 23.0).sin() + (p.y * 31.0).sin() + (p.x * 210.0 + p.y * 170.0).sin());
        along(p.y + wander, 1, rows) * columns + along(p.x + wander, 0, columns)
    })
}

pub fn moved(surface: &MemorySurface, by: DVec3) -> MemorySurface {
    let positions = surface.positions.iter().map(|&p| p + by).collect();
    MemorySurface { positions, ..surface.clone() }
}

/// Two blocks of a surface that overlap by so many metres in the middle.
pub fn overlapping(surface: &MemorySurface, by: f64) -> [MemorySurface; 2] {
    let (min, max) = bounds(surface);
    let middle = (min.x + max.x) / 2.0;
    let part = |wanted: &dyn Fn(f64) -> bool| {
        let inside = (0..surface.triangles.len()).filter(|&t| wanted(centroid(surface, t).x));
        block(surface, inside)
    };
    [part(&|x| x < middle + by / 2.0), part(&|x| x >= middle - by / 2.0)]
}

/// A bed without the vertices that lie at one place on purpose: which of them is which cannot be told across a border.
pub fn sound_bed(seed: u64, columns: usize, rows: usize) -> MemorySurface {
    let mut bed = bed(seed, columns, rows);
    let mut first = HashMap::new();
    for triangle in &mut bed.triangles {
        for v in triangle {
            let place = bed.positions[*v as usize].to_array().map(f64::to_bits);
            *v = *first.entry(place).or_insert(*v);
        }
    }
    block(&bed, 0..bed.triangles.len())
}

/// Blocks one after the other as one surface, and what the weld needs to know of them.
pub fn joined(blocks: &[MemorySurface]) -> (MemorySurface, Vec<Part>) {
    let (mut all, mut parts) = (MemorySurface::default(), Vec::new());
    for (i, block) in blocks.iter().enumerate() {
        let (vertex, triangle) = (all.vertices(), all.triangles());
        all.positions.extend(&block.positions);
        all.colors.extend(&block.colors);
        all.triangles.extend(block.triangles.iter().map(|t| t.map(|v| v + vertex)));
        let (min, max) = bounds(block);
        let (vertices, triangles) = (vertex..all.vertices(), triangle..all.triangles());
        let name = format!("block{i}.ply");
        parts.push(Part { name, vertices, triangles, min, max, edge_m: Some(SPACING_M), step_m: 1e-15 });
    }
    (all, parts)
}

/// What a survey of these blocks is refused or warned with.
pub fn judged(blocks: &[MemorySurface]) -> Result<Vec<String>, WeldError> {
    let (apart, parts) = joined(blocks);
    let (_, facts) = weld_parts(&apart, &parts, &Frame::metres(), 0.0, u64::MAX)?;
    Ok(warnings(&facts, &parts).iter().map(ToString::to_string).collect())
}

pub fn write_all(folder: &Path, blocks: &[MemorySurface]) -> Vec<PathBuf> {
    let write = |(i, block): (usize, &MemorySurface)| {
        let path = folder.join(format!("block{i}.ply"));
        write_ply(&path, block);
        path
    };
    blocks.iter().enumerate().map(write).collect()
}

/// The Otira mesh, whose vertices are three doubles and a normal.
pub fn otira() -> Option<(PathBuf, MemorySurface)> {
    let path = crate::support::data("otira/otira_poisson.ply")?;
    let (reach, _) = Reach::open(std::slice::from_ref(&path), &InputSettings::default(), &|_, _| {}).unwrap();
    let file = &reach.files()[0];
    let double = |record: &[u8], i: usize| f64::from_le_bytes(record[8 * i..8 * i + 8].try_into().unwrap());
    let position = |v: u64| DVec3::from_array([0, 1, 2].map(|i| double(file.vertex_record(v), i)));
    let surface = MemorySurface {
        positions: (0..reach.vertices()).map(position).collect(),
        triangles: (0..reach.triangles()).map(|t| reach.triangle(t)).collect(),
        colors: Vec::new(),
    };
    Some((path, surface))
}
