#![no_main]

#[path = "../checks/truth.rs"]
mod truth;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| truth::check(bytes));
