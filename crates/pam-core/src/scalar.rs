//! The number type of the physics: `f64` for simulation, dual numbers for exact sensitivities.

use crate::dual::{Dual, Slope};
use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign};
use num_traits::{One, Zero};
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real number or a dual number over one. Every equation of this crate is generic over it, so
/// that one source of the physics gives values and exact first derivatives. The values of both are
/// the same bit for bit.
pub trait Scalar:
    Copy
    + Debug
    + PartialOrd
    + From<f64>
    + Zero
    + One
    + Neg<Output = Self>
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign<f64>
    + SubAssign<f64>
    + MulAssign<f64>
    + DivAssign<f64>
    + Send
    + Sync
    + 'static
{
    /// Derivatives that it carries.
    const DERIVATIVES: usize;

    /// Its value.
    fn re(&self) -> f64;

    /// Whether another number is the same to the last bit, derivatives included.
    fn same(&self, other: &Self) -> bool;

    /// A function of it, by its value and slope there.
    #[must_use]
    fn with(self, value: f64, slope: impl FnOnce() -> f64) -> Self;

    /// Magnitude.
    #[inline(always)]
    #[must_use]
    fn abs(self) -> Self {
        if self.re() < 0.0 {
            -self
        } else {
            self
        }
    }

    /// `1/x`.
    #[inline(always)]
    #[must_use]
    fn recip(self) -> Self {
        let inverse = self.re().recip();
        self.with(inverse, || -inverse * inverse)
    }

    /// `x^n` for a whole `n`.
    #[inline(always)]
    #[must_use]
    fn powi(self, n: i32) -> Self {
        let x = self.re();
        self.with(x.powi(n), || if n == 0 { 0.0 } else { f64::from(n) * x.powi(n - 1) })
    }

    /// `x^n`.
    #[inline(always)]
    #[must_use]
    fn powf(self, n: f64) -> Self {
        let x = self.re();
        self.with(x.powf(n), || if n == 0.0 { 0.0 } else { n * x.powf(n - 1.0) })
    }

    /// Square root.
    #[inline(always)]
    #[must_use]
    fn sqrt(self) -> Self {
        let root = self.re().sqrt();
        self.with(root, || 0.5 / root)
    }

    /// Exponential.
    #[inline(always)]
    #[must_use]
    fn exp(self) -> Self {
        let value = self.re().exp();
        self.with(value, || value)
    }

    /// `e^x - 1`.
    #[inline(always)]
    #[must_use]
    fn exp_m1(self) -> Self {
        let value = self.re().exp_m1();
        self.with(value, || value + 1.0)
    }

    /// Natural logarithm.
    #[inline(always)]
    #[must_use]
    fn ln(self) -> Self {
        let x = self.re();
        self.with(x.ln(), || x.recip())
    }

    /// `ln(1 + x)`.
    #[inline(always)]
    #[must_use]
    fn ln_1p(self) -> Self {
        let x = self.re();
        self.with(x.ln_1p(), || (x + 1.0).recip())
    }

    /// Sine.
    #[inline(always)]
    #[must_use]
    fn sin(self) -> Self {
        self.sin_cos().0
    }

    /// Cosine.
    #[inline(always)]
    #[must_use]
    fn cos(self) -> Self {
        self.sin_cos().1
    }

    /// Sine and cosine.
    #[inline(always)]
    #[must_use]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.re().sin_cos();
        (self.with(sin, || cos), self.with(cos, || -sin))
    }

    /// Tangent.
    #[inline(always)]
    #[must_use]
    fn tan(self) -> Self {
        let tan = self.re().tan();
        self.with(tan, || tan * tan + 1.0)
    }

    /// Angle of a tangent [rad].
    #[inline(always)]
    #[must_use]
    fn atan(self) -> Self {
        let x = self.re();
        self.with(x.atan(), || (x * x + 1.0).recip())
    }

    /// Hyperbolic tangent.
    #[inline(always)]
    #[must_use]
    fn tanh(self) -> Self {
        /// From here on it is 1 to the last digit.
        const FLAT: f64 = 20.0;
        let x = self.re();
        let tanh = if x.abs() > FLAT { x.signum() } else { x.tanh() };
        self.with(tanh, || 1.0 - tanh * tanh)
    }
}

impl Scalar for f64 {
    const DERIVATIVES: usize = 0;

    #[inline(always)]
    fn re(&self) -> f64 {
        *self
    }

    #[inline(always)]
    fn same(&self, other: &Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn with(self, value: f64, _: impl FnOnce() -> f64) -> Self {
        value
    }
}

impl<const N: usize> Scalar for Dual<N> {
    const DERIVATIVES: usize = N;

    #[inline(always)]
    fn re(&self) -> f64 {
        self.re
    }

    #[inline(always)]
    fn same(&self, other: &Self) -> bool {
        self.re == other.re && self.eps == other.eps
    }

    #[inline(always)]
    fn with(self, value: f64, slope: impl FnOnce() -> f64) -> Self {
        let slope = slope();
        // a root of zero is steep without end; what does not vary does not vary there either
        let steep = !slope.is_finite();
        let each = |e: f64| if steep && e == 0.0 { 0.0 } else { e * slope };
        Self { re: value, eps: self.eps.map(each) }
    }
}

/// A constant of type `S` (all derivatives zero).
#[inline(always)]
pub fn constant<S: Scalar>(value: f64) -> S {
    S::from(value)
}

/// Functions of one variable with all derivatives of it that `S` carries: found with one of them, the
/// others by the chain rule.
#[inline(always)]
pub fn chained<S: Scalar, const N: usize>(x: S, functions: impl Fn(Slope) -> [Slope; N]) -> [S; N] {
    functions(Slope::new(x.re(), 1.0)).map(|y| x.with(y.re, || y.slope()))
}
