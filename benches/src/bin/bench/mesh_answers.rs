//! The quality of approximate answers about meshes: where a contact is likeliest, and how deep it is.

use std::hint::black_box;

use nearmiss::{Budget, Mesh, MeshPair, MeshQuality, MeshScratch, MeshSolid, MeshVerdict, Pose};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::sample::{Sample, count};

/// Poses at most for each row.
const MOST: usize = 300;

/// Returns at most [`MOST`] of the poses, evenly spread.
fn some(poses: &[Pose]) -> impl Iterator<Item = &Pose> {
    poses.iter().step_by(poses.len().div_ceil(MOST).max(1))
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|k| q[k] - p[k]).fold(0.0, f64::hypot)
}

/// Compares the places where a contact is likeliest, at poses that meet, with all contacts.
pub(crate) fn regions(mesh: &Mesh, meeting: &[Pose], scratch: &mut MeshScratch) {
    println!(
        "\n| approximate contacts | answers | holds a contact % | radius | nearest contact / radius: median | p99 | \
         extent of all contacts |"
    );
    println!("| --- | --: | --: | --: | --: | --: | --: |");
    let pair = |pose: &Pose| MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(pose));
    let mut contacts = Vec::new();
    let quality = MeshQuality::default();
    for (name, quality, work) in [
        ("32 node pairs", quality, 32),
        ("128 node pairs", quality, 128),
        ("512 node pairs", quality, 512),
        ("p_min 0.9", quality.with_p_min(0.9), u64::MAX),
        ("p_min 0.999", quality.with_p_min(0.999), u64::MAX),
    ] {
        let (mut near, mut radius, mut extent, mut holds) = (Sample::default(), 0.0, 0.0, 0);
        for pose in some(meeting) {
            let budget = Budget::UNLIMITED.with_work(work);
            let answer = pair(pose).within(&budget).collide_likely(&quality, scratch);
            let MeshVerdict::Undecided(region) = answer.verdict else { continue };
            pair(pose).contacts(&mut contacts, scratch);
            let away = contacts.iter().map(|contact| distance(contact.point, region.centre));
            let nearest = away.fold(f64::INFINITY, f64::min);
            let mean = [0, 1, 2].map(|k| {
                contacts.iter().map(|contact| contact.point[k]).sum::<f64>() / count(contacts.len())
            });
            let spread = contacts.iter().map(|contact| distance(contact.point, mean)).fold(0.0, f64::max);
            near.push(nearest / region.radius);
            (radius, extent) = (radius + region.radius, extent + spread);
            holds += usize::from(nearest <= region.radius);
        }
        let summary = near.summary();
        let n = count(near.len());
        println!(
            "| {name} | {} | {:.1} | {:.3} | {:.2} | {:.2} | {:.3} |",
            near.len(),
            100.0 * count(holds) / n,
            radius / n,
            summary.median,
            summary.p99,
            extent / n
        );
    }
}

/// Measures the penetration at poses that meet: time, and how close the bounds are.
pub(crate) fn penetrations(mesh: &Mesh, meeting: &[Pose], scratch: &mut MeshScratch) {
    let (solid, time) = timed(|| MeshSolid::new(mesh));
    println!("\nsolid found in {:.1} ms; closed: {}\n", nanoseconds(time) / 1e6, solid.is_closed());
    println!(
        "| penetration, µs | mean | median | p99 | mean upper | upper / best: mean | lower / upper: mean |"
    );
    println!("| --- | --: | --: | --: | --: | --: | --: |");
    let ask = |pose: &Pose, work: u64, scratch: &mut MeshScratch| {
        let pair = MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(pose));
        pair.within(&Budget::UNLIMITED.with_work(work)).penetration([&solid; 2], scratch)
    };
    let best: Vec<f64> = some(meeting).map(|pose| ask(pose, u64::MAX, scratch).upper).collect();
    for (name, work) in
        [("300 units", 300), ("3000 units", 3000), ("30,000 units", 30_000), ("to the end", u64::MAX)]
    {
        let (mut times, mut upper, mut over, mut share) = (Sample::default(), 0.0, 0.0, 0.0);
        for (pose, best) in some(meeting).zip(&best) {
            let (found, time) = timed(|| black_box(ask(black_box(pose), work, scratch)));
            times.push(nanoseconds(time));
            (upper, over) = (upper + found.upper, over + found.upper / best);
            share += found.lower / found.upper;
        }
        let (summary, n) = (times.summary(), count(times.len()));
        println!(
            "| {name} | {:.0} | {:.0} | {:.0} | {:.4} | {:.2} | {:.2} |",
            summary.mean / 1e3,
            summary.median / 1e3,
            summary.p99 / 1e3,
            upper / n,
            over / n,
            share / n
        );
    }
}
