use crate::fixture::{Strip, Survey, new_zealand, survey};
use gravelometer::write::{MeshSource, OutputFolder, WriteError, write_all};

fn write(survey: &Survey, mesh: &Strip) -> Result<Vec<u8>, WriteError> {
    let folder = tempfile::tempdir().expect("temporary folder");
    let out = OutputFolder::create(folder.path(), false, &[]).expect("empty folder");
    write_all(&out, &survey.results(Some(mesh)), &|_| ())?;
    Ok(std::fs::read(folder.path().join("labelled_mesh.ply")).expect("mesh"))
}

/// Faces: a quad of triangles 0 and 1, then triangles 2, 3 and 4.
fn strip() -> Strip {
    Strip { faces: vec![vec![0, 1, 2, 3], vec![2, 3, 4], vec![3, 4, 5], vec![4, 5, 6]], vertices: 7 }
}

fn labelled(triangles: [&[u64]; 2]) -> Survey {
    let mut survey = survey(2, new_zealand());
    for (grain, ids) in survey.catalogue.grains.iter_mut().zip(triangles) {
        grain.grain.triangle_ids = ids.to_vec();
    }
    survey
}

#[test]
fn the_labelled_mesh_keeps_the_vertices_and_adds_a_grain_to_each_face() {
    let bytes = write(&labelled([&[0, 1], &[3]]), &strip()).expect("mesh");
    let end = bytes.windows(11).position(|w| w == b"end_header\n").expect("header") + 11;
    let header = String::from_utf8(bytes[..end].to_vec()).expect("text");
    let expected = format!(
        "ply\nformat binary_little_endian 1.0\ncomment gravelometer {}\n\
         comment crs NZGD2000 / New Zealand Transverse Mercator 2000\ncomment offset 1480000 5250000 700\n\
         element vertex 7\nproperty double x\nproperty float y\nproperty uchar red\nproperty int grain_id\n\
         element face 4\nproperty list uchar uint vertex_indices\nproperty int grain_id\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
        env!("CARGO_PKG_VERSION")
    );
    assert_eq!(header, expected);
    let (vertices, faces) = bytes[end..].split_at(7 * 17);
    let int = |b: &[u8]| i32::from_le_bytes(b.try_into().expect("four bytes"));
    for (v, record) in vertices.chunks_exact(17).enumerate() {
        assert_eq!(record[..8], (v as f64 * 0.5).to_le_bytes());
        assert_eq!(record[8..12], (v as f32 * 0.25).to_le_bytes());
        assert_eq!(record[12], v as u8);
        // Vertices 3, 4, 5 are of grain 2, but 0 to 3 are of grain 1 first.
        assert_eq!(int(&record[13..]), [1, 1, 1, 1, 2, 2, -1][v], "vertex {v}");
    }
    assert_eq!(faces.len(), (1 + 16 + 7) + 3 * (1 + 12 + 7));
    assert_eq!((faces[0], int(&faces[1..5]), int(&faces[13..17]), int(&faces[17..21])), (4, 0, 3, 1));
    let triangle = |f: usize| &faces[24 + 20 * f..44 + 20 * f];
    assert_eq!((triangle(0)[0], int(&triangle(0)[1..5]), int(&triangle(0)[13..17])), (3, 2, -1));
    assert_eq!(triangle(0)[17..], [200, 200, 200]);
    assert_eq!(int(&triangle(1)[13..17]), 2);
    assert_ne!(triangle(1)[17..], faces[21..24]);
}

#[test]
fn a_polygon_takes_the_label_of_most_of_its_triangles_and_the_first_in_a_tie() {
    let pentagon = Strip { faces: vec![vec![0, 1, 2, 3, 4], vec![4, 5, 6, 0]], vertices: 7 };
    // Triangles 0 to 2 are the pentagon, 3 and 4 the quad.
    let bytes = write(&labelled([&[1, 2], &[0, 4]]), &pentagon).expect("mesh");
    let faces = &bytes[bytes.len() - (1 + 20 + 7) - (1 + 16 + 7)..];
    let int = |b: &[u8]| i32::from_le_bytes(b.try_into().expect("four bytes"));
    assert_eq!(int(&faces[21..25]), 1);
    assert_eq!(int(&faces[28 + 17..28 + 21]), -1);
}

#[test]
fn a_polygon_of_300_corners_gets_a_wider_count() {
    let disc = Strip { faces: vec![(0..300).collect()], vertices: 300 };
    let bytes = write(&labelled([&[0], &[]]), &disc).expect("mesh");
    let text = String::from_utf8_lossy(&bytes[..600]);
    assert!(text.contains("property list ushort uint vertex_indices\n"), "{text}");
    let face = &bytes[bytes.len() - (2 + 1200 + 7)..];
    assert_eq!(u16::from_le_bytes([face[0], face[1]]), 300);
}

#[test]
fn a_face_or_a_grain_that_refers_to_nothing_is_named() {
    let broken = Strip { faces: vec![vec![0, 1, 9]], vertices: 3 };
    let error = write(&labelled([&[0], &[]]), &broken).expect_err("vertex 9");
    assert!(matches!(error, WriteError::CornerOutOfRange { face: 0, vertex: 9, vertices: 3 }), "{error}");
    let error = write(&labelled([&[0], &[77]]), &strip()).expect_err("triangle 77");
    assert!(matches!(error, WriteError::UnknownTriangle { grain_id: 2, triangle: 77, triangles: 5 }), "{error}");
}

#[test]
fn a_grain_number_beyond_32_bits_is_refused_in_the_mesh() {
    let mut survey = labelled([&[0], &[1]]);
    survey.catalogue.grains[1].grain_id = 1 << 31;
    let error = write(&survey, &strip()).expect_err("2147483648");
    assert!(matches!(error, WriteError::TooManyGrains { .. }), "{error}");
}

#[test]
fn a_mesh_that_was_labelled_before_keeps_both_numbers() {
    struct Again(Strip);
    impl MeshSource for Again {
        fn vertices(&self) -> u64 {
            self.0.vertices()
        }
        fn faces(&self) -> u64 {
            self.0.faces()
        }
        fn vertex_properties(&self) -> Vec<(String, &'static str)> {
            vec![("x".into(), "float64"), ("y".into(), "float32"), ("grain_id".into(), "uint8")]
        }
        fn vertex_record(&self, v: u64, out: &mut Vec<u8>) {
            self.0.vertex_record(v, out);
        }
        fn face_corners(&self, f: u64, out: &mut Vec<u64>) {
            self.0.face_corners(f, out);
        }
        fn face_of(&self, triangle: u64) -> u64 {
            self.0.face_of(triangle)
        }
        fn triangles(&self) -> u64 {
            self.0.triangles()
        }
    }
    let folder = tempfile::tempdir().expect("temporary folder");
    let out = OutputFolder::create(folder.path(), false, &[]).expect("empty folder");
    let mesh = Again(strip());
    write_all(&out, &labelled([&[0], &[]]).results(Some(&mesh)), &|_| ()).expect("all files");
    let bytes = std::fs::read(folder.path().join("labelled_mesh.ply")).expect("mesh");
    let text = String::from_utf8_lossy(&bytes[..500]);
    assert!(text.contains("property uint8 input_grain_id\nproperty int grain_id\nelement face"), "{text}");
}
