//! The cost of one evaluation of f, at a leaf and anywhere, by instruction set. The rival is
//! kiddo's search for the same number of nearest points.

use std::hint::black_box;
use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::hierarchy::GatherScratch;
use nearmiss::index::PointBlock;
use nearmiss::surface::Level;
use nearmiss::{BuildOptions, Scan};
use nearmiss_benches::clock::timed;
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{point_in, rng};

/// Evaluations in a run.
const PLACES: usize = 1 << 14;

/// Evaluations that are timed together.
const STRETCH: usize = 256;

/// Evaluations around one point, as in a projection.
const TOGETHER: usize = 8;

/// A stored point and a position near it.
type Place = (usize, [f64; 3]);

/// `TOGETHER` positions around each of some points spread over the scan, within half their local
/// radius.
fn places(scan: &Scan) -> Vec<Place> {
    let rng = &mut rng(1);
    let step = 7919 % scan.len();
    let points = (0..PLACES / TOGETHER).map(|i| i * step % scan.len());
    points
        .flat_map(|i| {
            let (p, r) = (scan.positions()[i].map(f64::from), f64::from(scan.radii()[i]));
            std::array::from_fn::<Place, TOGETHER, _>(|_| {
                let d = point_in(rng, 0.5 * r);
                (i, [0, 1, 2].map(|k| p[k] + d[k]))
            })
        })
        .collect()
}

/// Mean nanoseconds per evaluation. For each stretch the least of `runs` times counts, which
/// removes most of the load of other programs.
fn time(places: &[Place], runs: usize, mut ask: impl FnMut(&Place) -> f64) -> f64 {
    let stretches: Vec<&[Place]> = places.chunks(STRETCH).collect();
    let mut least = vec![f64::INFINITY; stretches.len()];
    for _ in 0..runs {
        for (stretch, least) in stretches.iter().zip(&mut least) {
            let (sum, time) = timed(|| stretch.iter().map(|place| ask(black_box(place))).sum::<f64>());
            black_box(sum);
            *least = least.min(time.as_secs_f64());
        }
    }
    least.into_iter().sum::<f64>() * 1e9 / count(places.len())
}

/// The instruction sets available here, the best first.
fn levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    let mut levels = vec![("best", best)];
    #[cfg(target_arch = "x86_64")]
    {
        levels.clear();
        levels.extend(best.as_avx512().map(|simd| ("AVX-512", Level::Avx512(simd))));
        levels.extend(best.as_avx2().map(|simd| ("AVX2", Level::Avx2(simd))));
        levels.extend(best.as_sse4_2().map(|simd| ("SSE4.2", Level::Sse4_2(simd))));
        levels.extend(best.as_sse2().map(|simd| ("SSE2", Level::Sse2(simd))));
    }
    levels
}

/// The number of points of a group whose support contains `x`.
fn supporting(group: &PointBlock, x: [f64; 3]) -> usize {
    let distance_sq =
        |i: usize| (0..3).map(|k| (f64::from(group.position[k][i]) - x[k]).powi(2)).sum::<f64>();
    (0..PointBlock::WIDTH).filter(|&i| distance_sq(i) < f64::from(group.support_radius[i]).powi(2)).count()
}

fn measure(object: &Object, runs: usize) -> Result<(), Failure> {
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let near = places(&scan);
    // Independent queries: no position is near the previous one.
    let mut apart: Vec<Place> = near.iter().step_by(TOGETHER).copied().collect();
    apart.extend(near.iter().skip(3).step_by(TOGETHER));
    let mut scratch = GatherScratch::default();
    let support = near.iter().map(|&(i, x)| f64::from(scan.evaluate_near(i, x, &mut scratch).support));
    let support = support.sum::<f64>() / count(near.len());
    let block = |i: usize| i / PointBlock::WIDTH;
    let lists: Vec<usize> =
        (0..scan.blocks().len()).filter_map(|block| Some(scan.neighbours(block)?.1.len())).collect();
    let listed = count(lists.iter().sum()) / count(lists.len());
    let offered = near.iter().map(|&(i, x)| {
        let groups = scan.neighbours(block(i)).into_iter().flat_map(|(_, list)| list);
        groups.map(|&group| supporting(&scan.groups()[group as usize], x)).sum::<usize>()
    });
    let offered = count(offered.sum::<usize>()) / count(near.len());
    println!("\n## {}, {} points\n", object.name, scan.len());
    println!(
        "{support:.1} points reach a place in the mean, of {offered:.1} blocks that are offered; lists name \
         {listed:.1} groups in the mean, {} at most, {:.3} % of the blocks have none\n",
        lists.iter().max().copied().unwrap_or(0),
        100.0 - 100.0 * count(lists.len()) / count(scan.blocks().len()),
    );
    println!(
        "| ns | at a leaf, {TOGETHER} together | at a leaf, apart | anywhere, {TOGETHER} together | anywhere, apart |"
    );
    println!("| --- | --: | --: | --: | --: |");
    for (name, level) in levels() {
        let mut scratch = GatherScratch::at(level);
        let mut at_leaf =
            |places: &[Place]| time(places, runs, |&(i, x)| scan.evaluate_near(i, x, &mut scratch).f);
        let (a, b) = (at_leaf(&near), at_leaf(&apart));
        let mut anywhere =
            |places: &[Place]| time(places, runs, |&(_, x)| scan.evaluate_with(x, &mut scratch).f);
        println!("| {name} | {a:.0} | {b:.0} | {:.0} | {:.0} |", anywhere(&near), anywhere(&apart));
    }
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(scan.positions()).map_err(|e| format!("{e:?}"))?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number")]
    let wanted = NonZero::new(support.round() as usize).ok_or("nothing reaches any place")?;
    #[expect(clippy::cast_possible_truncation, reason = "the tree is single precision")]
    let ask = |&(_, x): &Place| {
        let found = tree.query(&x.map(|c| c as f32)).nearest_n::<SquaredEuclidean<f32>>(wanted).execute();
        found.last().map_or(0.0, |last| f64::from(last.distance))
    };
    let (a, b) = (time(&near, runs, ask), time(&apart, runs, ask));
    println!("| rival kiddo, {wanted} nearest | | | {a:.0} | {b:.0} |");
    Ok(())
}

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Objects to measure: files, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(value_name = "OBJECT", default_values = ["dragon-5k", "dragon-23k"])]
    objects: Vec<String>,
    /// Runs; the fastest one counts
    #[arg(long, value_name = "N", default_value_t = 21)]
    runs: usize,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    println!("{}", machine::description());
    for object in &arguments.objects {
        measure(&Object::read(object)?, arguments.runs.max(1))?;
    }
    Ok(())
}
