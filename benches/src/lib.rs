//! Benchmarks with rivals.
