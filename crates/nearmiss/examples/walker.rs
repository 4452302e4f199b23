//! An avatar that walks through a building; here the building is a generated floor with a
//! staircase.
//!
//! `cargo run --release -p nearmiss --example walker`
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::error::Error;

use nearmiss::Aabb;
use nearmiss::slices::{Avatar, AvatarOptions, Pixel, Route, SliceBuilder, SliceOptions, SlicePlan, Slide};

fn main() -> Result<(), Box<dyn Error>> {
    // Ten metres of floor, with ten steps of 0.15 m starting at x = 3.
    let grid =
        (0..500_u16).flat_map(|i| (0..100_u16).map(move |j| [0.02 * f64::from(i), 0.02 * f64::from(j)]));
    let height = |x: f64| 0.15 * ((x - 3.0) / 0.3).floor().clamp(0.0, 10.0);
    let points: Vec<[f64; 3]> = grid.map(|[x, y]| [x, y, height(x)]).collect();

    let options = SliceOptions::default().with_pixel(Pixel::Side(0.05));
    let mut builder = SliceBuilder::new(&SlicePlan::new(&options, &Aabb::of(points.iter().copied()))?)?;
    builder.add(&points);
    let map = builder.finish();

    let route = Route { start: [0.5, 1.0, 0.1], points: vec![[9.5, 1.0]] };
    let avatar = Avatar::new(&AvatarOptions::default())?;
    let (mut steps, mut last) = (0, route.start);
    route.walk(&mut &map, &avatar, &Slide, |_, step| {
        (steps, last) = (steps + 1, step.position);
        Ok(())
    })?;
    println!("{steps} steps from {:.2?} to {last:.2?}", route.start);
    Ok(())
}
