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

/// Does `work` on every part of every layer: it gets the number of the layer, that of the part, and its cells.
#[cfg(feature = "rayon")]
pub(crate) fn change_each<C: Send>(
    layers: &mut [Vec<C>],
    size: usize,
    work: impl Fn(usize, usize, &mut [C]) + Sync + Send,
) {
    use rayon::prelude::*;
    let all = layers.par_iter_mut().enumerate();
    all.for_each(|(i, layer)| {
        layer.par_chunks_mut(size).enumerate().for_each(|(j, part)| work(i, j, part));
    });
}

/// Does `work` on every part of every layer: it gets the number of the layer, that of the part, and its cells.
#[cfg(not(feature = "rayon"))]
pub(crate) fn change_each<C: Send>(
    layers: &mut [Vec<C>],
    size: usize,
    work: impl Fn(usize, usize, &mut [C]) + Sync + Send,
) {
    for (i, layer) in layers.iter_mut().enumerate() {
        layer.chunks_mut(size).enumerate().for_each(|(j, part)| work(i, j, part));
    }
}
