//! Loops over nodes, markers and facets, cut into chunks of fixed length, so that no result depends on the number of
//! threads.

use std::ops::{Add, Range};

use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

/// Nodes a chunk.
const CHUNK: usize = 4096;

/// Interfaces of fewer nodes are done with before a second thread is awake.
const SMALL: usize = 20_000;

/// The helpers of this thread in its loops, for as long as they are kept; this thread is one of them. None where it has
/// helpers already.
pub(crate) fn helpers(nodes: usize, threads: usize) -> Option<rayon::ThreadPool> {
    let threads = if nodes < SMALL { 1 } else { threads };
    rayon::ThreadPoolBuilder::new().num_threads(threads).use_current_thread().build().ok()
}

/// Fills rows of `D` components, each from its number.
pub(crate) fn fill<const D: usize>(target: &mut [f64], row: impl Fn(usize) -> [f64; D] + Sync) {
    let rows = target.as_chunks_mut::<D>().0;
    rows.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, rows)| {
        for (number, target) in (chunk * CHUNK..).zip(rows) {
            *target = row(number);
        }
    });
}

/// Does something with every item, whichever comes first.
pub(crate) fn each<T: Send>(items: &mut [T], change: impl Fn(&mut T) + Sync) {
    items.par_chunks_mut(CHUNK).for_each(|items| items.iter_mut().for_each(&change));
}

/// Sum over `range` of what `term` gives for each of its chunks, added up as a binary tree.
pub(crate) fn sum<T: Add<Output = T> + Send>(
    range: Range<usize>,
    term: &(impl Fn(Range<usize>) -> T + Sync),
) -> T {
    if range.len() <= CHUNK {
        return term(range);
    }
    let middle = range.start + (range.len().div_ceil(CHUNK) / 2) * CHUNK;
    let (low, high) = rayon::join(|| sum(range.start..middle, term), || sum(middle..range.end, term));
    low + high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_rows_are_the_same_on_one_thread_and_on_three() {
        let values: Vec<f64> = (0..3 * CHUNK + 7).map(|i| 1.0 / (1.0 + i as f64)).collect();
        let work = || {
            let mut rows = vec![0.0; 2 * values.len()];
            fill::<2>(&mut rows, |row| [values[row], row as f64]);
            (sum(0..values.len(), &|range| values[range].iter().sum::<f64>()), rows)
        };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(work)
        };
        let (one, three) = (on(1), on(3));
        assert_eq!(one, three);
        assert!((one.0 / values.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        assert_eq!(one.1[2 * CHUNK..2 * CHUNK + 2], [values[CHUNK], CHUNK as f64]);
    }
}
