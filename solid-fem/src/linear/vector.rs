//! Sums over long vectors in fixed chunks: the same bits for any number of threads.

use rayon::prelude::*;

/// Values summed by one thread at a time.
const CHUNK: usize = 2048;

/// a . b, with room for the partial sums.
#[derive(Debug, Default, Clone)]
pub struct Summation {
    partial: Vec<f64>,
}

impl Summation {
    /// For vectors of this length.
    pub fn new(length: usize) -> Self {
        Self { partial: vec![0.0; length.div_ceil(CHUNK)] }
    }

    /// a . b.
    pub fn dot(&mut self, a: &[f64], b: &[f64]) -> f64 {
        if a.len() <= 4 * CHUNK {
            return a.chunks(CHUNK).zip(b.chunks(CHUNK)).map(|(a, b)| dot(a, b)).sum();
        }
        self.partial
            .par_iter_mut()
            .zip(a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)))
            .for_each(|(partial, (a, b))| *partial = dot(a, b));
        self.partial.iter().sum()
    }

    /// Euclidean norm.
    pub fn norm(&mut self, a: &[f64]) -> f64 {
        self.dot(a, a).sqrt()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
