//! Which triangles touch along an edge, and what hangs together.

/// No triangle: the edge is a border of the mesh.
pub(super) const BORDER: u32 = u32::MAX;

/// The triangle across each of the three edges (vertices 0-1, 1-2, 2-0) of every triangle.
///
/// An edge of more than two triangles counts as a border of all of them.
pub(super) fn neighbours(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut sides: Vec<(u32, u32, u32, u8)> = Vec::with_capacity(3 * triangles.len());
    for (id, triangle) in triangles.iter().enumerate() {
        for side in 0..3u8 {
            let (from, to) = (triangle[usize::from(side)], triangle[usize::from(side + 1) % 3]);
            sides.push((from.min(to), from.max(to), id as u32, side));
        }
    }
    sides.sort_unstable();
    let mut across = vec![[BORDER; 3]; triangles.len()];
    for group in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        if let [first, second] = group {
            across[first.2 as usize][usize::from(first.3)] = second.2;
            across[second.2 as usize][usize::from(second.3)] = first.2;
        }
    }
    across
}

/// Numbers the parts that hang together along edges between triangles of the same class.
pub(super) fn components<C: PartialEq>(across: &[[u32; 3]], class: &[C]) -> (Vec<u32>, u32) {
    let mut part = vec![BORDER; across.len()];
    let mut count = 0;
    let mut stack = Vec::new();
    for start in 0..across.len() {
        if part[start] != BORDER {
            continue;
        }
        part[start] = count;
        stack.push(start);
        while let Some(at) = stack.pop() {
            for &next in &across[at] {
                let next = next as usize;
                if next < across.len() && part[next] == BORDER && class[next] == class[at] {
                    part[next] = count;
                    stack.push(next);
                }
            }
        }
        count += 1;
    }
    (part, count)
}

/// How many triangles each part has.
pub(super) fn sizes(part: &[u32], count: u32) -> Vec<usize> {
    let mut size = vec![0; count as usize];
    part.iter().for_each(|&p| size[p as usize] += 1);
    size
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_that_share_an_edge_are_one_part_unless_their_classes_differ() {
        let across = neighbours(&[[0, 1, 2], [2, 1, 3], [4, 5, 6]]);
        assert_eq!(across[0], [BORDER, 1, BORDER]);
        assert_eq!(components(&across, &[0, 0, 0]), (vec![0, 0, 1], 2));
        assert_eq!(components(&across, &[0, 1, 0]).1, 3);
    }
}
