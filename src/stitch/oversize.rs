//! Oversize bodies are joined across core borders.

use super::catalogue::Oversize;
use crate::geometry::{ExactSum, PlanBox};
use crate::segment::OversizePiece;

/// Joins pieces that name the same edge.
pub(super) fn join(mut pieces: Vec<OversizePiece>) -> Vec<Oversize> {
    pieces.sort_by_key(|p| p.anchor);
    let mut crossings: Vec<([u64; 2], usize)> =
        pieces.iter().enumerate().flat_map(|(i, p)| p.crossings.iter().map(move |&edge| (edge, i))).collect();
    crossings.sort_unstable();
    let mut parent: Vec<usize> = (0..pieces.len()).collect();
    for same in crossings.chunk_by(|a, b| a.0 == b.0) {
        for pair in same.windows(2) {
            let (a, b) = (root(&parent, pair[0].1), root(&parent, pair[1].1));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut whole: Vec<Option<(Oversize, ExactSum)>> = vec![None; pieces.len()];
    for (i, piece) in pieces.iter().enumerate() {
        let (body, area) = whole[root(&parent, i)].get_or_insert_with(|| {
            let bounds = PlanBox::EMPTY;
            (Oversize { anchor: piece.anchor, triangles: 0, surface_area_m2: 0.0, bounds }, ExactSum::ZERO)
        });
        body.triangles += piece.triangles;
        piece.bounds.iter().for_each(|b| body.bounds.merge(b));
        area.merge(piece.area_m2);
        body.surface_area_m2 = area.value();
    }
    whole.into_iter().flatten().map(|(body, _)| body).collect()
}

/// The lowest piece of a body. Pieces are sorted by anchor, so it carries the body's anchor.
fn root(parent: &[usize], mut i: usize) -> usize {
    while parent[i] != i {
        i = parent[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(anchor: u64, crossings: &[[u64; 2]]) -> OversizePiece {
        OversizePiece { anchor, triangles: 1, crossings: crossings.to_vec(), ..OversizePiece::default() }
    }

    #[test]
    fn pieces_that_cross_the_same_border_are_one_body() {
        let pieces =
            vec![piece(9, &[[4, 9]]), piece(20, &[[1, 2]]), piece(3, &[[4, 9], [5, 30]]), piece(30, &[[5, 30]])];
        let bodies = join(pieces);
        let found: Vec<_> = bodies.iter().map(|b| (b.anchor, b.triangles)).collect();
        assert_eq!(found, [(3, 3), (20, 1)]);
    }
}
