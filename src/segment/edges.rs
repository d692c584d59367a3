//! Which triangles share an edge, built once per tile.

/// The edges of a mesh, each with all its triangles. Winding is ignored, and an edge with three or more
/// triangles joins them all, as in the authors' program.
pub struct Edges {
    start: Vec<u32>,
    triangles: Vec<u32>,
    ends: Vec<[u32; 2]>,
}

impl Edges {
    /// Finds the edges of triangles over `vertices` vertices: half-edges are sorted by their lower vertex
    /// with a counting sort, then by the other within these short lists.
    pub fn of(triangles: &[[u32; 3]], vertices: usize) -> Edges {
        let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| [a.min(b), a.max(b)]);
        let mut bucket = vec![0u32; vertices + 1];
        for [low, _] in triangles.iter().flat_map(sides) {
            bucket[low as usize + 1] += 1;
        }
        for v in 0..vertices {
            bucket[v + 1] += bucket[v];
        }
        let mut next = bucket.clone();
        let mut half = vec![(0u32, 0u32); triangles.len() * 3];
        for (t, corners) in triangles.iter().enumerate() {
            for [low, high] in sides(corners) {
                half[next[low as usize] as usize] = (high, t as u32);
                next[low as usize] += 1;
            }
        }
        drop(next);
        let mut edges = Edges { start: Vec::new(), triangles: Vec::with_capacity(half.len()), ends: Vec::new() };
        for low in 0..vertices {
            let list = &mut half[bucket[low] as usize..bucket[low + 1] as usize];
            list.sort_unstable();
            let mut last = None;
            for &(high, t) in &*list {
                if last != Some(high) {
                    edges.start.push(edges.triangles.len() as u32);
                    edges.ends.push([low as u32, high]);
                    last = Some(high);
                }
                edges.triangles.push(t);
            }
        }
        edges.start.push(edges.triangles.len() as u32);
        edges
    }

    /// Every edge: its two vertices and its triangles, ascending.
    pub fn iter(&self) -> impl Iterator<Item = ([u32; 2], &[u32])> {
        self.ends
            .iter()
            .zip(self.start.windows(2))
            .map(|(&ends, w)| (ends, &self.triangles[w[0] as usize..w[1] as usize]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_knows_all_its_triangles_whatever_their_winding() {
        let edges = Edges::of(&[[0, 1, 2], [2, 1, 3], [1, 2, 4], [0, 0, 3]], 5);
        let shared: Vec<_> = edges.iter().filter(|(_, t)| t.len() > 1).map(|(e, t)| (e, t.to_vec())).collect();
        assert_eq!(shared, [([0, 3], vec![3, 3]), ([1, 2], vec![0, 1, 2])]);
        assert_eq!(edges.iter().map(|(_, t)| t.len()).sum::<usize>(), 12);
    }
}
