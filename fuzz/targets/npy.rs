//! Bytes read as a NumPy array.
#![no_main]

mod foreign;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| foreign::read(bytes, nearmiss::io::Format::Npy));
