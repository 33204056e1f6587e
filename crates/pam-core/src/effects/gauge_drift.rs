//! `gauge_drift`: the zero of a pressure gauge that creeps while a recording lasts.
//!
//! What is recorded is `p + z(t)`, `t` the time since the recording began: `straight`, `z = D t/60
//! s`, for a drift that has no end in sight, `D` in a minute; `exponential`, `z = D (1 -
//! exp(-t/tau))`, an amplifier or a bridge that warms up after it was switched on. What is constant
//! is a zero of its own (`sensors.pressure_zero`). The size is another one in each recording: how
//! warm it was when a recording began, nobody wrote down. E. O. Doebelin, *Measurement Systems*, ch.
//! 3 (zero drift) and 6; ISA-37.1 (thermal zero shift).

use super::{Effect, EffectInfo, EffectParameter, Form, Kink, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const CHANGE: EffectParameter =
    EffectParameter::new("change", "Pa", -1e7, 1e7, 2e3).starts(&[2e3]).off(0.0).own();

const STRAIGHT: Form = Form {
    name: "straight",
    parameters: &[CHANGE],
    states: &[],
    integrates: false,
    ports: &[Port::Zero],
    make: made_by!(straight),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "gauge_drift",
    block: "sensors",
    at: "chamber",
    acts_in: &["arm", "pull"],
    kink: Some(DRIFTS),
    source: "Doebelin, Measurement Systems, ch. 3 and 6; ISA-37.1",
    forms: &[
        STRAIGHT,
        Form {
            name: "exponential",
            parameters: &[CHANGE, TIME_CONSTANT],
            make: made_by!(exponential),
            ..STRAIGHT
        },
    ],
    ..EffectInfo::USUAL
};

/// Why what drifts has no linear model.
pub const DRIFTS: Kink = Kink {
    where_not_zero: &["change"],
    why: "it goes on with time, and has no state of rest",
    of_supplies: false,
};

/// How long a zero takes to settle: another one in each recording would be a value that a drift
/// need not have.
pub const TIME_CONSTANT: EffectParameter =
    EffectParameter::new("time_constant", "s", 0.1, 1e5, 20.0)
        .starts(&[5.0, 30.0])
        .time_constant()
        .same_everywhere();

/// A minute [s].
const MINUTE: f64 = 60.0;

/// A zero that goes on and on, a change in a minute.
#[derive(Debug, Clone, Copy)]
struct Straight<S>(S);

/// A zero that settles.
#[derive(Debug, Clone, Copy)]
struct Exponential<S> {
    change: S,
    time_constant: S,
}

/// The drift of a change in a minute.
pub fn straight<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Straight(values[0]))
}

/// The drift of a change in the end and its time constant [s].
pub fn exponential<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Exponential { change: values[0], time_constant: values[1] })
}

impl<S: Scalar> Effect<S> for Straight<S> {
    fn drift(&self, time: f64) -> S {
        self.0 * (time / MINUTE)
    }
}

impl<S: Scalar> Effect<S> for Exponential<S> {
    fn drift(&self, time: f64) -> S {
        self.change * (-(-constant::<S>(time) / self.time_constant).exp() + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_begins_at_the_zero_and_goes_on_or_settles() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let made = |form: &str, values: &[f64]| {
            let made = (INFO.form(form).unwrap().make.plain)(values, &gas);
            [0.0, 30.0, 1e4].map(|time| made.drift(time))
        };
        assert_eq!(made("straight", &[600.0])[..2], [0.0, 300.0]);
        let settled = made("exponential", &[600.0, 30.0]);
        assert!((settled[1] - 600.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9);
        assert_eq!((settled[0], settled[2]), (0.0, 600.0));
    }
}
