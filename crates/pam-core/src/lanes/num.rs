//! Numbers of several plants side by side, and the few functions that their equations need.
//!
//! Every operation is one of IEEE 754 on each lane (add, multiply, divide, root, compare, select),
//! in a fixed order, without fused multiply-adds and without sums over lanes: a lane has the same
//! bits whatever its neighbours hold, and however many there are.

use pulp::bytemuck;
use pulp::Simd;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// One number of each lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Num<S: Simd> {
    simd: S,
    lanes: S::f64s,
}

/// Yes or no for each lane.
#[derive(Clone, Copy)]
pub(super) struct Mask<S: Simd> {
    simd: S,
    lanes: S::m64s,
}

impl<S: Simd> Num<S> {
    /// The same number in each lane.
    #[inline(always)]
    pub fn splat(simd: S, value: f64) -> Self {
        Self { simd, lanes: simd.splat_f64s(value) }
    }

    /// A number for each lane; as many as there are lanes.
    #[inline(always)]
    pub fn load(simd: S, values: &[f64]) -> Self {
        Self { simd, lanes: simd.partial_load_f64s(values) }
    }

    /// The numbers, one for each lane.
    #[inline(always)]
    pub fn numbers(&self) -> &[f64] {
        bytemuck::cast_slice(std::slice::from_ref(&self.lanes))
    }

    /// The same, to be written.
    #[inline(always)]
    pub fn numbers_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(std::slice::from_mut(&mut self.lanes))
    }

    /// The same number in each lane, of the kind of this one.
    #[inline(always)]
    pub fn constant(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn with(self, lanes: S::f64s) -> Self {
        Self { lanes, ..self }
    }

    /// Where this is less.
    #[inline(always)]
    pub fn less(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, lanes: self.simd.less_than_f64s(self.lanes, other.lanes) }
    }

    /// Where this is at most the other.
    #[inline(always)]
    pub fn at_most(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, lanes: self.simd.less_than_or_equal_f64s(self.lanes, other.lanes) }
    }

    /// The greater one; `other` where this is not a number.
    #[inline(always)]
    pub fn or_above(self, other: Self) -> Self {
        other.less(self).select(self, other)
    }

    /// The lesser one; `other` where this is not a number.
    #[inline(always)]
    pub fn or_below(self, other: Self) -> Self {
        self.less(other).select(self, other)
    }

    /// Magnitude.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.with(self.simd.abs_f64s(self.lanes))
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.with(self.simd.sqrt_f64s(self.lanes))
    }

    /// Nearest whole number of magnitudes below 2^51, halves to the even one.
    #[inline(always)]
    pub fn round(self) -> Self {
        (self + WHOLE) - WHOLE
    }

    /// A polynomial, its coefficients from the lowest power on: even and odd powers in two chains.
    #[inline(always)]
    pub fn polynomial<const N: usize>(self, coefficients: &[f64; N]) -> Self {
        let square = self * self;
        let (mut even, mut odd) = (self.constant(0.0), self.constant(0.0));
        for power in (0..N).rev() {
            let chain = if power % 2 == 0 { &mut even } else { &mut odd };
            *chain = *chain * square + coefficients[power];
        }
        even + odd * self
    }

    /// Sine of angles of a few turns at most, to 3e-16.
    #[inline(always)]
    pub fn sin(self) -> Self {
        // Pi in two parts: the first has so few digits that its multiples are exact.
        const PI_HIGH: f64 = 3.141_592_502_593_994;
        const PI_LOW: f64 = 1.509_957_990_978_376_5e-7;
        let half_turns = (self * std::f64::consts::FRAC_1_PI).round();
        let x = (self - half_turns * PI_HIGH) - half_turns * PI_LOW;
        let pairs = (half_turns * 0.5).round();
        let odd = (half_turns - pairs * 2.0).abs();
        let square = x * x;
        let sine = x + x * square * square.polynomial(&SINE);
        sine * (odd * -2.0 + 1.0)
    }

    /// Hyperbolic tangent, to 1e-14 absolutely.
    #[inline(always)]
    pub fn tanh(self) -> Self {
        // (1 - E)/(1 + E) with E = exp(-2 |x|), the 64th power of exp(-|x|/32); 1 from 20 on.
        let size = self.abs().or_below(self.constant(20.0));
        let mut power = (size * (-1.0 / 32.0)).polynomial(&EXPONENTIAL);
        for _ in 0..6 {
            power = power * power;
        }
        let share = (-power + 1.0) / (power + 1.0);
        let share = self.less(self.constant(0.0)).select(-share, share);
        // NaN stays what it is: it is not at most anything.
        self.abs().at_most(self.constant(f64::INFINITY)).select(share, self)
    }
}

/// Adding it leaves no place for a fraction.
pub(super) const WHOLE: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52

/// `(sin x - x)/x^3` in powers of `x^2`, Taylor's: up to a quarter turn the rest is below 1e-16.
const SINE: [f64; 9] = [
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5_040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 355_687_428_096_000.0,
    -1.0 / 121_645_100_408_832_000.0,
];

/// Taylor's series of the exponential: from -0.625 to 0 the rest is below 1e-16.
const EXPONENTIAL: [f64; 14] = {
    let mut terms = [1.0; 14];
    let mut k = 1;
    while k < 14 {
        terms[k] = terms[k - 1] / k as f64;
        k += 1;
    }
    terms
};

impl<S: Simd> Mask<S> {
    /// One number where it holds, another where it does not.
    #[inline(always)]
    pub fn select(self, yes: Num<S>, no: Num<S>) -> Num<S> {
        yes.with(self.simd.select_f64s(self.lanes, yes.lanes, no.lanes))
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $lanes:ident) => {
        impl<S: Simd> $trait for Num<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                self.with(self.simd.$lanes(self.lanes, other.lanes))
            }
        }

        impl<S: Simd> $trait<f64> for Num<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                self.with(self.simd.$lanes(self.lanes, self.simd.splat_f64s(other)))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for Num<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.with(self.simd.neg_f64s(self.lanes))
    }
}

impl<S: Simd> AddAssign for Num<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
