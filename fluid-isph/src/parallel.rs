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
