//! The labels that are to be scored: the grain of each triangle.

use super::arrays::{Archive, read_npy};
use super::error::ValidateError;
use super::truth::open_metres;
use crate::open::{LABEL_NAMES, Reach, Scalar, ScalarProperty, SurveyFile};
use std::path::{Path, PathBuf};

/// What a run writes with --labelled-mesh.
const LABELLED_MESH: &str = "labelled_mesh.ply";

/// The grain of each triangle.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Labels {
    /// Any number for each grain, negative for none, for each triangle.
    pub of_triangle: Vec<i64>,
    /// The same for each vertex, if the labels are of vertices: then the vertices of a grain are those of its label.
    pub of_vertex: Option<Vec<i64>>,
}

impl Labels {
    /// Labels of triangles.
    pub fn of_triangles(of_triangle: Vec<i64>) -> Labels {
        Labels { of_triangle, of_vertex: None }
    }

    /// Labels of vertices: a triangle is of the grain that two of its vertices have.
    pub fn of_vertices(of_vertex: Vec<i64>, triangles: &[[u32; 3]]) -> Labels {
        let two_of = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| of_vertex[v as usize]);
            if a == b || a == c {
                a
            } else if b == c {
                b
            } else {
                -1
            }
        };
        Labels { of_triangle: triangles.iter().map(two_of).collect(), of_vertex: Some(of_vertex) }
    }

    /// The same labels where 0 is no grain.
    pub fn zero_is_none(mut self) -> Labels {
        let lift = |label: &mut i64| *label = if *label == 0 { -1 } else { *label };
        self.of_triangle.iter_mut().for_each(lift);
        self.of_vertex.iter_mut().flatten().for_each(lift);
        self
    }
}

/// The file that holds the labels: of a folder, the labelled mesh of the run.
///
/// # Errors
/// Nothing is there, or the run has no labelled mesh.
pub(super) fn label_file(run: &Path) -> Result<PathBuf, ValidateError> {
    if run.is_file() {
        return Ok(run.to_owned());
    }
    if !run.is_dir() {
        return Err(ValidateError::RunMissing { path: run.to_owned() });
    }
    let mesh = run.join(LABELLED_MESH);
    if mesh.is_file() {
        return Ok(mesh);
    }
    Err(ValidateError::NoLabelledMesh { folder: run.to_owned(), file: LABELLED_MESH })
}

/// Reads the labels of a scene: of its triangles, of its faces, or of its vertices, whichever the file has.
///
/// # Errors
/// A damaged file, one without labels, or with another number of them.
pub(super) fn read_labels(path: &Path, scene: &Reach, triangles: &[[u32; 3]]) -> Result<Labels, ValidateError> {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    let found =
        |n: u64| if fits(scene, n) { Ok(()) } else { Err(count_error(path, format!("it has {n} labels"), scene)) };
    let numbers = match extension.as_ref().and_then(|e| e.to_str()) {
        Some("npy") => read_npy(path, found)?,
        Some("npz") => {
            let mut archive = Archive::open(path)?;
            let first = archive.names.first().cloned().unwrap_or_else(|| "labels".to_owned());
            archive.read(&first, found)?
        }
        _ => read_ply(path, scene)?,
    };
    Ok(labels_of(numbers, scene, triangles))
}

fn fits(scene: &Reach, count: u64) -> bool {
    [scene.triangles(), scene.faces(), scene.vertices()].contains(&count)
}

/// Brings numbers of triangles, faces or vertices, of which there are as many, to triangles.
fn labels_of(numbers: Vec<i64>, scene: &Reach, triangles: &[[u32; 3]]) -> Labels {
    let count = numbers.len() as u64;
    if count == scene.triangles() {
        Labels::of_triangles(numbers)
    } else if count == scene.faces() {
        // Polygons are cut into triangles, all of the polygon's grain.
        let of_face = |triangle: u64| numbers[scene.face_of(triangle) as usize];
        Labels::of_triangles((0..scene.triangles()).map(of_face).collect())
    } else {
        Labels::of_vertices(numbers, triangles)
    }
}

fn count_error(path: &Path, found: String, scene: &Reach) -> ValidateError {
    ValidateError::LabelCount { path: path.to_owned(), found, triangles: scene.triangles(), vertices: scene.vertices() }
}

/// The labels of the faces of a PLY file, else of its vertices.
fn read_ply(path: &Path, scene: &Reach) -> Result<Vec<i64>, ValidateError> {
    let reach = open_metres(path)?;
    let [file] = reach.files() else { return Err(no_labels(path)) };
    let property = |name: &&str| file.vertex_properties().iter().find(|p| p.name == **name);
    let vertex_label = LABEL_NAMES.iter().find_map(property);
    let face_label = file.face_label();
    if face_label.is_none() && vertex_label.is_none() {
        return Err(no_labels(path));
    }
    let fits_faces = [scene.triangles(), scene.faces()].contains(&file.faces());
    match (face_label, vertex_label) {
        (Some((name, scalar)), _) if fits_faces => {
            let number = |face| file.face_label_of(face).unwrap_or(-1.0);
            let label = |face| whole(number(face), scalar).ok_or((face, number(face)));
            let labels: Result<Vec<i64>, _> = (0..file.faces()).map(label).collect();
            labels.map_err(|(index, value)| label_error(path, name, ("face", index), value))
        }
        (_, Some(property)) if file.vertices() == scene.vertices() => vertex_labels(path, file, property),
        _ => {
            let found = format!("it has {} faces and {} vertices", file.faces(), file.vertices());
            Err(count_error(path, found, scene))
        }
    }
}

fn vertex_labels(path: &Path, file: &SurveyFile, property: &ScalarProperty) -> Result<Vec<i64>, ValidateError> {
    let number = |vertex| property.scalar.number(&file.vertex_record(vertex)[property.offset..]);
    let label = |vertex| whole(number(vertex), property.scalar).ok_or((vertex, number(vertex)));
    let labels: Result<Vec<i64>, _> = (0..file.vertices()).map(label).collect();
    labels.map_err(|(index, value)| label_error(path, &property.name, ("vertex", index), value))
}

/// A label as a whole number. Floats that are whole are labels too, and no number is no grain. Unsigned numbers far above
/// any count are -1 that lost its sign.
fn whole(number: f64, scalar: Scalar) -> Option<i64> {
    let is_unsigned = matches!(scalar, Scalar::U32 | Scalar::U64);
    if number.is_nan() || is_unsigned && number > f64::from(1u32 << 31) {
        return Some(-1);
    }
    (number.fract() == 0.0).then_some(number as i64)
}

fn no_labels(path: &Path) -> ValidateError {
    ValidateError::NoLabels { path: path.to_owned(), names: LABEL_NAMES.join(", ") }
}

fn label_error(path: &Path, property: &str, (element, index): (&'static str, u64), value: f64) -> ValidateError {
    ValidateError::LabelValue { path: path.to_owned(), property: property.to_owned(), element, index, value }
}
