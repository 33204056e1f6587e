use super::*;
use crate::scalar::Scalar;
use num_dual::{DualNum, DualSVec64};
use proptest::prelude::*;

type Ours = Dual<2>;
type Theirs = DualSVec64<2>;

/// The same two variables in both.
fn variables(x: f64, y: f64) -> ([Ours; 2], [Theirs; 2]) {
    let theirs = [x, y].map(Theirs::from_re);
    (
        [Ours::from(x).along(0), Ours::from(y).along(1)],
        [theirs[0].derivative(0), theirs[1].derivative(1)],
    )
}

fn agree(name: &str, ours: Ours, theirs: Theirs) {
    let slopes = theirs.eps.unwrap_generic(nalgebra::Const::<2>, nalgebra::Const::<1>);
    let expected = [theirs.re, slopes[0], slopes[1]];
    for (a, b) in [ours.re, ours.eps[0], ours.eps[1]].into_iter().zip(expected) {
        assert!((a - b).abs() <= 1e-12 * (1.0 + b.abs()), "{name}: {ours:?} {theirs:?}");
    }
}

proptest! {
    /// Every operation and function against another library.
    #[test]
    fn derivatives_are_those_of_another_library(x in 0.05..3.0f64, y in -3.0..3.0f64, n in -3..5i32) {
        prop_assume!(y.abs() > 0.05);
        let ([x, y], [u, v]) = variables(x, y);
        agree("add", x + y, u + v);
        agree("sub", x - y, u - v);
        agree("mul", x * y, u * v);
        agree("div", y / x, v / u);
        agree("neg", -(x * y), -(u * v));
        agree("by a number", (x * y + 2.0) * 3.0 / 7.0 - 1.0, (u * v + 2.0) * 3.0 / 7.0 - 1.0);
        agree("abs", Scalar::abs(y * x), num_traits::Signed::abs(&(v * u)));
        agree("recip", Scalar::recip(y), DualNum::recip(&v));
        agree("powi", Scalar::powi(y, n), DualNum::powi(&v, n));
        agree("powf", Scalar::powf(x, 1.7), DualNum::powf(&u, 1.7));
        agree("sqrt", Scalar::sqrt(x), DualNum::sqrt(&u));
        agree("exp", Scalar::exp(x * y), DualNum::exp(&(u * v)));
        agree("exp_m1", Scalar::exp_m1(x * y), DualNum::exp_m1(&(u * v)));
        agree("ln", Scalar::ln(x), DualNum::ln(&u));
        agree("ln_1p", Scalar::ln_1p(x), DualNum::ln_1p(&u));
        agree("sin", Scalar::sin(x * y), DualNum::sin(&(u * v)));
        agree("cos", Scalar::cos(x * y), DualNum::cos(&(u * v)));
        agree("tan", Scalar::tan(x * 0.4), DualNum::tan(&(u * 0.4)));
        agree("atan", Scalar::atan(x * y), DualNum::atan(&(u * v)));
        agree("tanh", Scalar::tanh(x * y), DualNum::tanh(&(u * v)));
        let mut ours = x;
        ours += y;
        ours *= x;
        ours -= 2.0;
        ours /= y;
        agree("assigned", ours, ((u + v) * u - 2.0) / v);
    }
}

#[test]
fn a_flat_tangent_has_no_slope() {
    for x in [-2e3, -25.0, -1.0, 0.0, 0.3, 19.9, 25.0, 2e3] {
        let found = Slope::new(x, 1.0).tanh();
        assert!((found.re - x.tanh()).abs() < 1e-15 && Scalar::tanh(x) == x.tanh());
        assert!((found.slope() - 1.0 / x.cosh().powi(2)).abs() < 1e-15, "{x}");
    }
}

/// A root of zero is steep without end, but not for what does not vary.
#[test]
fn what_does_not_vary_stays_so() {
    let [mut one, two] = [Ours::from(0.0); 2];
    one.eps[1] = 1.0;
    assert_eq!(two.sqrt().eps, [0.0; 2]);
    assert_eq!((one.sqrt().eps[0], one.sqrt().eps[1]), (0.0, f64::INFINITY));
    assert_eq!((one.powi(0).eps, one.powf(0.0).eps), ([0.0; 2], [0.0; 2]));
    assert!(!one.same(&two) && one == two && two.same(&two));
    assert_eq!(one.along(5).eps, [0.0; 2]);
}

/// Values do not know whether derivatives come along.
#[test]
fn values_are_those_of_plain_numbers() {
    fn f<S: Scalar>(x: S, y: S) -> S {
        (x / y + y.sin() * x.exp()).sqrt() / (x * 0.3).tanh() - (y.powf(0.7) / 3.0).ln()
    }
    for k in 1..50 {
        let (x, y) = (0.1 * f64::from(k), 0.03 * f64::from(k));
        assert_eq!(f(Ours::from(x).along(0), Ours::from(y).along(1)).re, f(x, y));
    }
}
