//! Tests of queries. All of them are one program, which is linked once.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod all;
mod batch;
mod clashes;
mod coherence;
mod curves;
mod curves_hard;
mod cut;
mod distance;
mod graphed;
mod interpolation;
mod interpolation_leaves;
mod manifold;
mod margin;
mod mesh_clashes;
mod mesh_scan_penetration;
mod mesh_scans;
mod mesh_worlds;
mod meshes;
mod moments;
mod orders;
mod outputs;
mod penetration;
mod rays;
mod scan_penetration;
mod shape_mesh_penetration;
mod shape_pairs;
mod shape_worlds;
mod shapes;
mod solid_contacts;
mod solid_sweeps;
mod solids;
mod sparse;
mod sweeps;
mod twin;
mod world;
