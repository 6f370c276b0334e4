//! Loops over the rows of a chunk and sums over one row.

use crate::lanes::{Lanes, Task, dispatch};

/// Calls `row(k, target)` for each target of a chunk, compiled for the widest vectors there are; `row` must be
/// `inline(always)` to gain by it.
pub(crate) fn for_each_row<T>(targets: &mut [T], row: impl FnMut(usize, &mut T)) {
    dispatch(Rows { targets, row });
}

struct Rows<'a, T, F> {
    targets: &'a mut [T],
    row: F,
}

impl<T, F: FnMut(usize, &mut T)> Task for Rows<'_, T, F> {
    #[inline(always)]
    fn run<L: Lanes>(mut self, _: L) {
        for (k, target) in self.targets.iter_mut().enumerate() {
            (self.row)(k, target);
        }
    }
}

/// Sum of `term(j, value)` over a row, with two running sums so that additions overlap.
#[inline(always)]
pub(crate) fn sum_row<T, const N: usize>(
    (columns, values): (&[u32], &[f32]),
    term: impl Fn(usize, f32) -> [T; N],
) -> [T; N]
where
    T: Copy + Default + std::ops::AddAssign,
{
    let mut sums = [[T::default(); N]; 2];
    let mut add = |half: usize, column: u32, value: f32| {
        let term = term(column as usize, value);
        for k in 0..N {
            sums[half][k] += term[k];
        }
    };
    let (two_columns, two_values) = (columns.chunks_exact(2), values.chunks_exact(2));
    let rest = two_columns.remainder().iter().zip(two_values.remainder());
    for (columns, values) in two_columns.zip(two_values) {
        add(0, columns[0], values[0]);
        add(1, columns[1], values[1]);
    }
    rest.for_each(|(&column, &value)| add(0, column, value));
    let [mut sum, other] = sums;
    for k in 0..N {
        sum[k] += other[k];
    }
    sum
}
