//! Bytes opened as a prepared mesh, with corrected checksums, and asked everything. The first byte
//! selects the check, and whether the header is to state the length that the file has.
#![no_main]

#[path = "../../crates/nearmiss/tests/facade/hostile"]
mod hostile {
    pub(crate) mod exercise_mesh;
    pub(crate) mod repair;
}

use std::sync::OnceLock;

use nearmiss::{Check, Mesh, MeshBuildOptions, TriangleMesh};

/// A valid mesh to ask about: a strip that winds upwards.
fn partner() -> &'static Mesh {
    static PARTNER: OnceLock<Mesh> = OnceLock::new();
    PARTNER.get_or_init(|| {
        let point = |i: u8| {
            let (turn, radius) = (f64::from(i) * 0.4, if i % 2 == 0 { 0.6 } else { 0.9 });
            [radius * turn.cos(), radius * turn.sin(), f64::from(i) / 30.0]
        };
        let triangles = (0..28).map(|i| [i, i + 1, i + 2]).collect();
        let mesh = TriangleMesh::new((0..30).map(point).collect(), triangles).expect("vertices that exist");
        Mesh::build(&mesh, &MeshBuildOptions::default()).expect("triangles with areas")
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
    match Mesh::from_bytes(bytes, check) {
        Ok(mesh) => _ = hostile::exercise_mesh::exercise_mesh(&mesh, partner()),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
