//! The command line and the library have the same defaults.

use clap::Parser;
use nearmiss::{
    BuildOptions, ClashOptions, CollideOptions, CurveOptions, DistanceOptions, GraphOptions, PointCloud, Scan,
};

use crate::{Cli, Command, clash, collide, curve, distance, preprocess};

fn command(words: &str) -> Command {
    Cli::try_parse_from(words.split(' ')).unwrap().command
}

#[test]
fn defaults_of_the_command_line_are_those_of_the_library() {
    let points: Vec<[f64; 3]> = (0..64_u32).map(|i| [f64::from(i % 8), f64::from(i / 8), 0.0]).collect();
    let scan = Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap();

    let Command::Preprocess(args) = command("nearmiss preprocess a.ply -o a.nm") else { panic!() };
    assert_eq!(preprocess::options(&args), BuildOptions::default());
    assert_eq!(preprocess::graph_options(&args), None, "no graph unless asked for");
    let Command::Preprocess(args) = command("nearmiss preprocess a.ply -o a.nm --graph") else { panic!() };
    assert_eq!(preprocess::graph_options(&args), Some((GraphOptions::default(), None)));
    let Command::Collide(args) = command("nearmiss collide a.nm b.nm") else { panic!() };
    assert_eq!(collide::options(&args, &scan).unwrap(), CollideOptions::default());
    let Command::Distance(args) = command("nearmiss distance a.nm b.nm") else { panic!() };
    assert_eq!(distance::options(&args, &scan), DistanceOptions::default());
    let Command::Curve(args) = command("nearmiss curve a.nm b.nm -o c.ply") else { panic!() };
    assert_eq!(curve::options(&args), CurveOptions::default());
    let Command::Clash(args) = command("nearmiss clash a.nm b.nm") else { panic!() };
    assert_eq!(clash::options(&args, &scan), ClashOptions::default());
}

/// The parameters of a method that is not the default.
#[test]
fn defaults_of_methods_are_those_of_the_library() {
    use nearmiss::{Interpolation, Method, Sampling};

    let points: Vec<[f64; 3]> = (0..64_u32).map(|i| [f64::from(i % 8), f64::from(i / 8), 0.0]).collect();
    let scan = Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap();
    for (name, method) in [
        ("sampling", Method::Sampling(Sampling::default())),
        ("interpolation", Method::Interpolation(Interpolation::default())),
    ] {
        let words = format!("nearmiss collide a.nm b.nm --method {name}");
        let Command::Collide(args) = command(&words) else { panic!() };
        assert_eq!(collide::options(&args, &scan).unwrap().method, method, "{name}");
    }
}
