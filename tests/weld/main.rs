//! Several files are one surface: blocks that were cut from a mesh give what the whole mesh gives, byte for byte.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod blocks;
mod borders;
mod runs;
#[path = "../support/mod.rs"]
mod support;
mod twins;
