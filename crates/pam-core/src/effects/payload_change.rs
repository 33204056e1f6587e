//! `payload_change`: the payload becomes another one during a recording.
//!
//! `m_p -> m_p + dm` from a time on, taken up over [`super::RISE`]: mass, inertia and weight together. Of a linear load it is the hanging
//! mass. What is taken up moves with the link already, so that no impulse is exchanged. Time counts from the start of the recording.

use super::{risen, EffectInfo, EffectParameter};
use crate::scalar::Scalar;

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "payload_change",
    block: "arm",
    at: "joint",
    parameters: &[
        EffectParameter::new("mass_change", "kg").within(-1e6, 1e6),
        EffectParameter::new("time", "s").within(-1e9, 1e9),
    ],
};

/// Change of the mass [kg] at a time [s].
#[inline]
pub fn change<S: Scalar>(mass: S, time: S, now: f64) -> S {
    mass * risen(now, time)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_there_after_its_time() {
        assert_eq!((change(2.0, 3.0, 2.9), change(2.0, 3.0, 3.1), change(0.0, 3.0, 4.0)), (0.0, 2.0, 0.0));
    }
}
