//! The hierarchy: everything is one program, which links once.

mod apart;
mod coverings;
mod enclosures;
mod kinds;
mod levels;
mod refit;
mod survey;
mod twin;
