//! Dual numbers: a value with its derivatives with respect to some variables at once.
//!
//! All derivatives are there all the time, in one array: sums over it need no branches, and a
//! compiler puts them into vectors (`docs/decisions/0001`). The price: what is divided by zero, or
//! multiplied with what is infinite, has no derivative any more, varying or not.

// derivatives of products and quotients are sums
#![allow(clippy::suspicious_arithmetic_impl)]

use num_traits::{One, Zero};
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A value with its derivatives with respect to `N` variables. Two are equal, or one is less, by
/// their values.
#[derive(Debug, Clone, Copy)]
pub struct Dual<const N: usize> {
    /// The value.
    pub re: f64,
    /// Its derivatives.
    pub eps: [f64; N],
}

/// Derivatives of a prediction at once.
pub const LANES: usize = 8;
/// Derivatives of a prediction that has more of them: ten at once cost half of twice eight.
pub const WIDE_LANES: usize = 16;

/// A value with one derivative.
pub type Slope = Dual<1>;

impl Slope {
    /// A value and its derivative.
    #[inline(always)]
    #[must_use]
    pub fn new(re: f64, slope: f64) -> Self {
        Self { re, eps: [slope] }
    }

    /// The derivative.
    #[inline(always)]
    #[must_use]
    pub fn slope(&self) -> f64 {
        self.eps[0]
    }
}

impl<const N: usize> Dual<N> {
    /// The same value, as the variable of one lane; a constant when there is no such lane.
    #[must_use]
    pub fn along(mut self, lane: usize) -> Self {
        self.eps = std::array::from_fn(|k| if k == lane { 1.0 } else { 0.0 });
        self
    }

    /// The derivatives from two numbers' own.
    #[inline(always)]
    fn both(re: f64, a: &[f64; N], b: &[f64; N], each: impl Fn(f64, f64) -> f64) -> Self {
        let mut eps = [0.0; N];
        for ((eps, a), b) in eps.iter_mut().zip(a).zip(b) {
            *eps = each(*a, *b);
        }
        Self { re, eps }
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline(always)]
    fn from(re: f64) -> Self {
        Self { re, eps: [0.0; N] }
    }
}

impl<const N: usize> PartialEq for Dual<N> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.re == other.re
    }
}

impl<const N: usize> PartialOrd for Dual<N> {
    #[inline(always)]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.re.partial_cmp(&other.re)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { re: -self.re, eps: self.eps.map(|e| -e) }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::both(self.re + other.re, &self.eps, &other.eps, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::both(self.re - other.re, &self.eps, &other.eps, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (x, y) = (self.re, other.re);
        Self::both(x * y, &self.eps, &other.eps, |a, b| a * y + b * x)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let ratio = self.re / other.re;
        let inverse = other.re.recip();
        Self::both(ratio, &self.eps, &other.eps, |a, b| (a - b * ratio) * inverse)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self { re: self.re + other, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        Self { re: self.re - other, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self { re: self.re * other, eps: self.eps.map(|e| e * other) }
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: f64) -> Self {
        let inverse = other.recip();
        Self { re: self.re / other, eps: self.eps.map(|e| e * inverse) }
    }
}

/// The operations that change the number on their left, by those that give a new one.
macro_rules! assigning {
    ($($operation:ident $assign:ident $method:ident $sign:tt),*) => {$(
        impl<const N: usize, T> $assign<T> for Dual<N>
        where
            Self: $operation<T, Output = Self>,
        {
            #[inline(always)]
            fn $method(&mut self, other: T) {
                *self = *self $sign other;
            }
        }
    )*};
}

assigning!(
    Add AddAssign add_assign +,
    Sub SubAssign sub_assign -,
    Mul MulAssign mul_assign *,
    Div DivAssign div_assign /
);

impl<const N: usize> Zero for Dual<N> {
    fn zero() -> Self {
        0.0.into()
    }

    fn is_zero(&self) -> bool {
        self.re == 0.0
    }
}

impl<const N: usize> One for Dual<N> {
    fn one() -> Self {
        1.0.into()
    }
}

#[cfg(test)]
mod tests;
