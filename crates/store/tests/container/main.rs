//! Tests of the container through the public interface.

#![cfg(test)]

mod attacks;
mod damage;
mod golden;
mod round_trip;
mod sample;
mod saving;
mod working;
