//! Sparse Cholesky factor by faer (LLT, f64). Ordering: minimum degree, for large meshes nested dissection. The only
//! file that names faer.
//!
//! Sequential on purpose: the factor then has the same bits for any number of threads.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use super::block_matrix::{BlockMatrix, BlockPattern};
use super::ordering::nested_dissection;

/// Number of nodes from which nested dissection is used: it pays for large meshes; the threshold itself is not measured.
const DISSECT_ABOVE: usize = 20_000;

/// The matrix is not positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Indefinite;

/// A factor with its memory, reused from one factorisation to the next.
pub struct Cholesky {
    column_start: Vec<usize>,
    row: Vec<usize>,
    /// Value of the block matrix behind each value of the lower triangle.
    source: Vec<usize>,
    lower: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

impl Cholesky {
    /// Orders and analyses a pattern; `position` is that of its nodes, `[n, D]`.
    pub fn new(pattern: &BlockPattern, position: &[f64]) -> Self {
        let (column_start, row, source) = lower_triangle(pattern);
        let size = column_start.len() - 1;
        let matrix = SymbolicSparseColMatRef::new_checked(size, size, &column_start, None, &row);
        let params = CholeskySymbolicParams::default();
        let order = (pattern.node_count() > DISSECT_ABOVE).then(|| dissection(pattern, position));
        let ordering = match &order {
            None => SymmetricOrdering::Amd,
            Some((forward, back)) => SymmetricOrdering::Custom(PermRef::new_checked(forward, back, size)),
        };
        let symbolic = factorize_symbolic_cholesky(matrix, Side::Lower, ordering, params)
            .expect("analysing a valid pattern only fails when memory runs out");
        let factor_memory = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let solve_memory = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        Self {
            lower: vec![0.0; row.len()],
            factor: vec![0.0; symbolic.len_val()],
            memory: MemBuffer::new(factor_memory.or(solve_memory)),
            column_start,
            row,
            source,
            symbolic,
        }
    }

    /// Factors a matrix on the pattern.
    ///
    /// # Errors
    /// [`Indefinite`].
    pub fn factorize(&mut self, matrix: &BlockMatrix) -> Result<(), Indefinite> {
        for (value, &source) in self.lower.iter_mut().zip(&self.source) {
            *value = matrix.values[source];
        }
        let size = self.column_start.len() - 1;
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &self.column_start, None, &self.row);
        let result = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            SparseColMatRef::new(pattern, &self.lower),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Spec::default(),
        );
        result.map(|_| ()).map_err(|_| Indefinite)
    }

    /// Solves in place, `[n D]`.
    pub fn solve(&mut self, right_hand_side: &mut [f64]) {
        let size = right_hand_side.len();
        let vector = MatMut::from_column_major_slice_mut(right_hand_side, size, 1);
        let factor = LltRef::new(&self.symbolic, &self.factor);
        factor.solve_in_place_with_conj(Conj::No, vector, Par::Seq, MemStack::new(&mut self.memory));
    }

    /// The values of the factor.
    pub fn values(&self) -> &[f64] {
        &self.factor
    }

    /// Takes the values of a factor on the same pattern.
    pub fn set_values(&mut self, values: Vec<f64>) {
        assert_eq!(values.len(), self.factor.len(), "the factor of one pattern has one length");
        self.factor = values;
    }

    /// Bytes of the factor.
    pub fn factor_bytes(&self) -> usize {
        8 * self.factor.len()
    }
}

/// Components in the order of elimination, and the place of each component in it.
fn dissection(pattern: &BlockPattern, position: &[f64]) -> (Vec<usize>, Vec<usize>) {
    let d = pattern.dimension;
    let nodes = nested_dissection(pattern, position);
    let forward: Vec<usize> = nodes.iter().flat_map(|&node| node * d..(node + 1) * d).collect();
    let mut back = vec![0; forward.len()];
    for (place, &component) in forward.iter().enumerate() {
        back[component] = place;
    }
    (forward, back)
}

/// Compressed columns of the lower triangle (by symmetry the upper rows), and where each value comes from.
fn lower_triangle(pattern: &BlockPattern) -> (Vec<usize>, Vec<usize>, Vec<usize>) {
    let d = pattern.dimension;
    let (mut column_start, mut row, mut source) = (vec![0], Vec::new(), Vec::new());
    for node in 0..pattern.node_count() {
        for i in 0..d {
            for block in pattern.row_start[node]..pattern.row_start[node + 1] {
                for j in 0..d {
                    let other = pattern.column[block] as usize * d + j;
                    if other >= node * d + i {
                        row.push(other);
                        source.push(block * d * d + i * d + j);
                    }
                }
            }
            column_start.push(row.len());
        }
    }
    (column_start, row, source)
}
