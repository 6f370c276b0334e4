//! Rows of weights and their products with vectors of two or three components a node.

use super::Rows;
use crate::parallel;

/// A sparse matrix that acts on nodes, not on components.
#[derive(Debug, Clone)]
pub enum Sparse {
    /// Every row has one column, with the weight one: points that lie on nodes.
    Same(Vec<u32>),
    /// Columns and weights, row behind row.
    Weighted {
        /// Where each row begins, and the end of the last.
        starts: Vec<u32>,
        /// Columns and weights.
        entries: Vec<(u32, f64)>,
    },
}

impl Sparse {
    /// Packs rows of (column, weight); weights of zero are left out.
    pub fn pack(rows: Rows) -> Self {
        let mut starts = vec![0];
        let mut entries = Vec::new();
        let count = |length: usize| u32::try_from(length).expect("node numbers have 32 bits");
        for row in rows {
            let nonzero = row.into_iter().filter(|entry| entry.1 != 0.0);
            entries.extend(nonzero.map(|(column, weight)| (count(column), weight)));
            starts.push(count(entries.len()));
        }
        let is_single = starts.windows(2).all(|ends| ends[1] - ends[0] == 1);
        if is_single && entries.iter().all(|entry| entry.1 == 1.0) {
            return Self::Same(entries.into_iter().map(|entry| entry.0).collect());
        }
        Self::Weighted { starts, entries }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Self::Same(columns) => columns.len(),
            Self::Weighted { starts, .. } => starts.len() - 1,
        }
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Columns and weights of one row.
    pub fn row(&self, row: usize) -> Vec<(usize, f64)> {
        match self {
            Self::Same(columns) => vec![(columns[row] as usize, 1.0)],
            Self::Weighted { starts, entries } => {
                let entries = &entries[starts[row] as usize..starts[row + 1] as usize];
                entries.iter().map(|&(column, weight)| (column as usize, weight)).collect()
            }
        }
    }

    /// The transpose, with this many rows; the entries of each of its rows are in the order of this one's rows.
    pub fn transpose(&self, row_count: usize) -> Self {
        let mut rows = vec![Vec::new(); row_count];
        for row in 0..self.len() {
            self.row(row).into_iter().for_each(|(column, weight)| rows[column].push((row, weight)));
        }
        Self::pack(rows)
    }

    /// `target = base + H source`, all `[n, D]` in flat numbers of component; base and source as functions, so that
    /// what they are made of needs no room.
    pub fn spread(
        &self,
        dimension: usize,
        base: impl Fn(usize) -> f64 + Sync,
        source: impl Fn(usize) -> f64 + Sync,
        target: &mut [f64],
    ) {
        if dimension == 2 {
            self.spread_rows::<2>(base, source, target)
        } else {
            self.spread_rows::<3>(base, source, target)
        }
    }

    /// The same with `D` components a row, be they of a vector or not.
    pub fn spread_rows<const D: usize>(
        &self,
        base: impl Fn(usize) -> f64 + Sync,
        source: impl Fn(usize) -> f64 + Sync,
        target: &mut [f64],
    ) {
        parallel::fill::<D>(target, |row| {
            let sum = self.row_sum::<D>(row, &source);
            std::array::from_fn(|axis| base(row * D + axis) + sum[axis])
        });
    }

    /// Sum of `vectors`, `[n, D]`, times H source.
    pub fn product(&self, dimension: usize, vectors: &[f64], source: impl Fn(usize) -> f64 + Sync) -> f64 {
        if dimension == 2 {
            self.product_all::<2>(vectors, source)
        } else {
            self.product_all::<3>(vectors, source)
        }
    }

    fn product_all<const D: usize>(&self, vectors: &[f64], source: impl Fn(usize) -> f64 + Sync) -> f64 {
        let vectors = vectors.as_chunks::<D>().0;
        parallel::sum(0..self.len(), &|rows| {
            let product = |row: usize| -> f64 {
                let sum = self.row_sum::<D>(row, &source);
                (0..D).map(|axis| vectors[row][axis] * sum[axis]).sum()
            };
            rows.map(product).sum()
        })
    }

    /// One row of H source.
    #[inline(always)]
    fn row_sum<const D: usize>(&self, row: usize, source: &impl Fn(usize) -> f64) -> [f64; D] {
        let at = |node: u32| -> [f64; D] { std::array::from_fn(|axis| source(node as usize * D + axis)) };
        match self {
            Self::Same(columns) => at(columns[row]),
            Self::Weighted { starts, entries } => {
                let mut sum = [0.0; D];
                for &(column, weight) in &entries[starts[row] as usize..starts[row + 1] as usize] {
                    let value = at(column);
                    (0..D).for_each(|axis| sum[axis] += weight * value[axis]);
                }
                sum
            }
        }
    }
}
