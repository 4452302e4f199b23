//! Answers to the poses of a file, in the order of its lines.

use std::ops::ControlFlow;

use nearmiss::{BatchScratch, Scratch, each};

use crate::error::CliError;
use crate::posing::PoseFile;

/// The number of lines read at a time if several threads answer.
const BATCH: usize = 1024;

/// A line of a file of poses: its number, counted from 1, and its text.
pub(crate) type PoseLine = (u64, String);

/// Answers line by line on `threads` threads (0 for all cores) and passes the answers to `tell`, in
/// order. Ends after the first answer for which `is_last` returns `true`, or with the first error.
/// `tell` gets that error as well, after the answers to the lines before it. Holds at most
/// [`BATCH`] lines.
pub(crate) fn answer_lines<A: Send>(
    poses: &mut PoseFile,
    threads: usize,
    ask: impl Fn(&PoseFile, &PoseLine, &mut Scratch) -> Result<A, CliError> + Sync,
    is_last: impl Fn(&A) -> bool + Sync,
    mut tell: impl FnMut(Result<&A, CliError>) -> Result<(), CliError>,
) -> Result<(), CliError> {
    // With one thread, each line is answered before the next is read.
    let (pool, most) = if threads == 1 { (None, 1) } else { (Some(pool(threads)?), BATCH) };
    let (mut lines, mut answers) = (Vec::with_capacity(most), Vec::with_capacity(most));
    let mut scratch = BatchScratch::default();
    loop {
        lines.clear();
        let read = read_lines(poses, most, &mut lines);
        let ask = |i: usize, scratch: &mut Scratch| {
            let asked = ask(poses, &lines[i], scratch);
            // Nothing is written after a fault, or after the last answer.
            let ends = asked.as_ref().map_or(true, &is_last);
            if ends { ControlFlow::Break(Some(asked)) } else { ControlFlow::Continue(Some(asked)) }
        };
        answers.clear();
        answers.resize_with(lines.len(), || None);
        let mut answer = || each(&mut answers, None, &mut scratch, ask);
        let told = match &pool {
            Some(pool) => pool.install(answer),
            None => answer(),
        };
        for asked in answers.drain(..).take(told).flatten().chain(read.err().map(Err)) {
            match asked {
                Err(fault) => return tell(Err(fault)),
                Ok(asked) => {
                    tell(Ok(&asked))?;
                    if is_last(&asked) {
                        return Ok(());
                    }
                }
            }
        }
        if lines.len() < most {
            return Ok(());
        }
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, CliError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.or(Err(CliError::Threads(threads)))
}

/// Reads up to `most` lines. After an error, `lines` holds the lines before the faulty one.
fn read_lines(poses: &mut PoseFile, most: usize, lines: &mut Vec<PoseLine>) -> Result<(), CliError> {
    while lines.len() < most
        && let Some(line) = poses.next_line()?
    {
        lines.push(line);
    }
    Ok(())
}
