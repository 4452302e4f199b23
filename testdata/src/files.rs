//! A small model in every format and encoding, written by code that shares nothing with the
//! readers.

pub mod foreign;
pub mod model;
pub mod plain;

use foreign::{e57, gltf, las, npy, off, stl};
use plain::{Encoding, csv, obj, pcd, ply};

/// Returns the model in all formats, with names of the right ending.
#[must_use]
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("ascii.ply", ply(Encoding::Ascii, "float", "int")),
        ("little.ply", ply(Encoding::Little, "double", "uint")),
        ("big.ply", ply(Encoding::Big, "float", "ushort")),
        ("ascii.pcd", pcd("ascii")),
        ("binary.pcd", pcd("binary")),
        ("compressed.pcd", pcd("binary_compressed")),
        ("table.csv", csv(",")),
        ("table.xyz", csv(" ")),
        ("mesh.obj", obj()),
        ("old.las", las(3, 0, None)),
        ("new.las", las(7, 2, None)),
        ("old.laz", las(3, 1, Some(7))),
        ("new.laz", las(8, 2, Some(7))),
        ("scans.e57", e57()),
        ("array.npy", npy("<f8")),
        ("text.stl", stl(true)),
        ("binary.stl", stl(false)),
        ("sheet.off", off()),
        ("sheet.gltf", gltf(false)),
        ("sheet.glb", gltf(true)),
    ]
}
