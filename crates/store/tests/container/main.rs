//! The container as its users see it, through the public interface only.

#![cfg(test)]

mod attacks;
mod damage;
mod golden;
mod round_trip;
mod sample;
mod saving;
mod working;
