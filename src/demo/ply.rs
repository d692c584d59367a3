//! The scene on disk: a binary PLY mesh and the table of the true stones.

use super::scene::Scene;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes the mesh as binary little-endian PLY: float x, y, z (metres), uchar red, green, blue, and
/// list uchar int vertex_indices.
///
/// # Errors
/// The file cannot be created or written.
pub fn write_ply(scene: &Scene, path: &Path) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment sample scene with known pebbles, metres\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        scene.vertices.len(),
        scene.triangles.len()
    )?;
    for (vertex, color) in scene.vertices.iter().zip(&scene.colors) {
        for coordinate in vertex {
            out.write_all(&coordinate.to_le_bytes())?;
        }
        out.write_all(color)?;
    }
    for triangle in &scene.triangles {
        out.write_all(&[3])?;
        for vertex in triangle {
            out.write_all(&vertex.to_le_bytes())?;
        }
    }
    out.flush()
}

/// Writes one row per stone: axes, centre (metres), directions of the axes, areas (m²).
///
/// # Errors
/// The file cannot be created or written.
pub fn write_truth_csv(scene: &Scene, path: &Path) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    writeln!(out, "stone,a_m,b_m,c_m,x,y,z,a_x,a_y,a_z,b_x,b_y,b_z,c_x,c_y,c_z,visible_area_m2,connected_area_m2")?;
    for stone in &scene.stones {
        write!(out, "{}", stone.id)?;
        let directions = stone.directions.iter().flat_map(|d| d.to_array());
        for value in stone.axes_m.into_iter().chain(stone.centre.to_array()).chain(directions) {
            write!(out, ",{value:.6}")?;
        }
        writeln!(out, ",{:.4e},{:.4e}", stone.visible_area_m2, stone.connected_area_m2)?;
    }
    out.flush()
}
