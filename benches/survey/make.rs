//! A bed as a file: binary little-endian PLY as surveys come, and beside it a table of its stones.

use crate::bed::Bed;
use crate::random::Permutation;
use std::fs::File;
use std::io::{BufWriter, Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};

/// Purposes of the two orders; those up to 8 are the bed's.
const VERTEX_ORDER: u64 = 9;
const TRIANGLE_ORDER: u64 = 10;

/// Writes a bed of about so many triangles, and its stones to the same name with `.csv`. Both appear under
/// their names only when they are complete. Returns the number of triangles.
///
/// With `shuffle`, vertices and triangles are the same but in random order; corners keep theirs.
pub(crate) fn make(path: &Path, seed: u64, triangles: u64, shuffle: bool) -> Result<u64> {
    let bed = Bed::new(seed, triangles);
    if bed.vertices() > i32::MAX as u64 {
        let most = format!("{} vertices, but PLY faces number at most {}", bed.vertices(), i32::MAX);
        return Err(Error::new(ErrorKind::InvalidInput, most));
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let partial = |path: &Path| PathBuf::from(format!("{}.partial", path.display()));
    let table = path.with_extension("csv");
    let shown = write_mesh(&partial(path), &bed, seed, shuffle)?;
    write_stones(&partial(&table), &bed, &shown)?;
    std::fs::rename(partial(&table), table)?;
    std::fs::rename(partial(path), path)?;
    Ok(bed.triangles())
}

/// What shows of one stone.
#[derive(Clone, Copy, Default)]
struct Shown {
    vertices: u64,
    /// Sums of their coordinates in plan, metres.
    sum_m: [f64; 2],
}

/// Returns what shows of each stone.
fn write_mesh(path: &Path, bed: &Bed, seed: u64, shuffle: bool) -> Result<Vec<Shown>> {
    let (vertices, triangles) = (bed.vertices(), bed.triangles());
    let vertex_order = Permutation::new(seed, VERTEX_ORDER, vertices);
    let triangle_order = Permutation::new(seed, TRIANGLE_ORDER, triangles);
    let mut shown = vec![Shown::default(); bed.stones().all().len()];
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment gravel on sand, seed {seed}, metres\n\
         element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {triangles}\nproperty list uchar int vertex_indices\nend_header\n"
    )?;
    for place in 0..vertices {
        let vertex = bed.vertex(if shuffle { vertex_order.backward(place) } else { place });
        let mut record = [0; 15];
        record.chunks_exact_mut(4).zip(vertex.position_m).for_each(|(b, p)| b.copy_from_slice(&p.to_le_bytes()));
        record[12..].copy_from_slice(&vertex.color);
        out.write_all(&record)?;
        if let Some(stone) = vertex.stone {
            shown[stone].vertices += 1;
            shown[stone].sum_m.iter_mut().zip(vertex.position_m).for_each(|(sum, p)| *sum += f64::from(p));
        }
    }
    for place in 0..triangles {
        let corners = bed.triangle(if shuffle { triangle_order.backward(place) } else { place });
        let mut record = [3; 13];
        for (bytes, corner) in record[1..].chunks_exact_mut(4).zip(corners) {
            let place = if shuffle { vertex_order.forward(corner) } else { corner };
            bytes.copy_from_slice(&(place as i32).to_le_bytes());
        }
        out.write_all(&record)?;
    }
    out.into_inner()?.sync_all()?;
    Ok(shown)
}

/// The stones of which something shows.
fn write_stones(path: &Path, bed: &Bed, shown: &[Shown]) -> Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    writeln!(out, "x_m,y_m,top_m,cap_a_semi_axis_m,cap_b_semi_axis_m,visible_vertices,visible_x_m,visible_y_m")?;
    for (stone, seen) in bed.stones().all().iter().zip(shown).filter(|(_, seen)| seen.vertices > 0) {
        let ([x, y], [a, b]) = (stone.center_m, stone.semi_m);
        let Shown { vertices, sum_m } = seen;
        let [mean_x, mean_y] = sum_m.map(|sum| sum / *vertices as f64);
        write!(out, "{x:.6},{y:.6},{:.6},{a:.6},{b:.6},", stone.top_m)?;
        writeln!(out, "{vertices},{mean_x:.6},{mean_y:.6}")?;
    }
    out.flush()
}
