//! Tests of the filters, in one program so that they link once.

mod threads;
mod twin;
