//! Bytes read as OFF.
#![no_main]

mod foreign;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| foreign::read(bytes, nearmiss::io::Format::Off));
