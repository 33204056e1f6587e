//! `external_torque`: something pushes a link for a while.
//!
//! A torque on the joint from a time on for a duration, each edge over [`super::RISE`]. The environment pushes, not the base. Time counts
//! from the start of the recording. K. Ohnishi, M. Shibata & T. Murakami, "Motion control for advanced mechatronics", IEEE/ASME Trans.
//! Mechatronics 1, 1996 (disturbance torque).

use super::{risen, EffectInfo, EffectParameter};
use crate::scalar::Scalar;

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "external_torque",
    block: "arm",
    at: "joint",
    parameters: &[
        EffectParameter::new("torque", "N m").within(-1e9, 1e9),
        EffectParameter::new("time", "s").within(-1e9, 1e9),
        EffectParameter::new("duration", "s"),
    ],
};

/// Torque [N m] at a time [s].
#[inline]
pub fn torque<S: Scalar>(pulse: [S; 3], now: f64) -> S {
    let [torque, time, duration] = pulse;
    torque * (risen(now, time) - risen(now, time + duration))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_and_goes() {
        let pulse = [3.0, 1.0, 0.5];
        let at = |now: f64| torque(pulse, now);
        assert_eq!((at(0.9), at(1.2), at(1.6)), (0.0, 3.0, 0.0));
        let area: f64 = (0..20_000).map(|k| at(1e-4 * f64::from(k)) * 1e-4).sum();
        assert!((area - 1.5).abs() < 1e-6, "the impulse is torque times duration: {area}");
        assert_eq!(torque([0.0, 1.0, 0.5], 1.2), 0.0);
    }
}
