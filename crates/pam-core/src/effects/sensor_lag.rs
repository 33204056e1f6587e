//! `sensor_lag`: the angle is recorded late, the pressures are not.
//!
//! What is recorded at `t` is the angle, or the length, of `t - d`: another bus, a filter, a camera.
//! Motion answers late by `d`, and the volume of the muscles that the pressures feel is ahead of
//! what was recorded. A lag of first order that is short beside the motion is such a delay. Clocks
//! that are apart (`clock_skew`) move pressures as well; a lag of the pressures' own is
//! `pressure_lag`. E. O. Doebelin, *Measurement Systems*, ch. 3.

use super::{Effect, EffectInfo, EffectParameter, Form, Kink, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "sensor_lag",
    block: "sensors",
    at: "",
    kink: Some(Kink {
        where_not_zero: &["delay"],
        why: "its delay is no state of the rig; take it out, and give it as the delay of the loop",
        of_supplies: false,
    }),
    acts_in: &["chamber", "arm"],
    source: "Doebelin, Measurement Systems, ch. 3",
    forms: &[Form {
        name: "angle_delay",
        parameters: &[EffectParameter::new("delay", "s", 0.0, 1.0, 0.01)
            .starts(&[0.005, 0.03])
            .off(0.0)],
        states: &[],
        integrates: false,
        ports: &[Port::Clock],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// A delay of the angles [s].
#[derive(Debug, Clone, Copy)]
struct Delay<S>(S);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Delay(values[0]))
}

impl<S: Scalar> Effect<S> for Delay<S> {
    fn clock(&self, _time: f64) -> (S, S) {
        (constant(0.0), self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_late_and_pressures_are_not() {
        let effect = Delay(0.02);
        assert_eq!([0.0, 99.0].map(|time| effect.clock(time)), [(0.0, 0.02); 2]);
    }
}
