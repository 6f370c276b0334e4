//! Rows of weights, packed one behind the other, and their products with vectors of two or three components a node.

use super::Rows;

/// A sparse matrix that acts on nodes, not on components.
#[derive(Debug, Clone)]
pub struct Sparse {
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Sparse {
    /// Packs rows of (column, weight); weights of zero are left out.
    pub fn pack(rows: Rows) -> Self {
        let mut starts = vec![0];
        let mut entries = Vec::new();
        for row in rows {
            entries.extend(row.into_iter().filter(|entry| entry.1 != 0.0));
            starts.push(entries.len());
        }
        Self { starts, entries }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Columns and weights, row after row.
    pub fn rows(&self) -> impl Iterator<Item = &[(usize, f64)]> {
        self.starts.windows(2).map(|ends| &self.entries[ends[0]..ends[1]])
    }

    /// `target = H source`, both `[n, dimension]`.
    pub fn spread(&self, dimension: usize, source: &[f64], target: &mut [f64]) {
        if dimension == 2 {
            self.spread_all::<2>(source, target)
        } else {
            self.spread_all::<3>(source, target)
        }
    }

    /// `target = H' source`, both `[n, dimension]`.
    pub fn gather(&self, dimension: usize, source: &[f64], target: &mut [f64]) {
        target.fill(0.0);
        if dimension == 2 {
            self.gather_all::<2>(source, target)
        } else {
            self.gather_all::<3>(source, target)
        }
    }

    fn spread_all<const D: usize>(&self, source: &[f64], target: &mut [f64]) {
        let (source, target) = (source.as_chunks::<D>().0, target.as_chunks_mut::<D>().0);
        for (target, row) in target.iter_mut().zip(self.rows()) {
            let mut sum = [0.0; D];
            for &(column, weight) in row {
                (0..D).for_each(|axis| sum[axis] += weight * source[column][axis]);
            }
            *target = sum;
        }
    }

    fn gather_all<const D: usize>(&self, source: &[f64], target: &mut [f64]) {
        let (source, target) = (source.as_chunks::<D>().0, target.as_chunks_mut::<D>().0);
        for (source, row) in source.iter().zip(self.rows()) {
            for &(column, weight) in row {
                (0..D).for_each(|axis| target[column][axis] += weight * source[axis]);
            }
        }
    }
}
