//! `external_torque`: something pushes a link for a while, up to three times in a recording.
//!
//! A torque on the joint from a time on for a duration, each edge over a rise (20 ms of a blow, half a second of a hand), and a second
//! and a third of their own. The environment pushes, not the base. Time counts
//! from the start of the recording. K. Ohnishi, M. Shibata & T. Murakami, "Motion control for advanced mechatronics", IEEE/ASME Trans.
//! Mechatronics 1, 1996 (disturbance torque).

use super::{risen_over, EffectInfo, EffectParameter, RISE};
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
        EffectParameter::new("torque_2", "N m").within(-1e9, 1e9),
        EffectParameter::new("time_2", "s").within(-1e9, 1e9),
        EffectParameter::new("duration_2", "s"),
        EffectParameter::new("torque_3", "N m").within(-1e9, 1e9),
        EffectParameter::new("time_3", "s").within(-1e9, 1e9),
        EffectParameter::new("duration_3", "s"),
        EffectParameter::new("rise", "s").within(RISE, 1e9),
    ],
};

/// Torque [N m] at a time [s] of pushes, each with its torque, time and duration.
#[inline]
pub fn torque<S: Scalar>(pushes: [S; 10], now: f64) -> S {
    let rise = pushes[9];
    let push = |k: usize| {
        let (torque, time, duration) = (pushes[k], pushes[k + 1], pushes[k + 2]);
        torque * (risen_over(now, time, rise) - risen_over(now, time + duration, rise))
    };
    push(0) + push(3) + push(6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_and_goes() {
        let pulse = [3.0, 1.0, 0.5, 0.0, 5.0, 1.0, -2.0, 4.0, 0.25, RISE];
        let at = |now: f64| torque(pulse, now);
        assert_eq!((at(0.9), at(1.2), at(1.6), at(4.1)), (0.0, 3.0, 0.0, -2.0));
        let area: f64 = (0..20_000).map(|k| at(1e-4 * f64::from(k)) * 1e-4).sum();
        assert!((area - 1.5).abs() < 1e-6, "the impulse is torque times duration: {area}");
        assert_eq!(torque([0.0, 1.0, 0.5, 0.0, 1.0, 0.5, 0.0, 1.0, 0.5, RISE], 1.2), 0.0);
    }
}
