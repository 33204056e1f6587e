//! `pressure_lag`: the recorded pressure lags behind the true one, by the transducer, its snubber
//! or its line.
//!
//! `T y' = p - y`. Over a step the true pressure is taken as straight, which has a closed form: no
//! lag is too short for a step. Where the recorded pressure drives a block, the true one is
//! `y + T y'`. At `T = 0` both are the same. E. O. Doebelin, *Measurement Systems*, ch. 6.

use super::{AtRest, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "pressure_lag",
    block: "sensors",
    at: "chamber",
    at_rest: &[AtRest::OutBelow("time_constant", SHORTEST)],
    acts_in: &["chamber", "flow", "arm", "pull"],
    source: "Doebelin, Measurement Systems, ch. 6",
    forms: &[Form {
        name: "first_order",
        parameters: &[EffectParameter::new("time_constant", "s", 0.0, 2.0, 0.005)
            .starts(&[0.003, 0.02])
            .usually(1e-4, 0.3)
            .off(0.0)],
        states: &[EffectState { name: "", role: Role::Moves }],
        integrates: false,
        ports: &[Port::Reading],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// A lag that no sample shows [s].
pub const SHORTEST: f64 = 2e-5;

/// Reading after a step [s] in which what is read went from one value to another.
#[inline]
pub fn read<S: Scalar>(reading: S, from: S, to: S, time_constant: S, step: f64) -> S {
    let behind = time_constant * (to - from) / step;
    let steps = if time_constant.re() > 0.0 { step / time_constant.re() } else { f64::INFINITY };
    // Further back than the number's last digit reaches.
    let left =
        if steps < 700.0 { (-constant::<S>(step) / time_constant).exp() } else { constant(0.0) };
    to - behind + (reading - from + behind) * left
}

/// Lag of a sensor of a gas, of its pressure or its temperature; its state is the reading.
#[derive(Debug, Clone, Copy)]
struct Lag<S> {
    time_constant: S,
}

/// The lag of a time constant [s].
pub fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Lag { time_constant: values[0] })
}

impl<S: Scalar> Effect<S> for Lag<S> {
    fn read(&self, reading: S, from: S, to: S, step: f64) -> S {
        read(reading, from, to, self.time_constant, step)
    }

    fn linear_rates(&self, own: &[S], input: S, rates: &mut [S]) {
        rates[0] = (input - own[0]) / self.time_constant;
    }

    fn lag(&self) -> S {
        self.time_constant
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_decays_and_a_ramp_is_followed_at_a_distance() {
        let mut y = 0.0;
        for _ in 0..50 {
            y = read(y, 1.0, 1.0, 0.01, 1e-3);
        }
        assert!((1.0 - y - (-5.0_f64).exp()).abs() < 1e-12);
        let mut y = 0.0;
        for k in 0..500 {
            let p = f64::from(k) * 1e-3;
            y = read(y, p, p + 1e-3, 0.01, 1e-3);
        }
        assert!((y - (0.5 - 0.01_f64)).abs() < 1e-12);
        assert_eq!(read(7.0, 1.0, 3.0, 0.0, 1e-3), 3.0);
    }

    #[test]
    fn the_closed_form_begins_with_the_rate() {
        let (sensor, mut rate) = (Lag { time_constant: 0.02_f64 }, [0.0]);
        sensor.linear_rates(&[1e5], 1.4e5, &mut rate);
        assert_eq!(rate, [2e6]);
        let step = 1e-8;
        let moved = sensor.read(1e5, 1.4e5, 1.4e5, step) - 1e5;
        assert!((moved / step / rate[0] - 1.0).abs() < 1e-6);
    }
}
