//! `payload_change`: the payload becomes another one during a recording.
//!
//! `m_p -> m_p + dm` from a time on, taken up over [`super::RISE`]: mass, inertia and weight
//! together. Of a linear load it is the hanging mass. What is taken up moves with the link already,
//! so that no impulse is exchanged. Time counts from the start of the recording.

use super::{risen, Effect, EffectInfo, EffectParameter, Form, Port, Use};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "payload_change",
    block: "arm",
    at: "joint",
    last_only: true,
    on_loads: true,
    source: "Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, ch. 7",
    forms: &[Form {
        name: "step",
        parameters: &[
            EffectParameter::new("mass_change", "kg", -1e6, 1e6, 1.0)
                .starts(&[-2.0, 2.0])
                .off(0.0)
                .tried(0.3)
                .same_everywhere(),
            EffectParameter::new("time", "s", -1e9, 1e9, 5.0).starts(&[5.0, 15.0]).role(Use::Time),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Payload],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Change of the mass [kg] at a time [s].
#[inline]
pub fn change<S: Scalar>(mass: S, time: S, now: f64) -> S {
    mass * risen(now, time)
}

/// A payload that becomes another one.
#[derive(Debug, Clone, Copy)]
struct Change<S> {
    mass: S,
    moment: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Change { mass: values[0], moment: values[1] })
}

impl<S: Scalar> Effect<S> for Change<S> {
    fn payload(&self, time: f64) -> S {
        change(self.mass, self.moment, time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_there_after_its_time() {
        assert_eq!(
            (change(2.0, 3.0, 2.9), change(2.0, 3.0, 3.1), change(0.0, 3.0, 4.0)),
            (0.0, 2.0, 0.0)
        );
    }
}
