//! `activation_pressure`: pressure that a muscle needs before its bladder presses on the braid.
//!
//! `threshold`: the force is that of the gauge pressure less `p_th`, and that of none below it:
//! `p_e = p - min(p, p_th)` for `p > 0`, the corner at `p_th` rounded over a tenth of it on either
//! side. N. G. Tsagarakis & D. G. Caldwell, "Improved modelling and assessment of pneumatic muscle
//! actuators", ICRA 2000; E. G. Hocking & N. M. Wereley, "Analysis of nonlinear elastic behavior in
//! miniature pneumatic artificial muscles", Smart Materials and Structures 22, 014016, 2013.
//!
//! `saturating`: `p_e = p - p p_th/(p + p_th) = p^2/(p + p_th)` for `p > 0`: a bladder that meets
//! its braid little by little, what is lost growing to `p_th`. A smooth threshold of our own: no
//! published source is known to us.

use super::{Effect, EffectInfo, EffectParameter, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const THRESHOLD: Form = Form {
    name: "threshold",
    parameters: &[EffectParameter::new("threshold", "Pa", 0.0, 1e7, 20000.0)
        .starts(&[10000.0, 50000.0])
        .off(0.0)],
    states: &[],
    integrates: false,
    ports: &[Port::Gauge],
    make: made_by!(make),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "activation_pressure",
    block: "muscle",
    at: "muscle",
    source:
        "Tsagarakis & Caldwell (2000); Hocking & Wereley (2013); the form saturating is our own",
    forms: &[THRESHOLD, Form { name: "saturating", make: made_by!(saturating), ..THRESHOLD }],
    ..EffectInfo::USUAL
};

const CORNER: f64 = 0.1;

/// Gauge pressure that the force is that of [Pa].
#[inline]
pub fn effective<S: Scalar>(pressure: S, threshold: S) -> S {
    let width = threshold * CORNER;
    if pressure.re() <= 0.0 || pressure.re() >= threshold.re() + width.re() {
        let lost = if pressure.re() > 0.0 { threshold } else { constant(0.0) };
        pressure - lost
    } else if pressure.re() > threshold.re() - width.re() {
        let into = pressure - threshold + width;
        into * into / (width * 4.0)
    } else {
        constant(0.0)
    }
}

/// Pressure that a muscle needs before it pulls.
#[derive(Debug, Clone, Copy)]
struct Activation<S> {
    threshold: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Activation { threshold: values[0] })
}

impl<S: Scalar> Effect<S> for Activation<S> {
    fn gauge(&self, gauge: S) -> S {
        effective(gauge, self.threshold)
    }
}

/// Pressure of which more and more is lost, up to all that is needed.
#[derive(Debug, Clone, Copy)]
struct Saturating<S> {
    threshold: S,
}

fn saturating<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Saturating { threshold: values[0] })
}

impl<S: Scalar> Effect<S> for Saturating<S> {
    fn gauge(&self, gauge: S) -> S {
        if gauge.re() <= 0.0 {
            return gauge;
        }
        gauge - gauge * self.threshold / (gauge + self.threshold)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_takes_the_threshold_and_nothing_below_zero() {
        assert_eq!(
            (effective(1e5, 2e4), effective(1e4, 2e4), effective(-3e3, 2e4)),
            (8e4, 0.0, -3e3)
        );
        for p in [-1e4, 0.0, 1.0, 3e5] {
            assert_eq!(effective(p, 0.0), p);
        }
        for edge in [1.8e4, 2.2e4] {
            let jump: f64 = effective(edge + 1e-3, 2e4) - effective(edge - 1e-3, 2e4);
            assert!(jump.abs() < 3e-3);
        }
        assert!((effective(2e4, 2e4) - 500.0_f64).abs() < 1e-9);
    }

    #[test]
    fn what_is_lost_saturates() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let made =
            |threshold: f64| (INFO.form("saturating").unwrap().make.plain)(&[threshold], &gas);
        let lost = |p: f64| p - made(2e4).gauge(p);
        assert_eq!((lost(-3e3), lost(2e4)), (0.0, 1e4));
        assert!(lost(1e7) > 0.99 * 2e4 && lost(1e7) < 2e4);
        assert!((made(2e4).gauge(1e5) - 1e10 / 1.2e5).abs() < 1e-9);
        assert_eq!(made(0.0).gauge(1.234_567e5), 1.234_567e5);
    }
}
