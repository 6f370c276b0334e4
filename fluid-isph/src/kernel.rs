//! The smoothing kernel and its lattice constants.
//!
//! W is the cubic B-spline of Monaghan & Lattanzio (1985) with smoothing length 1.2 spacings (support 2.4 spacings).
//! F(r) = -W'(r)/r >= 0 carries gradient, divergence and Laplacian:
//! grad p = V sum F (p_j - p_i) (x_j - x_i), lap p = 2 V sum F (p_j - p_i). F is scaled once so that
//! V sum F r_x^2 = 1 on the lattice; then both are exact there for linear and quadratic fields.

use std::f64::consts::PI;

/// Smoothing length over particle spacing.
pub const SMOOTHING_RATIO: f64 = 1.2;

/// Kernel with the constants of the full lattice.
#[derive(Debug, Clone)]
pub struct Kernel<const D: usize> {
    /// h, m.
    pub smoothing_length: f64,
    /// 2 h: W and F vanish beyond, m.
    pub support_radius: f64,
    /// V of one particle, spacing^D, m^D.
    pub volume: f64,
    /// n0 = sum W on the full lattice, itself included, 1/m^D.
    pub lattice_density: f64,
    /// 2 V sum F on the full lattice, 1/m2: the diagonal of the pressure matrix far from any boundary.
    pub full_diagonal: f64,
    /// Factor of the shape function of W, 1/m^D.
    value_factor: f64,
    /// Factor of the shape function of F, scaled to the lattice, 1/m^(D+2).
    slope_factor: f64,
}

/// Shape functions of W and F at q = r/h: w = 1 - 1.5 q^2 + 0.75 q^3, f = 3 - 2.25 q for q < 1;
/// w = (2-q)^3/4, f = 0.75 (2-q)^2/q for 1 <= q < 2; 0 beyond.
#[inline(always)]
pub fn shape(q: f32) -> (f32, f32) {
    let t = (2.0 - q).max(0.0);
    let outer = (0.25 * t * t * t, 0.75 * t * t / q);
    let inner = (1.0 - q * q * (1.5 - 0.75 * q), 3.0 - 2.25 * q);
    if q < 1.0 { inner } else { outer }
}

impl<const D: usize> Kernel<D> {
    /// The kernel for a lattice of `particle_spacing` m.
    pub fn new(particle_spacing: f64) -> Self {
        let smoothing_length = SMOOTHING_RATIO * particle_spacing;
        let normalisation = if D == 2 { 10.0 / (7.0 * PI) } else { 1.0 / PI };
        let value_factor = normalisation / smoothing_length.powi(D as i32);
        let mut kernel = Self {
            smoothing_length,
            support_radius: 2.0 * smoothing_length,
            volume: particle_spacing.powi(D as i32),
            lattice_density: 0.0,
            full_diagonal: 0.0,
            value_factor,
            slope_factor: value_factor / (smoothing_length * smoothing_length),
        };
        let (mut density, mut second_moment, mut slope_sum) = (0.0, 0.0, 0.0);
        for_each_lattice_offset::<D>(|offset| {
            let r2: f64 = offset.iter().map(|&k| (k as f64 * particle_spacing).powi(2)).sum();
            let (value, slope) = kernel.evaluate(r2);
            density += value;
            if r2 > 0.0 {
                second_moment += slope * r2 / D as f64;
                slope_sum += slope;
            }
        });
        let scale = 1.0 / (kernel.volume * second_moment);
        kernel.slope_factor *= scale;
        kernel.lattice_density = density;
        kernel.full_diagonal = 2.0 * kernel.volume * slope_sum * scale;
        kernel
    }

    /// W (1/m^D) and the scaled F (1/m^(D+2)) at the squared distance `r2` m2.
    pub fn evaluate(&self, r2: f64) -> (f64, f64) {
        let (w, f) = shape(((r2 as f32) * self.inverse_square()).sqrt());
        (self.value_factor * f64::from(w), self.slope_factor * f64::from(f))
    }

    /// 1/h^2 as the neighbour loops use it, 1/m2.
    #[inline(always)]
    pub fn inverse_square(&self) -> f32 {
        (1.0 / (self.smoothing_length * self.smoothing_length)) as f32
    }

    /// Factor of w, so that W = factor w(q), 1/m^D.
    #[inline(always)]
    pub fn value_factor(&self) -> f64 {
        self.value_factor
    }

    /// 2 V times the factor of f, so that a_ij = 2 V F_ij = factor f(q), 1/m2.
    #[inline(always)]
    pub fn coupling_factor(&self) -> f32 {
        (2.0 * self.volume * self.slope_factor) as f32
    }
}

/// Calls `visit` with every lattice offset within three spacings along each axis.
fn for_each_lattice_offset<const D: usize>(mut visit: impl FnMut([i32; D])) {
    for number in 0..7usize.pow(D as u32) {
        let mut rest = number;
        visit(std::array::from_fn(|_| {
            let digit = rest % 7;
            rest /= 7;
            digit as i32 - 3
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral of W over the plane or space by the midpoint rule in the radius.
    fn integral<const D: usize>(kernel: &Kernel<D>) -> f64 {
        let steps = 4000;
        let dr = kernel.support_radius / f64::from(steps);
        let shell = |r: f64| if D == 2 { 2.0 * PI * r } else { 4.0 * PI * r * r };
        (0..steps).map(|k| (f64::from(k) + 0.5) * dr).map(|r| kernel.evaluate(r * r).0 * shell(r) * dr).sum()
    }

    #[test]
    fn the_integral_of_the_kernel_is_one() {
        assert!((integral(&Kernel::<2>::new(0.01)) - 1.0).abs() < 1e-5);
        assert!((integral(&Kernel::<3>::new(0.01)) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn slope_is_the_derivative_of_the_value_up_to_one_factor() {
        let kernel = Kernel::<2>::new(1.0);
        let unscaled = kernel.value_factor / (kernel.smoothing_length * kernel.smoothing_length);
        for r in [0.2, 0.7, 1.1, 1.3, 1.9, 2.3] {
            let (above, below) = (r + 1e-3f64, r - 1e-3f64);
            let derivative = (kernel.evaluate(above * above).0 - kernel.evaluate(below * below).0) / 2e-3;
            let slope = kernel.evaluate(r * r).1 * unscaled / kernel.slope_factor;
            assert!((slope * r + derivative).abs() < 3e-4, "r = {r}: {} {derivative}", slope * r);
        }
    }

    #[test]
    fn it_is_finite_at_zero_and_zero_outside_the_support() {
        let kernel = Kernel::<3>::new(0.1);
        let (value, slope) = kernel.evaluate(0.0);
        assert!(value.is_finite() && slope.is_finite() && value > 0.0);
        assert_eq!(kernel.evaluate((kernel.support_radius * 1.001).powi(2)), (0.0, 0.0));
    }

    #[test]
    fn laplacian_of_a_quadratic_and_gradient_of_a_linear_field_are_exact_on_the_lattice() {
        let kernel = Kernel::<3>::new(0.5);
        let (mut laplacian, mut gradient) = (0.0, [0.0; 3]);
        for_each_lattice_offset::<3>(|offset| {
            let r = offset.map(|k| 0.5 * f64::from(k));
            let r2: f64 = r.iter().map(|x| x * x).sum();
            let slope = kernel.evaluate(r2).1;
            laplacian += 2.0 * kernel.volume * slope * r[0] * r[0];
            for k in 0..3 {
                gradient[k] += kernel.volume * slope * (2.0 * r[0] - 3.0 * r[2]) * r[k];
            }
        });
        assert!((laplacian - 2.0).abs() < 1e-5);
        assert!(
            (gradient[0] - 2.0).abs() < 1e-5 && gradient[1].abs() < 1e-5 && (gradient[2] + 3.0).abs() < 1e-5
        );
    }

    #[test]
    fn the_lattice_has_as_many_neighbours_as_the_design_counts() {
        let support = Kernel::<3>::new(1.0).support_radius;
        let mut count = 0;
        for_each_lattice_offset::<3>(|o| {
            let r2 = f64::from(o.iter().map(|k| k * k).sum::<i32>());
            count += usize::from(r2 > 0.0 && r2 < support * support);
        });
        assert_eq!(count, 56);
    }
}
