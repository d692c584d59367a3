#![no_main]

#[path = "../checks/offsets.rs"]
mod offsets;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| offsets::check(bytes));
