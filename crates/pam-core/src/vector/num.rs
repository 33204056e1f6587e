//! Numbers of several plants side by side, and the few functions that their equations need.
//!
//! Every operation is one of IEEE 754 on each lane (add, multiply, multiply and add with one
//! rounding, divide, root, compare, select), in a fixed order and without sums over lanes: a lane
//! has the same bits whatever its neighbours hold, and however many there are. What is multiplied
//! and added at once is said to be ([`Num::times_plus`]): no compiler chooses. A processor without
//! such an instruction finds the same number with many others.

use pulp::bytemuck;
use pulp::{Scalar, Simd, WithSimd};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Vector registers that hold a number of many plants: while one waits for a result the other is
/// worked on. A plant alone has one.
pub(crate) const PAIR: usize = 2;
/// Lanes at most.
pub(crate) const MOST_LANES: usize = 8 * PAIR;

/// Do something with registers of four numbers where there are such: the columns of a plant alone,
/// or a few plants, do not fill wider ones, and each width is compiled anew.
#[inline(always)]
pub(crate) fn in_fours<W: WithSimd>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    return match pulp::x86::V3::try_new() {
        Some(simd) => Simd::vectorize(simd, work),
        None => work.with_simd(Scalar),
    };
    #[cfg(not(target_arch = "x86_64"))]
    pulp::Arch::new().dispatch(work)
}

/// The registers that hold a number: how many they are, and how they stand in memory.
pub(crate) trait Registers: Copy + 'static {
    /// How many they are.
    const COUNT: usize;
    /// One thing for each of them.
    type Each<T: Copy + Send + Sync + 'static>: Copy + Send + Sync + AsRef<[T]> + AsMut<[T]>;

    /// The same thing for each.
    fn each<T: Copy + Send + Sync + 'static>(value: T) -> Self::Each<T>;
}

/// The register of a plant alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Single;

impl Registers for Single {
    const COUNT: usize = 1;
    type Each<T: Copy + Send + Sync + 'static> = [T; 1];

    #[inline(always)]
    fn each<T: Copy + Send + Sync + 'static>(value: T) -> [T; 1] {
        [value]
    }
}

/// The registers of plants side by side, which begin a line of the cache: one that lies across two
/// lines takes twice as long to read and to write.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair;

/// What begins a line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Aligned<T>(pub T);

impl<T, const N: usize> AsRef<[T]> for Aligned<[T; N]> {
    #[inline(always)]
    fn as_ref(&self) -> &[T] {
        &self.0
    }
}

impl<T, const N: usize> AsMut<[T]> for Aligned<[T; N]> {
    #[inline(always)]
    fn as_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl Registers for Pair {
    const COUNT: usize = PAIR;
    type Each<T: Copy + Send + Sync + 'static> = Aligned<[T; PAIR]>;

    #[inline(always)]
    fn each<T: Copy + Send + Sync + 'static>(value: T) -> Aligned<[T; PAIR]> {
        Aligned([value; PAIR])
    }
}

/// How many plants there are side by side.
#[inline(always)]
pub(crate) const fn side_by_side<S: Simd, R: Registers>() -> usize {
    S::F64_LANES * R::COUNT
}

/// One number of each lane.
#[derive(Clone, Copy)]
pub(crate) struct Num<S: Simd, R: Registers> {
    simd: S,
    lanes: R::Each<S::f64s>,
}

/// Yes or no for each lane.
#[derive(Clone, Copy)]
pub(crate) struct Mask<S: Simd, R: Registers> {
    simd: S,
    lanes: R::Each<S::m64s>,
}

/// What a number is multiplied by, or what is added to it: a number of each lane, or one of all.
pub(crate) trait Operand<S: Simd, R: Registers> {
    /// As a number of each lane.
    fn in_lanes(self, simd: S) -> Num<S, R>;
}

impl<S: Simd, R: Registers> Operand<S, R> for Num<S, R> {
    #[inline(always)]
    fn in_lanes(self, _: S) -> Self {
        self
    }
}

impl<S: Simd, R: Registers> Operand<S, R> for f64 {
    #[inline(always)]
    fn in_lanes(self, simd: S) -> Num<S, R> {
        Num::splat(simd, self)
    }
}

impl<S: Simd, R: Registers> Num<S, R> {
    /// The same number in each lane.
    #[inline(always)]
    pub fn splat(simd: S, value: f64) -> Self {
        Self { simd, lanes: R::each(simd.splat_f64s(value)) }
    }

    /// A number for each lane; as many as there are lanes.
    #[inline(always)]
    pub fn load(simd: S, values: &[f64]) -> Self {
        let mut number = Self::splat(simd, 0.0);
        number.numbers_mut().copy_from_slice(values);
        number
    }

    /// The numbers, one for each lane.
    #[inline(always)]
    pub fn numbers(&self) -> &[f64] {
        bytemuck::cast_slice(self.lanes.as_ref())
    }

    /// The same, to be written.
    #[inline(always)]
    pub fn numbers_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(self.lanes.as_mut())
    }

    /// Eight numbers of each lane of one register, which stand lane by lane, put where they belong.
    #[inline(always)]
    pub fn turn(simd: S, rows: &[f64], columns: &mut [Self; 8], register: usize) {
        let (rows_of, _) = S::as_simd_f64s(rows);
        // pulp: registers as rows of two or of four numbers, turned; lanes in the order that it says
        match (S::F64_LANES, rows_of) {
            (8, [a, b, c, d, e, f, g, h, ..]) => {
                // numbers k and k + 4 of four lanes each, then of all eight
                let first = simd.deinterleave_shfl_f64s([*a, *b, *c, *d]);
                let last = simd.deinterleave_shfl_f64s([*e, *f, *g, *h]);
                for k in [0, 2] {
                    let [x, y] = simd.deinterleave_shfl_f64s([first[k], first[k + 1]]);
                    let [z, w] = simd.deinterleave_shfl_f64s([last[k], last[k + 1]]);
                    let found = simd.deinterleave_shfl_f64s([x, y, z, w]);
                    for (place, lanes) in [k, k + 1, k + 4, k + 5].into_iter().zip(found) {
                        columns[place].lanes.as_mut()[register] = lanes;
                    }
                }
            }
            (4, [a, b, c, d, e, f, g, h, ..]) => {
                let low = simd.deinterleave_shfl_f64s([*a, *c, *e, *g]);
                let high = simd.deinterleave_shfl_f64s([*b, *d, *f, *h]);
                for (column, lanes) in columns.iter_mut().zip(low.into_iter().chain(high)) {
                    column.lanes.as_mut()[register] = lanes;
                }
            }
            _ => {
                for (k, column) in columns.iter_mut().enumerate() {
                    let numbers = &mut column.numbers_mut()[register * S::F64_LANES..];
                    for (number, row) in numbers.iter_mut().zip(rows.chunks_exact(8)) {
                        *number = row[k];
                    }
                }
            }
        }
    }

    /// The same number in each lane, of the kind of this one.
    #[inline(always)]
    pub fn constant(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn map(mut self, of: impl Fn(S, S::f64s) -> S::f64s) -> Self {
        let Self { simd, lanes } = &mut self;
        for own in lanes.as_mut() {
            *own = of(*simd, *own);
        }
        self
    }

    #[inline(always)]
    fn with(mut self, other: Self, of: impl Fn(S, S::f64s, S::f64s) -> S::f64s) -> Self {
        let Self { simd, lanes } = &mut self;
        for (own, other) in lanes.as_mut().iter_mut().zip(other.lanes.as_ref()) {
            *own = of(*simd, *own, *other);
        }
        self
    }

    #[inline(always)]
    fn compare(self, other: Self, of: impl Fn(S, S::f64s, S::f64s) -> S::m64s) -> Mask<S, R> {
        let Self { simd, lanes: own } = self;
        let (own, other) = (own.as_ref(), other.lanes.as_ref());
        let mut lanes = R::each(of(simd, own[0], other[0]));
        for (k, mask) in lanes.as_mut().iter_mut().enumerate().skip(1) {
            *mask = of(simd, own[k], other[k]);
        }
        Mask { simd, lanes }
    }

    /// One number where this one is between two others, another where it is not, or no number.
    #[inline(always)]
    pub fn inside(self, low: Self, high: Self, yes: Self, no: Self) -> Self {
        self.at_most(high).select(low.at_most(self).select(yes, no), no)
    }

    /// Where this is less.
    #[inline(always)]
    pub fn less(self, other: Self) -> Mask<S, R> {
        self.compare(other, |simd, a, b| simd.less_than_f64s(a, b))
    }

    /// Where this is at most the other.
    #[inline(always)]
    pub fn at_most(self, other: Self) -> Mask<S, R> {
        self.compare(other, |simd, a, b| simd.less_than_or_equal_f64s(a, b))
    }

    /// The greater one; `other` where either is not a number, or where they are equal.
    #[inline(always)]
    pub fn or_above(self, other: impl Operand<S, R>) -> Self {
        let other = other.in_lanes(self.simd);
        if S::F64_LANES == 1 {
            return other.less(self).select(self, other);
        }
        // of the vector registers in use the same is one instruction
        self.with(other, |simd, a, b| simd.max_f64s(a, b))
    }

    /// The lesser one; `other` where either is not a number, or where they are equal.
    #[inline(always)]
    pub fn or_below(self, other: impl Operand<S, R>) -> Self {
        let other = other.in_lanes(self.simd);
        if S::F64_LANES == 1 {
            return self.less(other).select(self, other);
        }
        self.with(other, |simd, a, b| simd.min_f64s(a, b))
    }

    /// `self by + plus`, rounded once.
    #[inline(always)]
    pub fn times_plus(self, by: impl Operand<S, R>, plus: impl Operand<S, R>) -> Self {
        self.fused(by, plus, |simd, a, b, c| simd.mul_add_f64s(a, b, c))
    }

    /// `from - self by`, rounded once.
    #[inline(always)]
    pub fn times_from(self, by: impl Operand<S, R>, from: impl Operand<S, R>) -> Self {
        self.fused(by, from, |simd, a, b, c| simd.negate_mul_add_f64s(a, b, c))
    }

    #[inline(always)]
    fn fused(
        mut self,
        by: impl Operand<S, R>,
        plus: impl Operand<S, R>,
        of: impl Fn(S, S::f64s, S::f64s, S::f64s) -> S::f64s,
    ) -> Self {
        let (by, plus) = (by.in_lanes(self.simd), plus.in_lanes(self.simd));
        let Self { simd, lanes } = &mut self;
        let (by, plus) = (by.lanes.as_ref(), plus.lanes.as_ref());
        for (k, own) in lanes.as_mut().iter_mut().enumerate() {
            *own = of(*simd, *own, by[k], plus[k]);
        }
        self
    }

    /// Magnitude.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.map(|simd, a| simd.abs_f64s(a))
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(|simd, a| simd.sqrt_f64s(a))
    }

    /// Nearest whole number of magnitudes below 2^51, halves to the even one.
    #[inline(always)]
    pub fn round(self) -> Self {
        (self + WHOLE) - WHOLE
    }

    /// A polynomial, its coefficients from the lowest power on, by Estrin's rule: pairs, pairs of
    /// pairs and so on, so that little waits for each other.
    #[inline(always)]
    pub fn polynomial<const N: usize>(self, coefficients: &[f64; N]) -> Self {
        let mut terms = [self; N];
        for k in 0..N / 2 {
            let odd = self.constant(coefficients[2 * k + 1]);
            terms[k] = odd.times_plus(self, coefficients[2 * k]);
        }
        if N % 2 == 1 {
            terms[N / 2] = self.constant(coefficients[N - 1]);
        }
        // Level by level, so that the compiler knows each place.
        let power = self.paired(&mut terms, N.div_ceil(2));
        let power = power.paired(&mut terms, N.div_ceil(4));
        let power = power.paired(&mut terms, N.div_ceil(8));
        power.paired(&mut terms, N.div_ceil(16));
        const { assert!(N <= 32) }
        terms[0]
    }

    /// The first `left` terms two by two, by the square of this power, which comes back.
    #[inline(always)]
    fn paired<const N: usize>(self, terms: &mut [Self; N], left: usize) -> Self {
        if left < 2 {
            return self;
        }
        let power = self * self;
        for k in 0..left / 2 {
            terms[k] = terms[2 * k + 1].times_plus(power, terms[2 * k]);
        }
        if left % 2 == 1 {
            terms[left / 2] = terms[left - 1];
        }
        power
    }

    /// Sine of angles of a few turns at most, to 3e-16.
    #[inline(always)]
    pub fn sin(self) -> Self {
        // Pi in two parts: the first has so few digits that its multiples are exact.
        const PI_HIGH: f64 = 3.141_592_502_593_994;
        const PI_LOW: f64 = 1.509_957_990_978_376_5e-7;
        let half_turns = (self * std::f64::consts::FRAC_1_PI).round();
        let x = half_turns.times_from(PI_LOW, half_turns.times_from(PI_HIGH, self));
        let pairs = (half_turns * 0.5).round();
        let odd = pairs.times_from(2.0, half_turns).abs();
        x.sin_near() * odd.times_plus(-2.0, 1.0)
    }

    /// Sine of angles up to [`NEAR`], to 3e-16; of others that of the limit.
    #[inline(always)]
    pub fn sin_near(self) -> Self {
        let x = self.or_above(-NEAR).or_below(NEAR);
        let square = x * x;
        (x * square).times_plus(square.polynomial(&SINE), x)
    }

    /// Natural logarithm of positive, normal numbers, to 4e-16 of it or absolutely.
    #[inline(always)]
    pub fn ln(self) -> Self {
        // self = 2^k m with m from sqrt(1/2) to sqrt(2), and ln m = 2 artanh((m - 1)/(m + 1)).
        const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1; // so few digits that k times it is exact
        const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
        let (mut whole, mut rest) = (self, self);
        for (whole, rest) in whole.numbers_mut().iter_mut().zip(rest.numbers_mut()) {
            let bits = rest.to_bits();
            let above = bits.wrapping_sub(std::f64::consts::FRAC_1_SQRT_2.to_bits());
            *whole = f64::from((above as i64 >> 52) as i32);
            *rest = f64::from_bits(bits.wrapping_sub(above & (0xfff << 52)));
        }
        let s = (rest - 1.0) / (rest + 1.0);
        let logarithm = s * (s * s).polynomial(&ARTANH);
        whole.times_plus(LN_2_HIGH, whole.times_plus(LN_2_LOW, logarithm))
    }

    /// Natural logarithm of this over some unit, that of a number near it being known.
    #[inline(always)]
    pub fn ln_near(self, near: Self, log: Self, unit: f64) -> Self {
        /// Up to here the next term of the series, `2 s^7/7`, is below 1e-21.
        const BESIDE: f64 = 1e-3;
        let s = (self - near) / (self + near);
        let square = s * s;
        let series = square.times_plus(2.0 / 5.0, 2.0 / 3.0).times_plus(square, 2.0);
        let short = s.times_plus(series, log);
        let far = self.constant(BESIDE).at_most(s.abs());
        if far.nowhere() {
            return short;
        }
        far.select((self / unit).ln(), short)
    }

    /// Hyperbolic tangent of numbers, to 1e-14 absolutely; what is not a number counts as positive.
    #[inline(always)]
    pub fn tanh(self) -> Self {
        // (1 - E)/(1 + E) with E = exp(-2 |x|), the 32nd power of exp(-|x|/16); 1 from 20 on.
        let flat = self.constant(20.0);
        let negative = self.less(self.constant(0.0));
        if self.abs().less(flat).nowhere() {
            return negative.select(self.constant(-1.0), self.constant(1.0));
        }
        let size = self.abs().or_below(flat);
        let mut power = (size * (-1.0 / 16.0)).polynomial(&EXPONENTIAL);
        for _ in 0..5 {
            power = power * power;
        }
        let share = (-power + 1.0) / (power + 1.0);
        negative.select(-share, share)
    }
}

/// Adding it leaves no place for a fraction.
pub(crate) const WHOLE: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52

/// As far as the sine's polynomial reaches [rad].
pub(crate) const NEAR: f64 = 2.75;

/// `(sin x - x)/x^3` in powers of `x^2`, through Chebyshev's points up to [`NEAR`]: the rest is
/// below 1e-16.
const SINE: [f64; 9] = [
    -0.166_666_666_666_666_66,
    0.008_333_333_333_333_092,
    -0.000_198_412_698_411_844_7,
    2.755_731_921_238_567_5e-06,
    -2.505_210_759_541_541_7e-08,
    1.605_901_358_843_968_2e-10,
    -7.646_482_482_856_561e-13,
    2.802_491_066_280_274e-15,
    -7.580_026_535_339_908e-18,
];

/// `2 artanh(s)/s` in powers of `s^2`: below `s^2` = 0.03 the rest is below 1e-17.
const ARTANH: [f64; 11] = {
    let mut terms = [2.0; 11];
    let mut k = 1;
    while k < 11 {
        terms[k] = 2.0 / (2 * k + 1) as f64;
        k += 1;
    }
    terms
};

/// Taylor's series of the exponential: from -20/16 to 0 its 32nd power is right to 1e-15.
const EXPONENTIAL: [f64; 11] = {
    let mut terms = [1.0; 11];
    let mut k = 1;
    while k < 11 {
        terms[k] = terms[k - 1] / k as f64;
        k += 1;
    }
    terms
};

impl<S: Simd, R: Registers> Mask<S, R> {
    /// Whether it holds in no lane.
    #[inline(always)]
    pub fn nowhere(self) -> bool {
        self.lanes.as_ref().iter().all(|lanes| self.simd.first_true_m64s(*lanes) == S::F64_LANES)
    }

    /// One number where it holds, another where it does not.
    #[inline(always)]
    pub fn select(self, yes: Num<S, R>, no: Num<S, R>) -> Num<S, R> {
        let mut chosen = no;
        let (holds, yes) = (self.lanes.as_ref(), yes.lanes.as_ref());
        for (k, own) in chosen.lanes.as_mut().iter_mut().enumerate() {
            *own = self.simd.select_f64s(holds[k], yes[k], *own);
        }
        chosen
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $lanes:ident) => {
        impl<S: Simd, R: Registers> $trait for Num<S, R> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                self.with(other, |simd, a, b| simd.$lanes(a, b))
            }
        }

        impl<S: Simd, R: Registers> $trait<f64> for Num<S, R> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                self.map(|simd, a| simd.$lanes(a, simd.splat_f64s(other)))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd, R: Registers> Neg for Num<S, R> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|simd, a| simd.neg_f64s(a))
    }
}

impl<S: Simd, R: Registers> AddAssign for Num<S, R> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::Arch;

    /// Largest distance of sine, tangent and logarithm from those of the standard library.
    struct Furthest;

    impl WithSimd for Furthest {
        type Output = [f64; 4];

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> [f64; 4] {
            let [mut sine, mut tangent, mut logarithm, mut near] = [0.0_f64; 4];
            for k in -4000..=4000 {
                let x = f64::from(k) * 0.0025 + 1e-5;
                let number = Num::<S, Pair>::splat(simd, x);
                sine = sine.max((number.sin().numbers()[0] - x.sin()).abs());
                let steep = Num::<S, Pair>::splat(simd, 3.0 * x);
                tangent = tangent.max((steep.tanh().numbers()[0] - (3.0 * x).tanh()).abs());
                // From 5e-5 to 2e4, as a pressure over that of the room.
                let ratio = x.exp();
                let error = Num::<S, Pair>::splat(simd, ratio).ln().numbers()[0] - ratio.ln();
                logarithm = logarithm.max(error.abs() / ratio.ln().abs().max(1.0));
                // Of a number far from another one, and of one beside it.
                for other in [2.5 * ratio, ratio * (1.0 + 1e-4 * x)] {
                    let [here, log] = [ratio, ratio.ln()].map(|n| Num::<S, Pair>::splat(simd, n));
                    let found = Num::<S, Pair>::splat(simd, other).ln_near(here, log, 1.0);
                    let error = found.numbers()[0] - other.ln();
                    near = near.max(error.abs() / other.ln().abs().max(1.0));
                }
            }
            [sine, tangent, logarithm, near]
        }
    }

    #[test]
    fn functions_are_those_of_the_standard_library() {
        let [sine, tangent, logarithm, near] = Arch::new().dispatch(Furthest);
        assert!(sine < 4e-16, "{sine:e}");
        assert!(tangent < 1e-14, "{tangent:e}");
        assert!(logarithm < 4e-16, "{logarithm:e}");
        assert!(near < 5e-16, "{near:e}");
    }

    #[test]
    fn registers_of_any_width_give_the_same_bits() {
        let one = Furthest.with_simd(pulp::Scalar);
        assert_eq!(one, Arch::new().dispatch(Furthest));
    }
}
