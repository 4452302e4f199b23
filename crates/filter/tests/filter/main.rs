//! Filters: everything is one program, which links once.

mod threads;
mod twin;
