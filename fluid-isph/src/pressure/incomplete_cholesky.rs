//! Preconditioner of the paper's ICCG: A is nearly L D L' with the pattern of A kept (Meijerink & van der Vorst 1977,
//! Math. Comp. 31, 148). It exists for every matrix of the assembly, which are M-matrices.
//!
//! Set-up and triangular solves are serial: that, and iterations that grow like 1/spacing, are its price beside the
//! multigrid.

use super::matrix::PressureMatrix;
use crate::parallel::CHUNK;

/// The factors; memory is kept from step to step.
#[derive(Debug, Default)]
pub struct IncompleteCholesky {
    /// End of each row of L below the diagonal.
    end: Vec<u32>,
    column: Vec<u32>,
    /// l_ik, -.
    value: Vec<f32>,
    /// 1/d_i, m2.
    inverse_pivot: Vec<f32>,
    /// d_j l_ij of the row in work, by column; zero elsewhere.
    work: Vec<f64>,
    row: Vec<(u32, f64)>,
    solution: Vec<f64>,
}

impl IncompleteCholesky {
    /// Factorises: l_ik = (a_ik - sum_j l_ij d_j l_kj)/d_k on the pattern of A, d_i = a_ii - sum_k l_ik^2 d_k.
    pub fn build(&mut self, matrix: &PressureMatrix) {
        let count = matrix.len();
        self.end.clear();
        self.column.clear();
        self.value.clear();
        self.inverse_pivot.clear();
        self.work.clear();
        self.work.resize(count, 0.0);
        for i in 0..count {
            let diagonal = self.take_row(matrix, i);
            let first = self.column.len();
            let mut pivot = diagonal;
            for at in 0..self.row.len() {
                let (k, entry) = self.row[at];
                let k = k as usize;
                let sum: f64 =
                    self.span(k).map(|m| f64::from(self.value[m]) * self.work[self.column[m] as usize]).sum();
                let scaled = entry - sum;
                let l = scaled * f64::from(self.inverse_pivot[k]);
                self.work[k] = scaled;
                pivot -= l * scaled;
                self.column.push(k as u32);
                self.value.push(l as f32);
            }
            for &k in &self.column[first..] {
                self.work[k as usize] = 0.0;
            }
            self.end.push(self.column.len() as u32);
            // Positive in exact arithmetic; rounding may eat it.
            self.inverse_pivot.push((1.0 / pivot.max(1e-3 * diagonal)) as f32);
        }
    }

    /// Gathers row `i` left of the diagonal, by rising column, each once; returns a_ii.
    fn take_row(&mut self, matrix: &PressureMatrix, i: usize) -> f64 {
        let (columns, values) = matrix.chunks[i / CHUNK].row(i % CHUNK);
        let mut diagonal = 0.0;
        self.row.clear();
        for (&j, &value) in columns.iter().zip(values) {
            match (j as usize).cmp(&i) {
                std::cmp::Ordering::Less => self.row.push((j, f64::from(value))),
                std::cmp::Ordering::Equal => diagonal += f64::from(value),
                std::cmp::Ordering::Greater => {}
            }
        }
        self.row.sort_unstable_by_key(|entry| entry.0);
        // An image of a neighbour may stand in the row beside the neighbour itself.
        self.row.dedup_by(|later, kept| {
            let same = later.0 == kept.0;
            kept.1 += if same { later.1 } else { 0.0 };
            same
        });
        diagonal
    }

    fn span(&self, row: usize) -> std::ops::Range<usize> {
        let first = if row == 0 { 0 } else { self.end[row - 1] as usize };
        first..self.end[row] as usize
    }

    /// z = (L D L')^-1 r; returns r . z.
    pub fn apply(&mut self, r: &[f32], z: &mut [f32]) -> f64 {
        self.solution.clear();
        for (i, &r) in r.iter().enumerate() {
            let sum: f64 =
                self.span(i).map(|m| f64::from(self.value[m]) * self.solution[self.column[m] as usize]).sum();
            self.solution.push(f64::from(r) - sum);
        }
        for (x, &inverse) in self.solution.iter_mut().zip(&self.inverse_pivot) {
            *x *= f64::from(inverse);
        }
        for i in (0..r.len()).rev() {
            let x = self.solution[i];
            for m in self.span(i) {
                self.solution[self.column[m] as usize] -= f64::from(self.value[m]) * x;
            }
        }
        let mut product = 0.0;
        for ((z, &x), &r) in z.iter_mut().zip(&self.solution).zip(r) {
            *z = x as f32;
            product += f64::from(*z) * f64::from(r);
        }
        product
    }
}
