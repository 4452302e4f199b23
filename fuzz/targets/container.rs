//! Bytes opened as a prepared scan, their checksums made to fit first, and asked everything. The first byte
//! says how much is checked, and whether the header is to state the length that the file has.
#![no_main]

#[path = "../../crates/nearmiss/tests/facade/hostile"]
mod hostile {
    pub(crate) mod exercise;
    pub(crate) mod graph;
    pub(crate) mod repair;
}

use std::sync::OnceLock;

use nearmiss::{BuildOptions, Check, PointCloud, Scan};

/// A sound scan to ask about.
fn partner() -> &'static Scan {
    static PARTNER: OnceLock<Scan> = OnceLock::new();
    PARTNER.get_or_init(|| {
        let point = |i: u8| {
            let (z, turn) = (1.0 - f64::from(i) / 30.0, f64::from(i) * 2.4);
            let rim = (1.0 - z * z).max(0.0).sqrt();
            [rim * turn.cos(), rim * turn.sin(), z]
        };
        let points: Vec<[f64; 3]> = (0..60).map(point).collect();
        let cloud = PointCloud::from_positions(&points).expect("finite points");
        Scan::build(&cloud, &BuildOptions::default()).expect("sound options")
    })
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let [how, bytes @ ..] = bytes else { return };
    let mut bytes = bytes.to_vec();
    if how & 2 != 0 && bytes.len() >= hostile::repair::HEADER {
        bytes.resize(bytes.len().next_multiple_of(64), 0);
        let length = bytes.len() as u64;
        bytes[24..32].copy_from_slice(&length.to_le_bytes());
    }
    hostile::repair::repair(&mut bytes);
    let check = if how & 1 == 0 { Check::Structure } else { Check::Full };
    match Scan::from_bytes(bytes, check) {
        Ok(scan) => _ = hostile::exercise::exercise(&scan, partner()),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
