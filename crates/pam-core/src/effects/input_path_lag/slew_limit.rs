//! `slew_limit`: `y' = (x - y)/T`, never faster than `1/T_s`.
//!
//! The spool of a valve whose solenoid gives no more: a large step of the command takes a time in
//! proportion to its size, the rest of the way is a lag. The command is held, so that the way is a
//! straight line and then an exponential, in closed form. The form is as commonly used, in models
//! of servo valves and their actuators.

use super::{lagging, opens, LAG_AND_DELAY, SHORTEST, TIME_CONSTANT};
use crate::blocks::gas::Gas;
use crate::effects::{begun, Effect, EffectParameter, Form, BEGINNING, BEGUN};
use crate::made_by;
use crate::scalar::{constant, Scalar};

pub(super) const FORM: Form = Form {
    name: "slew_limit",
    parameters: &[
        TIME_CONSTANT,
        EffectParameter::new("stroke_time", "s", 0.0, 100.0, 0.01).starts(&[0.01, 0.05]).off(0.0),
    ],
    states: &[BEGINNING, opens("position")],
    make: made_by!(make),
    ..LAG_AND_DELAY
};

/// Position a time [s] later, the input held.
fn moved<S: Scalar>(from: S, input: S, time_constant: S, stroke_time: S, time: f64) -> S {
    if stroke_time.re() <= SHORTEST {
        return lagging(from, input, time_constant, time);
    }
    // without a lag the end of the way is a very short one
    let short = time_constant.re() <= SHORTEST;
    let lag = if short { constant(2.0 * SHORTEST) } else { time_constant };
    let edge = lag / stroke_time;
    let way = input - from;
    if way.re().abs() <= edge.re() {
        return lagging(from, input, lag, time);
    }
    let sign = way.re().signum();
    let straight = (way * sign - edge) * stroke_time;
    if time <= straight.re() {
        return from + constant::<S>(sign * time) / stroke_time;
    }
    input - edge * sign * ((straight - time) / lag).exp()
}

/// A spool that moves no faster than it can; its states say that it has begun, and where it is.
#[derive(Debug, Clone, Copy)]
struct Slew<S> {
    time_constant: S,
    stroke_time: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Slew { time_constant: values[0], stroke_time: values[1] })
}

impl<S: Scalar> Effect<S> for Slew<S> {
    fn position(&self, own: &[S], input: S, age: f64) -> S {
        if begun(own) {
            moved(own[1], input, self.time_constant, self.stroke_time, age)
        } else {
            input
        }
    }

    fn follow(&self, own: &mut [S], input: S, step: f64) -> S {
        let position = self.position(own, input, step);
        own.copy_from_slice(&[constant(BEGUN), position]);
        position
    }

    fn linear_rates(&self, own: &[S], input: S, out: &mut [S]) {
        let lag = self.time_constant.re();
        if lag > SHORTEST {
            out[1] = (input - own[1]) / self.time_constant;
        } else if self.stroke_time.re() > SHORTEST {
            out[1] = (input - own[1]) / (2.0 * SHORTEST);
        }
    }

    fn fastest(&self) -> f64 {
        let rate = |time: f64| if time > SHORTEST { 1.0 / time } else { 0.0 };
        rate(self.time_constant.re()).max(rate(self.stroke_time.re()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_step_takes_a_time_in_proportion_and_a_small_one_is_a_lag() {
        let at = |step: f64, time: f64| -> f64 { moved(0.0, step, 0.01, 0.05, time) };
        assert!((at(0.8, 0.02) - 0.4).abs() < 1e-15);
        // 30 ms to the edge of 0.2, and a lag behind it
        assert!((at(0.8, 0.04) - (0.8 - 0.2 * (-1.0_f64).exp())).abs() < 1e-12);
        assert!((at(-0.8, 0.04) + at(0.8, 0.04)).abs() < 1e-15);
        assert!((at(0.1, 0.01) - 0.1 * (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
        let twice = moved(at(0.8, 0.017), 0.8, 0.01, 0.05, 0.023);
        assert!((twice - at(0.8, 0.04)).abs() < 1e-12);
        assert_eq!(moved(0.3, 0.8, 0.0, 0.0, 1e-3), 0.8);
        assert!((moved(0.0, 0.8, 0.0, 0.05, 0.02) - 0.4_f64).abs() < 1e-12);
        assert!((moved(0.0, 0.8, 0.0, 0.05, 0.05) - 0.8_f64).abs() < 1e-12);
    }
}
