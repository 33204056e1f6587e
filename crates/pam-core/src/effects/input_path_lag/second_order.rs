//! `second_order`: `y'' = w^2 (x - y) - 2 zeta w y'`, the spool as a mass on a spring.
//!
//! `w = 2 zeta/T`, so that `T` is what a slow command comes late by, and a large `zeta` is a lag of
//! first order. The opening ends at -1 and 1. The command is held, so that the motion is that of a
//! free oscillator about it, in closed form ([`swung`]). E. Richer & Y. Hurmuzlu, "A high performance
//! pneumatic force actuator system: part I, nonlinear mathematical model", ASME J. Dyn. Syst. Meas.
//! Control 122, 2000 (spool, coil and springs). A model of servo valves that feed muscles: A.
//! Hildebrandt, O. Sawodny, R. Neumann & A. Hartmann, "Cascaded control concept of a robot with two
//! degrees of freedom driven by four artificial pneumatic muscle actuators", ACC 2005.

use super::{opens, LAG_AND_DELAY, SHORTEST, TIME_CONSTANT};
use crate::blocks::gas::Gas;
use crate::blocks::spool::swung;
use crate::effects::{begun, Effect, EffectParameter, Form, BEGINNING, BEGUN};
use crate::made_by;
use crate::scalar::{constant, Scalar};

pub(super) const FORM: Form = Form {
    name: "second_order",
    parameters: &[
        TIME_CONSTANT,
        EffectParameter::new("damping_ratio", "1", 0.1, 10.0, 0.7).starts(&[0.5, 1.0]),
    ],
    states: &[BEGINNING, opens("position"), opens("rate")],
    make: made_by!(make),
    ..LAG_AND_DELAY
};

/// Position and rate a time [s] later, the input held.
fn moved<S: Scalar>([from, rate]: [S; 2], input: S, t: S, damping: S, time: f64) -> [S; 2] {
    if t.re() <= SHORTEST {
        return [input, constant(0.0)];
    }
    swung([from, rate], input, damping * 2.0 / t, damping, constant(time))
}

/// A spool on a spring; its states say that it has begun, where it is, and how fast it moves.
#[derive(Debug, Clone, Copy)]
struct Spool<S> {
    time_constant: S,
    damping: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Spool { time_constant: values[0], damping: values[1] })
}

impl<S: Scalar> Spool<S> {
    fn moved(&self, own: &[S], input: S, age: f64) -> [S; 2] {
        if begun(own) {
            moved([own[1], own[2]], input, self.time_constant, self.damping, age)
        } else {
            [input, constant(0.0)]
        }
    }
}

/// A position between the stops.
fn stopped<S: Scalar>(position: S) -> S {
    if position.re().abs() > 1.0 {
        constant(position.re().signum())
    } else {
        position
    }
}

impl<S: Scalar> Effect<S> for Spool<S> {
    fn position(&self, own: &[S], input: S, age: f64) -> S {
        stopped(self.moved(own, input, age)[0])
    }

    fn follow(&self, own: &mut [S], input: S, step: f64) -> S {
        let [position, rate] = self.moved(own, input, step);
        own.copy_from_slice(&[constant(BEGUN), position, rate]);
        stopped(position)
    }

    fn linear_rates(&self, own: &[S], input: S, out: &mut [S]) {
        if self.time_constant.re() > SHORTEST {
            let natural = self.damping * 2.0 / self.time_constant;
            out[1] = own[2];
            out[2] = natural * natural * (input - own[1]) - self.damping * natural * own[2] * 2.0;
        }
    }

    fn fastest(&self) -> f64 {
        let (t, damping) = (self.time_constant.re(), self.damping.re());
        if t <= SHORTEST {
            return 0.0;
        }
        2.0 * damping / t * (damping + (damping * damping - 1.0).max(0.0).sqrt()).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::integrate::Rk4;

    #[test]
    fn closed_form_is_the_integral_of_the_oscillator() {
        for damping in [0.3, 0.9, 1.0, 1.001, 1.4, 4.0] {
            let (t, input, mut y) = (0.02, 0.4, [0.1, -3.0_f64]);
            let found = moved(y, input, t, damping, 0.03);
            let natural = 2.0 * damping / t;
            let mut method = Rk4::new(2);
            for _ in 0..3000 {
                method.step(&mut y, 1e-5, |_, y, out| {
                    out[0] = y[1];
                    out[1] = natural * natural * (input - y[0]) - 2.0 * damping * natural * y[1];
                });
            }
            assert!((found[0] - y[0]).abs() < 1e-9, "{damping}: {found:?} {y:?}");
            assert!((found[1] - y[1]).abs() < 1e-7, "{damping}: {found:?} {y:?}");
            let half = moved(moved([0.1, -3.0], input, t, damping, 0.01), input, t, damping, 0.02);
            assert!((found[0] - half[0]).abs() < 1e-11);
        }
        assert_eq!(moved([0.1, 0.0], 0.4, 0.0, 0.7, 1e-3), [0.4, 0.0]);
        assert_eq!(moved([0.1, 0.0], 0.4, 1e-3, 4.0, 1e9)[0], 0.4);
    }

    #[test]
    fn a_slow_command_comes_late_by_its_time() {
        for damping in [0.5, 1.0, 3.0] {
            let (t, slope, step) = (0.01, 2.0, 1e-4);
            let mut y = [0.0, 0.0];
            for k in 0..20_000 {
                y = moved(y, slope * step * (f64::from(k) + 0.5), t, damping, step);
            }
            assert!((slope * 2.0 - y[0] - slope * t).abs() < 1e-6, "{damping}: {}", y[0]);
        }
    }
}
