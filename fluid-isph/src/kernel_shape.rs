//! Shapes a kernel may have. All are functions of q = r/h that end at q = 2, whatever their authors' scaling.

use std::f64::consts::PI;

/// Shape of the smoothing kernel, chosen once per scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KernelShape {
    /// Cubic B-spline of Monaghan & Lattanzio (1985), Astron. Astrophys. 149, 135; reaches 2.4 spacings.
    CubicSpline,
    /// C2 function of Wendland (1995), Adv. Comput. Math. 4, 389; reaches 3 spacings: quieter, and dearer.
    WendlandC2,
}

/// All shapes.
pub const ALL: [KernelShape; 2] = [KernelShape::CubicSpline, KernelShape::WendlandC2];

impl KernelShape {
    /// Smoothing length h over particle spacing; the support is twice that.
    pub fn smoothing_ratio(self) -> f64 {
        match self {
            Self::CubicSpline => 1.2,
            Self::WendlandC2 => 1.5,
        }
    }

    /// Layers of wall particles behind a face that water in front of it can see, the first half a spacing behind.
    pub fn wall_layers(self) -> usize {
        (2.0 * self.smoothing_ratio() - 0.5).ceil() as usize
    }

    /// h^D over the integral of w, -.
    pub fn normalisation(self, dimension: usize) -> f64 {
        match (self, dimension) {
            (Self::CubicSpline, 2) => 10.0 / (7.0 * PI),
            (Self::CubicSpline, _) => 1.0 / PI,
            (Self::WendlandC2, 2) => 7.0 / (4.0 * PI),
            (Self::WendlandC2, _) => 21.0 / (16.0 * PI),
        }
    }

    /// w and f at q = r/h.
    pub fn evaluate(self, q: f32) -> (f32, f32) {
        match self {
            Self::CubicSpline => CubicSpline.evaluate(q),
            Self::WendlandC2 => WendlandC2.evaluate(q),
        }
    }
}

/// A shape as a loop over neighbours is compiled for it.
pub trait Shape: Copy + Send + Sync {
    /// w and f = -w'/q at q = r/h, up to the factors of the kernel: w is 1 at 0, both are 0 from q = 2 on.
    fn evaluate(self, q: f32) -> (f32, f32);
}

/// Evaluates an expression with the type of a shape known: once for a whole loop, not once for each pair.
macro_rules! with_shape {
    ($kind:expr, $shape:ident => $body:expr) => {
        match $kind {
            $crate::kernel_shape::KernelShape::CubicSpline => {
                let $shape = $crate::kernel_shape::CubicSpline;
                $body
            }
            $crate::kernel_shape::KernelShape::WendlandC2 => {
                let $shape = $crate::kernel_shape::WendlandC2;
                $body
            }
        }
    };
}
pub(crate) use with_shape;

/// w = 1 - 1.5 q^2 + 0.75 q^3, f = 3 - 2.25 q for q < 1; w = (2-q)^3/4, f = 0.75 (2-q)^2/q for 1 <= q < 2.
#[derive(Debug, Clone, Copy)]
pub struct CubicSpline;

impl Shape for CubicSpline {
    #[inline(always)]
    fn evaluate(self, q: f32) -> (f32, f32) {
        let t = (2.0 - q).max(0.0);
        let outer = (0.25 * t * t * t, 0.75 * t * t / q);
        let inner = (1.0 - q * q * (1.5 - 0.75 * q), 3.0 - 2.25 * q);
        if q < 1.0 { inner } else { outer }
    }
}

/// w = (1 - q/2)^4 (1 + 2 q), f = 5 (1 - q/2)^3.
#[derive(Debug, Clone, Copy)]
pub struct WendlandC2;

impl Shape for WendlandC2 {
    #[inline(always)]
    fn evaluate(self, q: f32) -> (f32, f32) {
        let t = (1.0 - 0.5 * q).max(0.0);
        let cube = t * t * t;
        (cube * t * (1.0 + 2.0 * q), 5.0 * cube)
    }
}
