//! The same work on one thread or on all of them.

/// What `work` makes of each number below `count`, in order.
#[cfg(feature = "rayon")]
pub(crate) fn map_each<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    use rayon::prelude::*;
    (0..count).into_par_iter().map(work).collect()
}

/// What `work` makes of each number below `count`, in order.
#[cfg(not(feature = "rayon"))]
pub(crate) fn map_each<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..count).map(work).collect()
}

/// Fills every answer by its question.
#[cfg(feature = "rayon")]
pub(crate) fn fill_each<Q: Sync, A: Send>(
    questions: &[Q],
    answers: &mut [A],
    size: usize,
    work: impl Fn(&Q) -> A + Sync + Send,
) {
    use rayon::prelude::*;
    questions
        .par_iter()
        .zip(answers)
        .with_min_len(size)
        .for_each(|(question, answer)| *answer = work(question));
}

/// Fills every answer by its question.
#[cfg(not(feature = "rayon"))]
pub(crate) fn fill_each<Q: Sync, A: Send>(
    questions: &[Q],
    answers: &mut [A],
    _size: usize,
    work: impl Fn(&Q) -> A + Sync + Send,
) {
    questions.iter().zip(answers).for_each(|(question, answer)| *answer = work(question));
}

/// Fills every answer by a walker, which may change, and its question.
#[cfg(feature = "rayon")]
pub(crate) fn walk_each<W: Send, Q: Sync, A: Send>(
    walkers: &mut [W],
    questions: &[Q],
    answers: &mut [A],
    size: usize,
    work: impl Fn(&mut W, &Q) -> A + Sync + Send,
) {
    use rayon::prelude::*;
    let all = walkers.par_iter_mut().zip(questions).zip(answers).with_min_len(size);
    all.for_each(|((walker, question), answer)| *answer = work(walker, question));
}

/// Fills every answer by a walker, which may change, and its question.
#[cfg(not(feature = "rayon"))]
pub(crate) fn walk_each<W: Send, Q: Sync, A: Send>(
    walkers: &mut [W],
    questions: &[Q],
    answers: &mut [A],
    _size: usize,
    work: impl Fn(&mut W, &Q) -> A + Sync + Send,
) {
    for ((walker, question), answer) in walkers.iter_mut().zip(questions).zip(answers) {
        *answer = work(walker, question);
    }
}

/// Does `work` on everything, given its number.
#[cfg(feature = "rayon")]
pub(crate) fn change_each<T: Send>(all: &mut [T], work: impl Fn(usize, &mut T) + Sync + Send) {
    use rayon::prelude::*;
    all.par_iter_mut().enumerate().for_each(|(i, one)| work(i, one));
}

/// Does `work` on everything, given its number.
#[cfg(not(feature = "rayon"))]
pub(crate) fn change_each<T: Send>(all: &mut [T], work: impl Fn(usize, &mut T) + Sync + Send) {
    all.iter_mut().enumerate().for_each(|(i, one)| work(i, one));
}
