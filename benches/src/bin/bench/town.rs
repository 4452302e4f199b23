//! A town as scanned from an aircraft: terrain, roofs and walls, strip by strip. It has as many
//! points as wanted and is written piece by piece.

use std::fs::File;
use std::path::PathBuf;

use nearmiss::io::{OutputFormat, PointWriter, Points, Survey};
use nearmiss_benches::Failure;
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// File to write; its name tells the format: LAS, LAZ, PLY, PCD, XYZ or NPY
    file: PathBuf,
    /// Number of points
    #[arg(long, value_name = "N", default_value_t = 100_000_000)]
    points: u64,
    /// Seed of the noise
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
}

/// Points per square metre of ground.
const DENSITY: f64 = 100.0;

/// Width of a strip.
const STRIP: f64 = 40.0;

/// Spacing of the buildings, and the edge of their footprints.
const LOT: f64 = 40.0;
const HOUSE: f64 = 18.0;

/// Share of the points over a house that lie on its walls.
const WALLS: f64 = 0.5;

/// Approximate standard deviation of the noise.
const NOISE: f64 = 0.015;

/// Corner of the town, as far from the origin as coordinates of surveys are.
const CORNER: [f64; 3] = [412_000.0, 5_318_000.0, 420.0];

/// Points that are generated together.
const PIECE: u64 = 1 << 16;

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    let format = OutputFormat::of(&options.file)?;
    let mut survey = Survey::default();
    each(options, |points| {
        survey.add(points);
        Ok(())
    })?;
    let mut writer = PointWriter::new(File::create(&options.file)?, format, &survey)?;
    each(options, |points| Ok(writer.write(points)?))?;
    writer.finish()?;
    println!("{} points written to {}", survey.points(), options.file.display());
    Ok(())
}

/// Generates the points piece by piece. They are the same on every run.
#[expect(clippy::cast_precision_loss, reason = "counts of points")]
fn each(options: &Options, mut take: impl FnMut(&Points) -> Result<(), Failure>) -> Result<(), Failure> {
    let side = (options.points as f64 / DENSITY).sqrt();
    let strips = (side / STRIP).ceil().max(1.0);
    for first in (0..options.points).step_by(usize::try_from(PIECE)?) {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(options.seed ^ first);
        let mut points = Points::default();
        for i in first..(first + PIECE).min(options.points) {
            let along = i as f64 / options.points as f64 * strips;
            let x = along.fract() * side;
            let y = (along.floor() + random.random::<f64>()) * side / strips;
            let (p, class) = point([x, y], &mut random);
            points.positions.push([0, 1, 2].map(|k| CORNER[k] + p[k]));
            points.classes.push(class);
            points.intensities.push(f32::from(random.random::<u16>() >> 6));
        }
        take(&points)?;
    }
    Ok(())
}

/// A point above a ground position, and its class.
fn point([x, y]: [f64; 2], random: &mut Xoshiro256PlusPlus) -> ([f64; 3], u8) {
    let mut noise =
        || NOISE * (random.random::<f64>() + random.random::<f64>() + random.random::<f64>() - 1.5);
    let [dx, dy, dz] = [noise(), noise(), noise()];
    let terrain = |x: f64, y: f64| 6.0 * (x / 170.0).sin() * (y / 230.0).cos() + 0.02 * x;
    let (lot, within) = ([(x / LOT).floor(), (y / LOT).floor()], [x.rem_euclid(LOT), y.rem_euclid(LOT)]);
    if within.iter().any(|w| *w >= HOUSE) {
        return ([x, y, terrain(x, y) + dz], 2);
    }
    let base = lot.map(|l| l * LOT);
    let floor = terrain(base[0], base[1]);
    // Houses are from 5 to 17 m high.
    let roof = floor + 5.0 + 12.0 * (lot[0] * 0.37 + lot[1] * 0.61).sin().abs();
    if random.random::<f64>() >= WALLS {
        return ([x + dx, y + dy, roof + dz], 6);
    }
    let (height, place) = (floor + (roof - floor) * random.random::<f64>(), HOUSE * random.random::<f64>());
    let wall = match random.random::<u8>() % 4 {
        0 => [base[0], base[1] + place],
        1 => [base[0] + HOUSE, base[1] + place],
        2 => [base[0] + place, base[1]],
        _ => [base[0] + place, base[1] + HOUSE],
    };
    ([wall[0] + dx, wall[1] + dy, height + dz], 6)
}
