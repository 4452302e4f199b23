//! Figs 5 and 6: memory and time of a walk, step by step, over the number of slices kept.

use std::fmt::Write;
use std::path::Path;

use nearmiss::slices::{
    Avatar, AvatarOptions, Back, CacheOptions, Ended, Pixel, SliceCache, SliceFolder, SliceOptions,
    StoreError,
};

use super::Walked;
use crate::Failure;
use crate::clock::{nanoseconds, now};
use crate::figures::FigureOptions;
use crate::plot::{Axis, Line, Panel};
use crate::sample::count;

/// The paper's resolution, in pixels.
pub const PIXELS: u32 = 700;

/// Slices that the paper's avatar spans.
const SPANNED: f64 = 6.0;

/// Steps that one mark of a figure stands for; it shows their peak.
const TOGETHER: usize = 8;

/// Walks per measurement; the least time of each step counts.
const PASSES: usize = 7;

/// Time in microseconds and bytes of slices in memory, for each step.
struct Steps {
    times: Vec<f64>,
    bytes: Vec<usize>,
    misses: u64,
}

fn walk(
    walked: &Walked,
    folder: &SliceFolder,
    avatar: &Avatar,
    cache: CacheOptions,
) -> Result<Steps, Failure> {
    let mut steps = Steps { times: Vec::new(), bytes: Vec::new(), misses: 0 };
    for pass in 0..PASSES {
        let mut cache = SliceCache::new(folder, &cache, avatar.slices(folder.grid()));
        let (mut i, mut last) = (0, now());
        let ended = walked.route.walk(&mut cache, avatar, &Back, |cache, _| {
            let time = nanoseconds(last.elapsed()) / 1e3;
            if pass == 0 {
                steps.times.push(time);
                steps.bytes.push(cache.map().bytes());
            } else {
                steps.times[i] = steps.times[i].min(time);
                i += 1;
            }
            last = now();
            Ok::<(), StoreError>(())
        })?;
        if ended != Ended::Arrived {
            return Err(format!("the walk ended before its end: {ended:?}").into());
        }
        steps.misses = cache.counts().misses;
    }
    Ok(steps)
}

/// The greatest of each group of values, over the index of the first.
fn peaks(values: &[f64]) -> Vec<[f64; 2]> {
    let groups = values.chunks(TOGETHER).enumerate();
    groups.map(|(i, group)| [count(TOGETHER * i), group.iter().copied().fold(0.0, f64::max)]).collect()
}

/// Walks with the paper's avatar of six slices, of which 10 or 16 are kept, and with slices of
/// three pixels. Writes both figures and a table.
///
/// # Errors
/// When a map or a figure cannot be written, or the walk ends early.
pub fn figures_5_and_6(
    text: &mut String,
    options: &FigureOptions,
    walked: &Walked,
    maps: &Path,
) -> Result<(), Failure> {
    text.push_str(
        "\n## Figs 5 and 6: memory and time of a walk over the number of slices kept\n\nThe walk goes up the stairs and down again, with one step for each pixel and slices of 700 pixels. On the left the avatar spans six slices, \
         as in the paper, which keeps 10 or 16 of them. On the right slices are three pixels high. Slices are loaded ahead only where the table says so. Times are the minimum of \
         seven walks for each step. Slow steps read and decode a slice.\n\n![](figure-5.svg)\n\n![](figure-6.svg)\n\n\
         | slice | slices | kept | ahead | MB, most | MB, mean | µs a step, mean | worst | steps above 50 µs | slices read late |\n| --: | --: | --: | --- | --: | --: | --: | --: | --: | --: |\n",
    );
    let tall = AvatarOptions::default().height / (SPANNED - 1.0);
    let (mut memory, mut time) = (Vec::new(), Vec::new());
    for (name, height) in [("six", Some(tall)), ("three-pixels", None)] {
        let wanted = SliceOptions::default().with_pixel(Pixel::Count(PIXELS)).with_slice_height(height);
        let (folder, _) = walked.folder(&maps.join(name), &wanted)?;
        let grid = *folder.grid();
        let avatar = Avatar::new(&AvatarOptions::default().with_step(grid.pixel))?;
        let (span, all) = (avatar.slices(&grid), grid.counts[2]);
        let kept = if height.is_some() { [10, 16] } else { [span, span + 6] };
        let kept = [(kept[0], false), (kept[1], false), (kept[1], true), (all, false)];
        let (mut bytes, mut times) = (Vec::new(), Vec::new());
        for (colour, (slices, prefetch)) in kept.into_iter().enumerate() {
            let cache = CacheOptions::default().with_slices(slices).with_prefetch(prefetch);
            let steps = walk(walked, &folder, &avatar, cache)?;
            let megabytes: Vec<f64> = steps.bytes.iter().map(|bytes| count(*bytes) / 1e6).collect();
            let mean = |values: &[f64]| values.iter().sum::<f64>() / count(values.len());
            let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
            writeln!(
                text,
                "| {:.3} | {all} | {slices} | {} | {:.1} | {:.1} | {:.1} | {:.0} | {} of {} | {} |",
                grid.slice_height,
                if prefetch { "yes" } else { "no" },
                most(&megabytes),
                mean(&megabytes),
                mean(&steps.times),
                most(&steps.times),
                steps.times.iter().filter(|time| **time > 50.0).count(),
                steps.times.len(),
                steps.misses
            )?;
            let kept = if slices == all { "all".into() } else { slices.to_string() };
            let name = format!("{kept} slices{}", if prefetch { ", ahead" } else { "" });
            times.push(Line { name: name.clone(), points: peaks(&steps.times), colour, dashed: prefetch });
            if !prefetch {
                bytes.push(Line { name, points: peaks(&megabytes), colour, dashed: false });
            }
        }
        let title = format!("slices {:.2} high, {all} of them", grid.slice_height);
        let panel = |what: &str, up: Axis, lines| Panel {
            title: format!("{what}, {title}"),
            axes: [Axis::even("step"), up],
            lines,
        };
        memory.push(panel("Memory", Axis::even("MB of slices in memory"), bytes));
        time.push(panel("Time", Axis::logarithmic("µs, worst of 8 steps"), times));
    }
    options.save("figure-5.svg", &memory)?;
    options.save("figure-6.svg", &time)
}
