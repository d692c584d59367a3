//! Bodies: the convex components that are left, told apart from crumbs and bedrock.

use super::Sizes;
use super::adjacency::Adjacency;
use super::components::{Components, Forest};
use super::state::{Labels, NONE, OVERSIZE, State, unknown};
use crate::settings::SegmentSettings;
use crate::tile::TileMesh;

/// What becomes of a component.
#[derive(Clone, Copy)]
enum Fate {
    Gone,
    Unknown,
    Body(u32),
}

/// Removes components smaller than the smallest grain, and labels the others by their lowest triangle.
///
/// A component wider than `max_grain_m` is [`OVERSIZE`], known as soon as the part that is seen is wide
/// enough. Every other component that is not whole is unknown from here on.
pub fn tell_apart(
    mesh: &TileMesh,
    adjacency: &Adjacency,
    sizes: &Sizes,
    mut state: Vec<State>,
    settings: &SegmentSettings,
) -> Labels {
    // Whatever the truth is, a body contains its kept component, and lies within the possible one.
    let kept = Components::sized(mesh, adjacency, sizes, |t| state[t] == State::Kept);
    let size = kept.size.clone();
    let open = kept.holding(adjacency.open());
    let unknown = unknown(&state);
    let doubtful = kept.beside(adjacency, &unknown);
    let wide = kept.wider_than(mesh, settings.max_grain_m, |part| size[part] >= sizes.smallest);
    let fate: Vec<Fate> = (0..kept.count())
        .map(|part| match (size[part] >= sizes.smallest, !open[part] && !doubtful[part]) {
            (true, _) if wide[part] => Fate::Body(OVERSIZE),
            (true, true) => Fate::Body(kept.lowest[part]),
            (false, true) => Fate::Gone,
            (_, false) => Fate::Unknown,
        })
        .collect();
    let Possible { node: mut label, too_small } = Possible::of(mesh, adjacency, sizes, &unknown, kept.of, (size, open));
    let mut start = 0;
    while let Some(&node) = label.get(start) {
        // Triangles of one node mostly follow one another.
        let run = label[start..].iter().take_while(|other| **other == node).count();
        let here = start..start + run;
        start = here.end;
        if node == NONE {
            continue;
        }
        let fate =
            if too_small[node as usize] { Fate::Gone } else { *fate.get(node as usize).unwrap_or(&Fate::Unknown) };
        let (becomes, body) = match fate {
            Fate::Gone => (State::Removed, NONE),
            Fate::Unknown => (State::Unknown, NONE),
            Fate::Body(body) => (State::Kept, body),
        };
        state[here.clone()].fill(becomes);
        label[here].fill(body);
    }
    Labels { state, label }
}

/// The most that bodies can be: kept components, joined by the unknown triangles beside them.
struct Possible {
    /// Kept component of each triangle; unknown triangles are numbered after these; [`NONE`] for removed ones.
    node: Vec<u32>,
    /// Whether a node is smaller than the smallest grain together with all that could belong to it.
    too_small: Vec<bool>,
}

impl Possible {
    /// `size` and `open` are of the kept components, whose numbers `node` holds.
    fn of(
        mesh: &TileMesh,
        adjacency: &Adjacency,
        sizes: &Sizes,
        unknown: &[u32],
        mut node: Vec<u32>,
        (mut size, mut open): (Vec<u64>, Vec<bool>),
    ) -> Possible {
        let kept = size.len();
        let mut parent: Vec<u32> = (0..(kept + unknown.len()) as u32).collect();
        let mut forest = Forest { first: 0, parent: &mut parent };
        for (i, &t) in unknown.iter().enumerate() {
            node[t as usize] = (kept + i) as u32;
        }
        for &t in unknown {
            for side in adjacency.sides(t as usize).map(|s| node[s as usize]).into_iter().filter(|&s| s != NONE) {
                forest.join(node[t as usize], side);
            }
        }
        for fork in adjacency.forks() {
            forest.join_all(fork.iter().map(|&t| node[t as usize]).filter(|&i| i != NONE));
        }
        // Roots are the lowest of their nodes, so what a node adds goes to one that is summed already.
        let nodes = forest.parent.len();
        size.resize(nodes, 0);
        open.resize(nodes, false);
        adjacency.open().iter().map(|&t| node[t as usize]).filter(|&i| i != NONE).for_each(|i| open[i as usize] = true);
        for i in 0..nodes {
            let whole = forest.root(i as u32) as usize;
            forest.parent[i] = whole as u32;
            open[whole] |= open[i];
            if i < kept && whole != i {
                size[whole] = size[whole].saturating_add(size[i]);
            } else if i >= kept && size[whole] < sizes.smallest {
                size[whole] += sizes.of(mesh, unknown[i - kept]);
            }
        }
        let too_small = parent.iter().map(|&whole| !open[whole as usize] && size[whole as usize] < sizes.smallest);
        Possible { node, too_small: too_small.collect() }
    }
}
