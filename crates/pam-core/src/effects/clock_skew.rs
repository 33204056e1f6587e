//! `clock_skew`: pressures, and angles too or not, are recorded by another clock than the commands.
//!
//! A pressure that is recorded at `t` was there at `t - d(t)` of the commands' clock,
//! `d = d_0 + r t`, an angle at `t - a d(t)`: the share `a` is 1 where one logger records both and
//! 0 where the angle is on the commands' clock. Commands act on the recording later by `d`. Within
//! a step the flows under the held commands are averaged over the shifted time, so that an edge moves
//! through it continuously and the shift can be differentiated. The rate of some 1e-4 changes no
//! other time. A clock that is ahead (`d < 0`) is known to a prediction from recordings; a
//! simulation, which cannot answer a command that is still to come, takes it as no shift. D. L.
//! Mills, "Internet time synchronization: the network time protocol", IEEE Trans. Communications 39,
//! 1991 (offset and skew).

use super::{Effect, EffectInfo, EffectParameter, Form, Kink, Port, SameData, Use};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "clock_skew",
    block: "sensors",
    at: "",
    kink: Some(Kink {
        where_not_zero: &["offset", "rate"],
        why: "its delay is no state of the rig; take it out, and give it as the delay of the loop",
        of_supplies: false,
    }),
    // commands go to valves, and where a rig has none to its regulator
    same_data: &[late("input_path_lag"), late("supply_regulator_delay")],
    acts_in: &["supply", "chamber", "flow", "arm", "pull"],
    source: "Mills (1991), offset and skew of clocks",
    forms: &[Form {
        name: "offset_and_drift",
        parameters: &[
            EffectParameter::new("offset", "s", -10.0, 10.0, 0.01).starts(&[0.005, 0.03]).off(0.0),
            EffectParameter::new("rate", "1", -0.1, 0.1, 0.0001).starts(&[0.0, 0.0003]).off(0.0),
            EffectParameter::new("angle_share", "1", 0.0, 1.0, 1.0)
                .starts(&[0.0, 1.0])
                .role(Use::Choice),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Clock],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// A dead time in front of what the commands go to.
const fn late(effect: &'static str) -> SameData {
    SameData {
        effect,
        form: "dead_time",
        parameter: "delay",
        size: "offset",
        without: "rate",
        held: &[("angle_share", 1.0)],
        held_at: "joint",
    }
}

/// How late a pressure is recorded at a time [s].
#[inline]
pub fn shift<S: Scalar>(offset: S, rate: S, time: f64) -> S {
    offset + rate * time
}

/// Another clock of what is recorded.
#[derive(Debug, Clone, Copy)]
struct ClockSkew<S> {
    offset: S,
    rate: S,
    angle_share: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(ClockSkew { offset: values[0], rate: values[1], angle_share: values[2] })
}

impl<S: Scalar> Effect<S> for ClockSkew<S> {
    fn clock(&self, time: f64) -> (S, S) {
        let shift = shift(self.offset, self.rate, time);
        (shift, shift * self.angle_share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_grows() {
        assert!((shift(1e-2, 1e-4, 100.0) - 2e-2_f64).abs() < 1e-15);
        assert_eq!((shift(0.0, 0.0, 50.0), shift(0.0, -1e-3, 50.0)), (0.0, -0.05));
    }
}
