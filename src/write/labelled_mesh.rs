//! `labelled_mesh.ply`: the input mesh again, with the grain of every face and vertex.
//!
//! Binary little-endian PLY in the input's own coordinates. Vertices keep their scalar properties byte for
//! byte and get `int grain_id`; faces are `list uchar uint vertex_indices` (a wider count where a polygon
//! needs it), `int grain_id` and a colour per grain. Properties of faces and lists of vertices are not
//! carried over.

use super::{Results, WriteError, atomic::Pending};
use std::fs::File;
use std::io::{BufWriter, Write};

/// No grain.
const NONE: i32 = -1;

/// A mesh that can be read again, vertex by vertex and face by face. Counts have been checked against the
/// size of the file.
pub trait MeshSource: Sync {
    /// Number of vertices.
    fn vertices(&self) -> u64;
    /// Number of faces, polygons of any size.
    fn faces(&self) -> u64;
    /// Name and PLY type (`char` to `double`, or `int8` to `float64`) of the vertices' scalar properties.
    fn vertex_properties(&self) -> Vec<(String, &'static str)>;
    /// Appends the little-endian bytes of these properties of one vertex.
    fn vertex_record(&self, vertex: u64, out: &mut Vec<u8>);
    /// Appends the vertices of one face.
    fn face_corners(&self, face: u64, out: &mut Vec<u64>);
    /// Face of a triangle; never smaller than that of the triangle before.
    fn face_of(&self, triangle: u64) -> u64;
    /// Number of triangles, with polygons cut into fans.
    fn triangles(&self) -> u64;
}

/// Writes the mesh in two passes over its faces: the vertices come first in the file, and theirs are the
/// labels of the faces around them.
pub(crate) fn write(file: &Pending, results: &Results, mesh: &dyn MeshSource) -> Result<(), WriteError> {
    let properties = mesh.vertex_properties();
    let record_bytes = record_bytes(&properties)?;
    if mesh.vertices() > u64::from(u32::MAX) {
        return Err(WriteError::TooManyVertices { vertices: mesh.vertices() });
    }
    let triangles = triangle_labels(results, mesh)?;
    let (vertices, most_corners) = vertex_labels(mesh, &triangles)?;
    let failed = |source| file.error("write the labelled mesh", source);
    let mut out = BufWriter::with_capacity(1 << 20, File::create(&file.partial).map_err(failed)?);
    out.write_all(header(results, mesh, &properties, most_corners).as_bytes()).map_err(failed)?;
    let mut record = Vec::new();
    for vertex in 0..mesh.vertices() {
        record.clear();
        mesh.vertex_record(vertex, &mut record);
        if record.len() != record_bytes {
            return Err(WriteError::RecordLength { vertex, expected: record_bytes, found: record.len() });
        }
        record.extend(vertices[vertex as usize].to_le_bytes());
        out.write_all(&record).map_err(failed)?;
    }
    each_face(mesh, &triangles, |corners, label| {
        record.clear();
        put_face(&mut record, corners, label, most_corners);
        out.write_all(&record).map_err(failed)
    })?;
    out.flush().map_err(failed)
}

/// The lowest grain of the faces around each vertex, and the corners of the largest face.
pub(super) fn vertex_labels(mesh: &dyn MeshSource, triangles: &[i32]) -> Result<(Vec<i32>, usize), WriteError> {
    let mut vertices = labels(mesh.vertices(), "vertices")?;
    let mut most_corners = 0;
    each_face(mesh, triangles, |corners, label| {
        most_corners = most_corners.max(corners.len());
        for &corner in corners {
            let of_vertex = &mut vertices[corner as usize];
            if label != NONE && (*of_vertex == NONE || label < *of_vertex) {
                *of_vertex = label;
            }
        }
        Ok(())
    })?;
    Ok((vertices, most_corners))
}

/// Bytes of a vertex record.
fn record_bytes(properties: &[(String, &'static str)]) -> Result<usize, WriteError> {
    properties
        .iter()
        .map(|(name, ply_type)| match *ply_type {
            "char" | "uchar" | "int8" | "uint8" => Ok(1),
            "short" | "ushort" | "int16" | "uint16" => Ok(2),
            "int" | "uint" | "float" | "int32" | "uint32" | "float32" => Ok(4),
            "double" | "float64" => Ok(8),
            other => Err(WriteError::PropertyType { name: name.clone(), ply_type: other.to_owned() }),
        })
        .sum()
}

fn labels(items: u64, what: &'static str) -> Result<Vec<i32>, WriteError> {
    let too_much = || WriteError::LabelMemory { items, what, bytes: items.saturating_mul(4) };
    let length = usize::try_from(items).map_err(|_| too_much())?;
    let mut labels = Vec::new();
    labels.try_reserve_exact(length).map_err(|_| too_much())?;
    labels.resize(length, NONE);
    Ok(labels)
}

/// The grain of every triangle.
pub(super) fn triangle_labels(results: &Results, mesh: &dyn MeshSource) -> Result<Vec<i32>, WriteError> {
    let mut of_triangle = labels(mesh.triangles(), "triangles")?;
    for numbered in &results.catalogue.grains {
        let grain_id = numbered.grain_id;
        let label = i32::try_from(grain_id)
            .map_err(|_| WriteError::TooManyGrains { grains: results.catalogue.grains.len() as u64 })?;
        for &triangle in &numbered.grain.triangle_ids {
            let place = usize::try_from(triangle).ok().and_then(|t| of_triangle.get_mut(t));
            let triangles = mesh.triangles();
            *place.ok_or(WriteError::UnknownTriangle { grain_id, triangle, triangles })? = label;
        }
    }
    Ok(of_triangle)
}

/// Calls `work` with the corners of every face and the label that most of its triangles have
/// (the first of them in case of a tie).
fn each_face(
    mesh: &dyn MeshSource,
    labels: &[i32],
    mut work: impl FnMut(&[u64], i32) -> Result<(), WriteError>,
) -> Result<(), WriteError> {
    let (faces, vertices) = (mesh.faces(), mesh.vertices());
    let (mut corners, mut of_face) = (Vec::new(), Vec::new());
    let mut triangle = 0u64;
    for face in 0..faces {
        corners.clear();
        mesh.face_corners(face, &mut corners);
        if let Some(&vertex) = corners.iter().find(|&&v| v >= vertices) {
            return Err(WriteError::CornerOutOfRange { face, vertex, vertices });
        }
        of_face.clear();
        while let Some(&label) = labels.get(triangle as usize) {
            let owner = mesh.face_of(triangle);
            if owner < face || owner >= faces {
                return Err(WriteError::TriangleOutOfOrder { triangle, face: owner, faces });
            }
            if owner > face {
                break;
            }
            of_face.push(label);
            triangle += 1;
        }
        work(&corners, most_common(&of_face))?;
    }
    Ok(())
}

fn most_common(labels: &[i32]) -> i32 {
    let mut best = (NONE, 0);
    for (place, &label) in labels.iter().enumerate() {
        if labels[..place].contains(&label) {
            continue;
        }
        let count = labels[place..].iter().filter(|&&l| l == label).count();
        if count > best.1 {
            best = (label, count);
        }
    }
    best.0
}

fn count_type(most_corners: usize) -> &'static str {
    match most_corners {
        0..=255 => "uchar",
        256..=65535 => "ushort",
        _ => "uint",
    }
}

fn header(results: &Results, mesh: &dyn MeshSource, properties: &[(String, &str)], most_corners: usize) -> String {
    let frame = results.frame;
    let crs = frame.crs.as_ref().map_or("none", |c| c.name.as_str());
    let crs: String = crs.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let [east, north, up] = frame.offset_map;
    let mut text = format!(
        "ply\nformat binary_little_endian 1.0\ncomment {} {}\ncomment crs {crs}\ncomment offset {east} {north} {up}\n",
        env!("CARGO_PKG_NAME"),
        env!("CARGO_PKG_VERSION"),
    );
    text += &format!("element vertex {}\n", mesh.vertices());
    for (name, ply_type) in properties {
        // A mesh that was labelled before has this property already.
        let prefix = if name == "grain_id" { "input_" } else { "" };
        text += &format!("property {ply_type} {prefix}{name}\n");
    }
    text += &format!("property int grain_id\nelement face {}\n", mesh.faces());
    text += &format!("property list {} uint vertex_indices\nproperty int grain_id\n", count_type(most_corners));
    text += "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    text
}

fn put_face(out: &mut Vec<u8>, corners: &[u64], label: i32, most_corners: usize) {
    match count_type(most_corners) {
        "uchar" => out.push(corners.len() as u8),
        "ushort" => out.extend((corners.len() as u16).to_le_bytes()),
        _ => out.extend((corners.len() as u32).to_le_bytes()),
    }
    corners.iter().for_each(|&c| out.extend((c as u32).to_le_bytes()));
    out.extend(label.to_le_bytes());
    out.extend(color(label));
}

/// A colour per grain: hues step by the golden angle, so that grains with neighbouring numbers differ, in
/// three brightnesses. Grey where there is no grain.
fn color(label: i32) -> [u8; 3] {
    if label == NONE {
        return [200; 3];
    }
    let hue = (f64::from(label) * 0.618_033_988_749_895).fract() * 6.0;
    let value = [0.95, 0.75, 0.55][label.rem_euclid(3) as usize];
    let channel = |shift: f64| {
        let k = (shift + hue).rem_euclid(6.0);
        let share = value * (1.0 - 0.7 * k.min(4.0 - k).clamp(0.0, 1.0));
        (share * 255.0).round() as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}
