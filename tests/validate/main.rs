//! `validate`: the reference scorer's numbers on scenes of the field, theorems on boards of squares, and whatever may be
//! wrong with what people give it.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod agreement;
mod board;
mod damaged;
mod given;
#[path = "../support/mod.rs"]
mod support;
mod theorems;
