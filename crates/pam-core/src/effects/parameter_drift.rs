//! `parameter_drift`: moduli that change while a recording lasts, whatever moves.
//!
//! `F_b -> F_b (1 + D (1 - exp(-t/tau)))` of the bladder's part of the force, `t` the time since
//! the recording began: rubber that warms up while it works softens towards another value. This is
//! the form `exponential`. `straight`: `F_b -> F_b (1 + D t/60 s)`, while that is above zero, for a
//! change that has no end in sight, `D` in a minute. Mullins' softening goes with the largest stretch
//! and creep with what was done before, this one with time alone. L. R. G. Treloar, *The Physics of
//! Rubber Elasticity* (1975), ch. 2 and 13 (moduli and temperature); B. Tondu & P. Lopez, IEEE
//! Control Systems 20, 2000 (muscles that warm up).

use super::{At, Effect, EffectInfo, EffectParameter, EffectState, Form, Kink, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const CHANGE: EffectParameter =
    EffectParameter::new("change", "1", -0.9, 10.0, 0.2).starts(&[-0.1, 0.1]).off(0.0);

const EXPONENTIAL: Form = Form {
    name: "exponential",
    parameters: &[
        CHANGE,
        EffectParameter::new("time_constant", "s", 0.1, 1e5, 20.0)
            .starts(&[10.0, 60.0])
            .time_constant(),
    ],
    states: &[EffectState { name: "share", role: Role::Keeps }],
    integrates: true,
    ports: &[Port::Bladder],
    make: made_by!(exponential),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "parameter_drift",
    block: "muscle",
    at: "muscle",
    order: 1,
    kink: Some(Kink {
        where_not_zero: &["change"],
        why: "it goes on with time, and has no state of rest",
        of_supplies: false,
    }),
    source: "Treloar (1975), ch. 2 and 13; Tondu & Lopez (2000)",
    forms: &[
        EXPONENTIAL,
        Form {
            name: "straight",
            parameters: &[CHANGE],
            states: &[EffectState { name: "time", role: Role::Keeps }],
            make: made_by!(straight),
            ..EXPONENTIAL
        },
    ],
    ..EffectInfo::USUAL
};

/// A minute [s].
const MINUTE: f64 = 60.0;

/// Towards another value; its state is the share of the way [1].
#[derive(Debug, Clone, Copy)]
struct Exponential<S> {
    change: S,
    time_constant: S,
}

/// With a constant rate, a change in a minute; its state is the time since the recording began
/// [min].
#[derive(Debug, Clone, Copy)]
struct Straight<S>(S);

fn exponential<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Exponential { change: values[0], time_constant: values[1] })
}

fn straight<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Straight(values[0]))
}

impl<S: Scalar> Effect<S> for Exponential<S> {
    fn rates(&self, _at: &At<S>, own: &[S], rates: &mut [S]) {
        rates[0] = (-own[0] + 1.0) / self.time_constant;
    }

    fn bladder(&self, own: &[S], bladder: S, _contraction: S) -> S {
        self.change * own[0] * bladder
    }

    fn fastest(&self) -> f64 {
        1.0 / self.time_constant.re()
    }
}

impl<S: Scalar> Effect<S> for Straight<S> {
    fn rates(&self, _at: &At<S>, _own: &[S], rates: &mut [S]) {
        rates[0] = constant(1.0 / MINUTE);
    }

    fn bladder(&self, own: &[S], bladder: S, _contraction: S) -> S {
        let change = self.0 * own[0];
        // no modulus is below none
        if change.re() > -1.0 {
            change * bladder
        } else {
            -bladder
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(form: &str, values: &[f64]) -> Box<dyn Effect<f64>> {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        (INFO.form(form).unwrap().make.plain)(values, &gas)
    }

    #[test]
    fn it_goes_with_time_alone() {
        let (warm, on) = (made("exponential", &[-0.2, 30.0]), made("straight", &[-0.2]));
        assert_eq!(warm.bladder(&[0.0], -80.0, 0.1), 0.0);
        assert_eq!(warm.bladder(&[1.0], -80.0, 0.1), 16.0);
        assert_eq!(on.bladder(&[0.5], -80.0, 0.3), 8.0);
        assert_eq!(on.bladder(&[9.0], -80.0, 0.3), 80.0);
    }

    #[test]
    fn its_state_is_the_share_of_the_way_or_the_time() {
        let mut rate = [0.0];
        let at = At::Valve { fed: 1e5 };
        made("exponential", &[-0.2, 30.0]).rates(&at, &[0.25], &mut rate);
        assert_eq!(rate, [0.025]);
        made("straight", &[-0.2]).rates(&at, &[7.0], &mut rate);
        assert_eq!(rate, [1.0 / 60.0]);
    }
}
