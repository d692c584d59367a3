//! Any bytes are known stones, or labels, or are refused by name.

use gravelometer::validate::{Validation, validate};
use std::path::Path;

const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
    element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0.2\n0 1 0\n3 0 1 2\n3 0 2 3\n";
const FILES: [(&str, &[u8]); 4] = [
    ("truth.npz", include_bytes!("../seeds/truth/truth.npz")),
    ("truth.csv", include_bytes!("../seeds/truth/truth.csv")),
    ("labels.npy", include_bytes!("../seeds/truth/labels.npy")),
    ("labels.npz", include_bytes!("../seeds/truth/truth.npz")),
];

/// Puts the bytes into the place of each file in turn; the others are good.
pub(crate) fn check(bytes: &[u8]) {
    for (name, _) in FILES {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("mesh.ply"), MESH).expect("room");
        FILES.iter().for_each(|(other, good)| std::fs::write(path(other), good).expect("room"));
        std::fs::write(path(name), bytes).expect("room");
        let labels = if name.starts_with("labels") { name } else { "labels.npy" };
        score(&path(labels), folder.path(), name);
    }
}

fn score(labels: &Path, truth: &Path, changed: &str) {
    let what = Validation { run: labels.to_owned(), truth: truth.to_owned(), ..Validation::default() };
    match validate(&what) {
        Ok(validated) => {
            let counts = validated.report.score.detection_majority;
            assert_eq!(counts.tp + counts.missed, validated.report.score.visible);
            assert!((0.0..=1.0).contains(&counts.f1), "{counts:?}");
        }
        Err(error) => {
            let message = error.to_string();
            // Arrays can be right by themselves and not fit the table.
            let named = message.contains(changed) || changed == "truth.csv" && message.contains("truth.npz");
            assert!(named && message.contains("\nhelp: "), "names file and remedy: {message}");
        }
    }
}
