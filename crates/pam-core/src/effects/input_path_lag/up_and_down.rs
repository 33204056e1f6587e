//! `up_and_down`: `T y' = x - y` while the position rises, `T_d y' = x - y` while it falls.
//!
//! The spool of a solenoid against a spring, which pushes with another force than it lets go. The
//! command is held, so that a position goes one way towards it, in closed form. The form is as
//! commonly used, for valves whose data sheet has one time to open and another to close.

use super::{lagging, opens, LAG_AND_DELAY, SHORTEST, TIME_CONSTANT};
use crate::blocks::gas::Gas;
use crate::effects::{begun, Effect, EffectParameter, Form, BEGINNING, BEGUN};
use crate::made_by;
use crate::scalar::{constant, Scalar};

pub(super) const FORM: Form = Form {
    name: "up_and_down",
    parameters: &[TIME_CONSTANT, EffectParameter { name: "time_constant_down", ..TIME_CONSTANT }],
    states: &[BEGINNING, opens("position")],
    make: made_by!(make),
    ..LAG_AND_DELAY
};

/// A spool with a time for each way; its states say that it has begun, and where it is.
#[derive(Debug, Clone, Copy)]
struct UpAndDown<S> {
    up: S,
    down: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(UpAndDown { up: values[0], down: values[1] })
}

impl<S: Scalar> UpAndDown<S> {
    fn time_constant(&self, from: S, input: S) -> S {
        if input.re() >= from.re() {
            self.up
        } else {
            self.down
        }
    }
}

impl<S: Scalar> Effect<S> for UpAndDown<S> {
    fn position(&self, own: &[S], input: S, age: f64) -> S {
        if begun(own) {
            lagging(own[1], input, self.time_constant(own[1], input), age)
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
        let time_constant = self.time_constant(own[1], input);
        if time_constant.re() > SHORTEST {
            out[1] = (input - own[1]) / time_constant;
        }
    }

    fn fastest(&self) -> f64 {
        let rate = |time: f64| if time > SHORTEST { 1.0 / time } else { 0.0 };
        rate(self.up.re()).max(rate(self.down.re()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_way_has_its_time() {
        let effect = UpAndDown { up: 0.01, down: 0.03 };
        let left = |input: f64, time: f64| effect.position(&[BEGUN, 0.2], input, time) - input;
        assert!((left(0.7, 0.01) + 0.5 * (-1.0_f64).exp()).abs() < 1e-12);
        assert!((left(-0.3, 0.03) - 0.5 * (-1.0_f64).exp()).abs() < 1e-12);
        assert_eq!(UpAndDown { up: 0.0, down: 0.0 }.position(&[BEGUN, 0.2], 0.5, 1e-3), 0.5);
    }
}
