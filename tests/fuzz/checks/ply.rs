//! Any bytes are a survey or are refused by name, and what is read of a survey is as promised.

use gravelometer::open::Reach;
use gravelometer::settings::InputSettings;
use std::io::Write;

/// Opens the bytes as a PLY file and reads everything in it.
pub(crate) fn check(bytes: &[u8]) {
    let mut file = tempfile::Builder::new().prefix("reach").suffix(".ply").tempfile().expect("a file");
    file.write_all(bytes).expect("room");
    let reach = match Reach::open(&[file.path().to_owned()], &InputSettings::default(), &|_, _| {}) {
        Ok((reach, warnings)) => {
            warnings.iter().for_each(|w| assert!(w.to_string().contains("reach"), "{w}"));
            reach
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.contains("reach") && message.contains("\nhelp: "), "names file and remedy: {message}");
            return;
        }
    };
    let (min, max) = reach.input_bounds();
    assert!((0..3).all(|axis| min[axis] <= max[axis]), "{min:?} to {max:?}");
    let of_file = &reach.files()[0];
    for vertex in 0..reach.vertices() {
        let place = reach.position(vertex);
        assert!(place.is_finite() && place.min_element() >= 0.0, "vertex {vertex}: {place}");
        let [r, g, b] = reach.color(vertex).unwrap_or_default();
        assert!([r, g, b].iter().all(|share| (0.0..=1.0).contains(share)), "vertex {vertex}: {r} {g} {b}");
        let numbers: usize = of_file.vertex_properties().iter().map(|p| p.scalar.size()).sum();
        assert_eq!(of_file.vertex_record(vertex).len(), numbers);
    }
    let (mut corners, mut next) = (Vec::new(), 0);
    reach.corner_numbers(0..reach.triangles(), &mut corners);
    for face in 0..reach.faces() {
        assert_eq!(of_file.face_label_of(face).is_some(), of_file.face_label().is_some());
        let of_face: Vec<u64> = of_file.face_corners(face).collect();
        for pair in of_face[1..].windows(2) {
            let triangle = [of_face[0], pair[0], pair[1]];
            assert!(triangle.iter().all(|&v| v < reach.vertices()), "face {face}: {triangle:?}");
            assert_eq!((reach.triangle(next), corners[next as usize], reach.face_of(next)), (triangle, triangle, face));
            next += 1;
        }
    }
    assert_eq!(next, reach.triangles());
}
