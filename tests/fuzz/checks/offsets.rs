//! Any bytes are an offset file or are refused by name, and never move a survey to a place that is no number.

use gravelometer::open::Reach;
use gravelometer::settings::InputSettings;
use std::io::Write;

const TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// Opens a triangle with the bytes as its offset file.
pub(crate) fn check(bytes: &[u8]) {
    let folder = tempfile::tempdir().expect("a folder");
    let (mesh, offset) = (folder.path().join("reach.ply"), folder.path().join("offset.txt"));
    std::fs::write(&mesh, TRIANGLE).expect("room");
    std::fs::File::create(&offset).and_then(|mut file| file.write_all(bytes)).expect("room");
    let input = InputSettings { offset_file: offset.display().to_string(), ..InputSettings::default() };
    match Reach::open(&[mesh], &input, &|_, _| {}) {
        Ok((reach, _)) => {
            let place = reach.frame().position(reach.position(0));
            assert!(place.iter().all(|x| x.is_finite()), "{place:?}");
        }
        Err(error) => assert!(error.to_string().contains("\nhelp: "), "names a remedy: {error}"),
    }
}
