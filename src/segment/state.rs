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

/// No body.
pub const NONE: u32 = u32::MAX;
/// The one label of all oversize bodies. One for all, because two pieces seen in a tile may be joined
/// beyond its halo: whether they are must not change anything else.
pub const OVERSIZE: u32 = u32::MAX - 1;

/// States and labels of a tile's triangles. The label of a kept triangle is the local number of the
/// lowest triangle of its body, once bodies are told apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    /// What is known of each triangle.
    pub state: Vec<State>,
    /// Body of each kept triangle; [`NONE`] for all others.
    pub label: Vec<u32>,
}
