//! The number type of the physics: `f64` for simulation, dual numbers for exact sensitivities.

use num_dual::DualNum;

/// A real number or a dual number over one. Every equation of this crate is generic over it, so
/// that one source of the physics gives values and exact first derivatives.
pub trait Scalar: DualNum<Primitive = f64> + Copy + nalgebra::Scalar {}

impl<T: DualNum<Primitive = f64> + Copy + nalgebra::Scalar> Scalar for T {}

/// A constant of type `S` (all derivatives zero).
#[inline(always)]
pub fn constant<S: Scalar>(value: f64) -> S {
    S::from(value)
}
