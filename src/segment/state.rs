//! Three values: what a tile knows of a triangle.

/// What is known of a triangle at some step of the recipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Not part of any grain.
    Removed,
    /// Part of a body.
    Kept,
    /// The cut at the halo's outer side could have changed it.
    Unknown,
}

/// The triangles of unknown state, ascending.
pub fn unknown(state: &[State]) -> Vec<u32> {
    const BLOCK: usize = 256;
    let mut unknown = Vec::new();
    for (block, first) in state.chunks(BLOCK).zip((0u32..).step_by(BLOCK)) {
        // Most blocks hold none, which is told without a branch for each.
        if block.iter().fold(false, |any, &s| any | (s == State::Unknown)) {
            unknown.extend((first..).zip(block).filter(|(_, s)| **s == State::Unknown).map(|(t, _)| t));
        }
    }
    unknown
}

/// No body. All labels are below 2^31, so that a vertex can carry one and [`UNSURE`] in one number.
pub const NONE: u32 = UNSURE - 1;
/// The one label of all oversize bodies. One for all, because two pieces seen in a tile may be joined
/// beyond its halo: whether they are must not change anything else.
pub const OVERSIZE: u32 = NONE - 1;
/// Set in the label of a vertex where the cut could have changed it.
pub const UNSURE: u32 = 1 << 31;

/// States and labels of a tile's triangles. The label of a kept triangle is the local number of the
/// lowest triangle of its body, once bodies are told apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    /// What is known of each triangle.
    pub state: Vec<State>,
    /// Body of each kept triangle; [`NONE`] for all others.
    pub label: Vec<u32>,
}
