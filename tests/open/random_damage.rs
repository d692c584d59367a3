//! Damaged files are read or refused, never more.

use crate::open_bytes;
use crate::ply_bytes::{Element, axis, corner_lists, faces, file, vertices};
use proptest::prelude::*;

/// A file with everything: unknown elements, lists, polygons, colours.
fn rich() -> Vec<u8> {
    let camera = Element::new("camera").lists("list uchar float view", [vec![1.0, 2.0]]);
    let colored =
        ["red", "green", "blue"].iter().fold(vertices(), |e, name| e.numbers(&format!("float {name}"), [0.5; 5]));
    let viewed = colored.lists("list uchar uint views", (0..5).map(|i| vec![1.0; i]));
    let mut lists: Vec<Vec<f64>> = corner_lists().collect();
    lists[1] = vec![0.0, 1.0, 2.0, 3.0];
    let faces = Element::new("face")
        .lists("list char short texture", axis(0).take(4).map(|_| vec![1.0]))
        .lists("list short int vertex_indices", lists);
    file(&[&camera, &viewed, &faces])
}

fn look_at_everything(bytes: &[u8]) {
    match open_bytes(bytes) {
        Err(error) => assert!(error.to_string().contains("reach.ply: "), "{error}"),
        Ok((reach, _)) => {
            for triangle in 0..reach.triangles() {
                for vertex in reach.triangle(triangle) {
                    assert!(reach.position(vertex).is_finite());
                    reach.color(vertex);
                }
                let file = &reach.files()[0];
                assert!(file.face_corners(reach.face_of(triangle)).all(|v| v < reach.vertices()));
            }
            (0..reach.vertices()).for_each(|v| assert!(!reach.files()[0].vertex_record(v).is_empty()));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_and_cut_ends_never_panic(
        which in any::<bool>(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = if which { rich() } else { file(&[&vertices(), &faces()]) };
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len() + 1));
        }
        look_at_everything(&bytes);
    }
}

#[test]
fn every_truncation_of_a_rich_file_is_refused() {
    let whole = rich();
    look_at_everything(&whole);
    open_bytes(&whole).expect("the whole file is fine");
    for end in 0..whole.len() {
        assert!(open_bytes(&whole[..end]).is_err(), "cut at byte {end} of {}", whole.len());
        look_at_everything(&whole[..end]);
    }
}
