#![no_main]

#[path = "../checks/las.rs"]
mod las;
#[path = "../checks/ply.rs"]
mod ply;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| las::check(bytes));
