//! Verdicts near contact against the exact test of the mesh, for objects without a truth set.
//!
//! A pose is outside the band if the mesh's answer stays the same under shifts by 1.05 r in each of
//! 26 directions: then neither a contact nor a gap is shallower than that. Objects are scaled as in
//! the sweep. The check fails if a verdict outside the band is wrong or missing.

use nearmiss::{BuildOptions, CollideOptions, CollidePlan, Pair, Pose, Scan, Scratch, Verdict};
use nearmiss_benches::object::Object;
use nearmiss_benches::poses::{NearPose, near};
use nearmiss_benches::rivals::{Method, rival};
use nearmiss_benches::{Failure, machine};

/// Slightly more than the band, so that rounding of r changes no result.
const SHIFT: f64 = 1.05;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Objects with a mesh
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Poses near contact
    #[arg(long, value_name = "N", default_value_t = 1500)]
    poses: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 7)]
    seed: u64,
}

/// Returns `true` if the check passes.
pub(crate) fn run(arguments: &Arguments) -> Result<bool, Failure> {
    println!("{}", machine::description());
    println!(
        "| object | points | r | outside the band | false hits | misses | undecided | inside | differ |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    let mut faults = 0;
    for source in &arguments.objects {
        faults += compare(source, arguments.poses, arguments.seed)?;
    }
    Ok(faults == 0)
}

/// Prints a line for one object; returns the number of wrong or missing verdicts outside the band.
fn compare(source: &str, count: usize, seed: u64) -> Result<u32, Failure> {
    let object = Object::read(source)?.scaled()?;
    let Some(mut mesh) = rival("parry", &object)? else {
        return Err(format!("{source}: expected a mesh to compare with, got none").into());
    };
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let plan = CollidePlan::new(&CollideOptions::estimated(), &scan, &scan)?;
    let [mut outside, mut hits, mut misses, mut undecided, mut inside, mut differ] = [0_u32; 6];
    for NearPose { pose, .. } in near(&object, count, seed)? {
        let truth = mesh.ask(&Pose::IDENTITY, &pose).hit;
        let verdict = Pair::new(scan.at(&Pose::IDENTITY), scan.at(&pose))
            .collide(&plan, &mut Scratch::default())
            .verdict;
        if !is_steady(mesh.as_mut(), &pose, truth, SHIFT * object.r) {
            inside += 1;
            differ += u32::from(verdict.is_intersecting() != truth);
            continue;
        }
        outside += 1;
        match verdict {
            Verdict::Undecided(_) => undecided += 1,
            _ if verdict.is_intersecting() == truth => {}
            _ if truth => misses += 1,
            _ => hits += 1,
        }
    }
    println!(
        "| {} | {} | {:.4} | {outside} | {hits} | {misses} | {undecided} | {inside} | {differ} |",
        object.name,
        scan.len(),
        object.r
    );
    Ok(hits + misses + undecided)
}

/// Returns `true` if the mesh's answer stays `truth` for shifts of the second copy by `length` in
/// 26 directions.
fn is_steady(mesh: &mut dyn Method, pose: &Pose, truth: bool, length: f64) -> bool {
    let steps = [-1.0, 0.0, 1.0_f64];
    let directions = steps.iter().flat_map(|&x| steps.iter().flat_map(move |&y| steps.map(|z| [x, y, z])));
    directions.filter(|d| d.iter().any(|&c| c.abs() > 0.5)).all(|direction| {
        let norm = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
        let at = pose.translation();
        let shifted = [0, 1, 2].map(|k| at[k] + length * direction[k] / norm);
        mesh.ask(&Pose::IDENTITY, &pose.with_translation(shifted)).hit == truth
    })
}
