//! `payload_change`: the payload becomes another one during a recording.
//!
//! `m_p -> m_p + dm` from a time on, taken up over [`super::RISE`]: mass, inertia and weight
//! together. Of a linear load it is the hanging mass. What is taken up moves with the link already,
//! so that no impulse is exchanged. Time counts from the start of the recording. This is the form
//! `step`.
//!
//! `ramp`: `dm` comes evenly over a duration, as what is poured. Both forms are as commonly used:
//! M. W. Spong, S. Hutchinson & M. Vidyasagar, *Robot Modeling and Control* (2006), ch. 7, with a
//! mass that is a function of time.

use super::{risen, Effect, EffectInfo, EffectParameter, Form, Port, Use, RISE};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const MASS: EffectParameter = EffectParameter::new("mass_change", "kg", -1e6, 1e6, 1.0)
    .starts(&[-2.0, 2.0])
    .off(0.0)
    .tried(0.3)
    .same_everywhere();
const TIME: EffectParameter =
    EffectParameter::new("time", "s", -1e9, 1e9, 5.0).starts(&[5.0, 15.0]).role(Use::Time);

const STEP: Form = Form {
    name: "step",
    parameters: &[MASS, TIME],
    states: &[],
    integrates: false,
    ports: &[Port::Payload],
    make: made_by!(step),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "payload_change",
    block: "arm",
    at: "joint",
    last_only: true,
    on_loads: true,
    source: "Spong, Hutchinson & Vidyasagar, Robot Modeling and Control (2006), ch. 7",
    forms: &[
        STEP,
        Form {
            name: "ramp",
            parameters: &[
                MASS,
                TIME,
                EffectParameter::new("duration", "s", RISE, 1e9, 3.0)
                    .starts(&[1.0, 5.0])
                    .role(Use::Duration)
                    .tried(1.0),
            ],
            make: made_by!(ramp),
            ..STEP
        },
    ],
    ..EffectInfo::USUAL
};

/// Change of the mass [kg] at a time [s].
#[inline]
pub fn change<S: Scalar>(mass: S, time: S, now: f64) -> S {
    mass * risen(now, time)
}

/// From 0 before a time to 1 a duration after it [s], evenly.
#[inline]
fn poured<S: Scalar>(now: f64, time: S, duration: S) -> S {
    let share = (-time + now) / duration;
    if share.re() <= 0.0 {
        constant(0.0)
    } else if share.re() >= 1.0 {
        constant(1.0)
    } else {
        share
    }
}

/// A payload that becomes another one, at once or over a duration.
#[derive(Debug, Clone, Copy)]
struct Change<S> {
    mass: S,
    moment: S,
    duration: Option<S>,
}

fn step<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Change { mass: values[0], moment: values[1], duration: None })
}

fn ramp<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Change { mass: values[0], moment: values[1], duration: Some(values[2]) })
}

impl<S: Scalar> Effect<S> for Change<S> {
    fn payload(&self, time: f64) -> S {
        match self.duration {
            None => change(self.mass, self.moment, time),
            Some(duration) => self.mass * poured(time, self.moment, duration),
        }
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

    #[test]
    fn a_ramp_comes_evenly() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let ramp = (INFO.form("ramp").unwrap().make.plain)(&[2.0, 3.0, 4.0], &gas);
        let at = [2.9, 3.0, 4.0, 5.0, 7.0, 9.0, f64::INFINITY, f64::NEG_INFINITY];
        assert_eq!(at.map(|now| ramp.payload(now)), [0.0, 0.0, 0.5, 1.0, 2.0, 2.0, 2.0, 0.0]);
    }
}
