#![no_main]

#[path = "../checks/ply.rs"]
mod ply;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| ply::check(bytes));
