//! What a long run says while it works. The library speaks to this trait; the command line draws bars,
//! plain lines or JSON.

use serde::Serialize;

/// What a stage counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Bytes of input.
    Bytes,
    /// Vertices.
    Vertices,
    /// Triangles.
    Triangles,
    /// Output files.
    Files,
}

impl Unit {
    /// The word for many.
    pub fn name(self) -> &'static str {
        match self {
            Unit::Bytes => "bytes",
            Unit::Vertices => "vertices",
            Unit::Triangles => "triangles",
            Unit::Files => "files",
        }
    }
}

/// Listens to a run.
pub trait Progress: Sync {
    /// A stage begins, with so much to do.
    fn begin(&self, stage: &'static str, total: u64, unit: Unit);
    /// So much more is done.
    fn advance(&self, amount: u64);
    /// The stage ended.
    fn end(&self);
    /// Something worth knowing.
    fn note(&self, text: &str);
    /// Something that may make the result wrong.
    fn warn(&self, text: &str);
}

/// Says nothing.
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _: &'static str, _: u64, _: Unit) {}
    fn advance(&self, _: u64) {}
    fn end(&self) {}
    fn note(&self, _: &str) {}
    fn warn(&self, _: &str) {}
}
