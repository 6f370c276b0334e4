//! The few operations on points and vectors the particle loops need, for 2 and 3 dimensions alike.

/// A point or vector, `[D]`.
pub type Vector<const D: usize> = [f64; D];

/// a - b.
#[inline(always)]
pub fn sub<const D: usize>(a: &Vector<D>, b: &Vector<D>) -> Vector<D> {
    std::array::from_fn(|k| a[k] - b[k])
}

/// a . b, summed in the order of the axes.
#[inline(always)]
pub fn dot<const D: usize>(a: &Vector<D>, b: &Vector<D>) -> f64 {
    let mut sum = 0.0;
    for k in 0..D {
        sum += a[k] * b[k];
    }
    sum
}

/// a += s b.
#[inline(always)]
pub fn add_scaled<const D: usize>(a: &mut Vector<D>, s: f64, b: &Vector<D>) {
    for k in 0..D {
        a[k] += s * b[k];
    }
}

/// |a|.
#[inline(always)]
pub fn norm<const D: usize>(a: &Vector<D>) -> f64 {
    dot(a, a).sqrt()
}

/// a / |a|, or zero for the zero vector.
#[inline(always)]
pub fn normalised<const D: usize>(a: &Vector<D>) -> Vector<D> {
    let length = norm(a);
    if length > 0.0 { std::array::from_fn(|k| a[k] / length) } else { [0.0; D] }
}
