//! The smoothing kernel and its lattice constants.
//!
//! By default W is the cubic B-spline of Monaghan & Lattanzio (1985) with smoothing length 1.2 spacings (support 2.4
//! spacings); its shape and reach are those of a [`KernelShape`]. F(r) = -W'(r)/r >= 0 carries gradient, divergence and Laplacian:
//! grad p = V sum F (p_j - p_i) (x_j - x_i), lap p = 2 V sum F (p_j - p_i). F is scaled once so that
//! V sum F r_x^2 = 1 on the lattice; then both are exact there for linear and quadratic fields.

use crate::kernel_shape::KernelShape;

/// Kernel with the constants of the full lattice.
#[derive(Debug, Clone)]
pub struct Kernel<const D: usize> {
    /// Shape of W.
    pub shape: KernelShape,
    /// Distance of the particles on the lattice, m.
    pub spacing: f64,
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

impl<const D: usize> Kernel<D> {
    /// The kernel of a shape for a lattice of `particle_spacing` m.
    pub fn new(shape: KernelShape, particle_spacing: f64) -> Self {
        let smoothing_length = shape.smoothing_ratio() * particle_spacing;
        let value_factor = shape.normalisation(D) / smoothing_length.powi(D as i32);
        let mut kernel = Self {
            shape,
            spacing: particle_spacing,
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
        let (w, f) = self.shape.evaluate(((r2 as f32) * self.inverse_square()).sqrt());
        (self.value_factor * f64::from(w), self.slope_factor * f64::from(f))
    }

    /// Neighbours of a particle on the full lattice, those at the end of the support left out.
    pub fn lattice_neighbours(&self) -> usize {
        let mut count = 0;
        for_each_lattice_offset::<D>(|offset| {
            let r2 = self.spacing.powi(2) * f64::from(offset.iter().map(|k| k * k).sum::<i32>());
            count += usize::from(r2 > 0.0 && r2 < self.support_radius.powi(2) * (1.0 - 1e-9));
        });
        count
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
    use std::f64::consts::PI;

    use super::*;
    use crate::kernel_shape::ALL;

    /// Integral of W over the plane or space by the midpoint rule in the radius.
    fn integral<const D: usize>(kernel: &Kernel<D>) -> f64 {
        let steps = 4000;
        let dr = kernel.support_radius / f64::from(steps);
        let shell = |r: f64| if D == 2 { 2.0 * PI * r } else { 4.0 * PI * r * r };
        (0..steps).map(|k| (f64::from(k) + 0.5) * dr).map(|r| kernel.evaluate(r * r).0 * shell(r) * dr).sum()
    }

    #[test]
    fn the_integral_of_the_kernel_is_one() {
        for shape in ALL {
            let (plane, space) = (Kernel::<2>::new(shape, 0.01), Kernel::<3>::new(shape, 0.01));
            assert!((integral(&plane) - 1.0).abs() < 1e-5, "{shape:?}");
            assert!((integral(&space) - 1.0).abs() < 1e-5, "{shape:?}");
        }
    }

    #[test]
    fn slope_is_the_derivative_of_the_value_up_to_one_factor() {
        for shape in ALL {
            let kernel = Kernel::<2>::new(shape, 1.0);
            let unscaled = kernel.value_factor / (kernel.smoothing_length * kernel.smoothing_length);
            for r in [0.2, 0.7, 1.1, 1.3, 1.9, 2.3, 2.8] {
                let (above, below) = (r + 1e-3f64, r - 1e-3f64);
                let derivative = (kernel.evaluate(above * above).0 - kernel.evaluate(below * below).0) / 2e-3;
                let slope = kernel.evaluate(r * r).1 * unscaled / kernel.slope_factor;
                assert!(
                    (slope * r + derivative).abs() < 3e-4,
                    "{shape:?} at {r}: {} {derivative}",
                    slope * r
                );
            }
        }
    }

    #[test]
    fn it_is_finite_at_zero_and_zero_outside_the_support() {
        for shape in ALL {
            let kernel = Kernel::<3>::new(shape, 0.1);
            let (value, slope) = kernel.evaluate(0.0);
            assert!(value.is_finite() && slope.is_finite() && value > 0.0, "{shape:?}");
            assert_eq!(kernel.evaluate((kernel.support_radius * 1.001).powi(2)), (0.0, 0.0), "{shape:?}");
        }
    }

    #[test]
    fn laplacian_of_a_quadratic_and_gradient_of_a_linear_field_are_exact_on_the_lattice() {
        for shape in ALL {
            let kernel = Kernel::<3>::new(shape, 0.5);
            let (mut laplacian, mut gradient) = (0.0, [0.0; 3]);
            for_each_lattice_offset::<3>(|offset| {
                let r = offset.map(|k| 0.5 * f64::from(k));
                let r2: f64 = r.iter().map(|x| x * x).sum();
                let slope = if r2 > 0.0 { kernel.evaluate(r2).1 } else { 0.0 };
                laplacian += 2.0 * kernel.volume * slope * r[0] * r[0];
                for k in 0..3 {
                    gradient[k] += kernel.volume * slope * (2.0 * r[0] - 3.0 * r[2]) * r[k];
                }
            });
            assert!((laplacian - 2.0).abs() < 1e-5, "{shape:?}: {laplacian}");
            let error = [gradient[0] - 2.0, gradient[1], gradient[2] + 3.0].map(f64::abs);
            assert!(error.iter().all(|&error| error < 1e-5), "{shape:?}: {gradient:?}");
        }
    }

    #[test]
    fn the_lattice_has_as_many_neighbours_as_the_design_counts() {
        for (shape, plane, space) in [(KernelShape::CubicSpline, 20, 56), (KernelShape::WendlandC2, 24, 92)] {
            assert_eq!(Kernel::<2>::new(shape, 1.0).lattice_neighbours(), plane);
            assert_eq!(Kernel::<3>::new(shape, 1.0).lattice_neighbours(), space);
        }
    }
}
