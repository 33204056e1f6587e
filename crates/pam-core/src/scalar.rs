//! The number type of the physics: `f64` for simulation, dual numbers for exact sensitivities.

use num_dual::{Dual64, DualNum};

/// A real number or a dual number over one. Every equation of this crate is generic over it, so
/// that one source of the physics gives values and exact first derivatives.
pub trait Scalar: DualNum<Primitive = f64> + Copy + nalgebra::Scalar + Send + Sync {}

impl<T: DualNum<Primitive = f64> + Copy + nalgebra::Scalar + Send + Sync> Scalar for T {}

/// A constant of type `S` (all derivatives zero).
#[inline(always)]
pub fn constant<S: Scalar>(value: f64) -> S {
    S::from(value)
}

/// Functions of one variable with all derivatives of it that `S` carries: found with one of them, the
/// others by the chain rule.
#[inline(always)]
pub fn chained<S: Scalar, const N: usize>(
    x: S,
    functions: impl Fn(Dual64) -> [Dual64; N],
) -> [S; N] {
    let change = x - x.re();
    functions(Dual64::new(x.re(), 1.0)).map(|y| change * y.eps + y.re)
}

/// Hyperbolic tangent, also where the exponentials that a dual number makes it of overflow.
#[inline]
pub fn tanh<S: Scalar>(x: S) -> S {
    /// From here on it is 1 to the last digit.
    const FLAT: f64 = 20.0;
    if x.re() > FLAT {
        constant(1.0)
    } else if x.re() < -FLAT {
        constant(-1.0)
    } else {
        x.tanh()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    #[test]
    fn a_flat_tangent_has_no_slope() {
        for x in [-2e3, -25.0, -1.0, 0.0, 0.3, 19.9, 25.0, 2e3] {
            let found = tanh(Dual64::new(x, 1.0));
            assert!((found.re - x.tanh()).abs() < 1e-15 && tanh(x) == x.tanh());
            assert!((found.eps - 1.0 / x.cosh().powi(2)).abs() < 1e-15, "{x}");
        }
    }
}
