//! Work is cut into chunks of fixed length, so that sums over chunks do not depend on the number of threads.

/// Rows per chunk.
pub(crate) const CHUNK: usize = 256;

/// Chunks that make one task where a row costs little (vector updates): about 4,000 rows.
pub(crate) const LIGHT: usize = 16;

/// Chunks that make one task where a row is a sum over neighbours.
pub(crate) const MEDIUM: usize = 4;

/// Number of chunks of `count` rows.
pub(crate) fn chunk_count(count: usize) -> usize {
    count.div_ceil(CHUNK)
}

/// a . b in double precision, with eight running sums so that additions overlap.
#[inline(always)]
pub(crate) fn dot_product(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0.0f64; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail = a.remainder().iter().zip(b.remainder());
    let tail: f64 = tail.map(|(&a, &b)| f64::from(a) * f64::from(b)).sum();
    for (a, b) in a.zip(b) {
        for k in 0..8 {
            sums[k] += f64::from(a[k]) * f64::from(b[k]);
        }
    }
    sums.iter().sum::<f64>() + tail
}
