//! Tests of the built command.
#![cfg(test)]

mod advice;
mod animating;
mod bad_input;
mod building_maps;
mod casting;
mod clashes;
mod collide;
mod converting;
mod curves;
mod distances;
mod estimating;
mod faults;
mod filtering;
mod guides;
mod independent;
mod interpolating;
mod looking_inside;
mod making_poses;
mod mesh_scans;
mod meshes;
mod moving_out;
mod on_disk;
mod paths;
mod prepare;
mod routing;
mod running;
mod sampling;
mod slicing;
mod sweeping;
mod terminal;
mod touching;
