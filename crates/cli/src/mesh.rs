//! Prepared meshes: how they are opened, the queries about two of them, and reports.

pub(crate) mod args;
pub(crate) mod collide;
pub(crate) mod contacts;
pub(crate) mod distance;
pub(crate) mod open;
pub(crate) mod picture;
pub(crate) mod report;
pub(crate) mod two_meshes;
pub(crate) mod words;
