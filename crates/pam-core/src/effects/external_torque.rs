//! `external_torque`: something pushes a link for a while, up to three times in a recording.
//!
//! A torque on the joint from a time on for a duration, each edge over a rise (20 ms of a blow,
//! half a second of a hand), and a second and a third of their own. The environment pushes, not the
//! base. Time counts from the start of the recording. K. Ohnishi, M. Shibata & T. Murakami, "Motion
//! control for advanced mechatronics", IEEE/ASME Trans. Mechatronics 1, 1996 (disturbance torque).

use super::{risen_over, Effect, EffectInfo, EffectParameter, Form, Port, Use};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "external_torque",
    block: "arm",
    at: "joint",
    source: "Ohnishi, Shibata & Murakami (1996), disturbance torque",
    forms: &[Form {
        name: "pushes",
        parameters: &[
            EffectParameter::new("torque", "N m", -1e9, 1e9, 5.0)
                .starts(&[-5.0, 5.0])
                .off(0.0)
                .tried(1.0),
            EffectParameter::new("time", "s", -1e9, 1e9, 5.0).starts(&[5.0, 15.0]).role(Use::Time),
            EffectParameter::new("duration", "s", 0.0, 1e9, 1.0)
                .starts(&[0.5, 3.0])
                .role(Use::Duration)
                .tried(1.0),
            EffectParameter::new("torque_2", "N m", -1e9, 1e9, 0.0)
                .starts(&[0.0])
                .off(0.0)
                .again("torque"),
            EffectParameter::new("time_2", "s", -1e9, 1e9, 0.0).starts(&[0.0]).again("time"),
            EffectParameter::new("duration_2", "s", 0.0, 1e9, 1.0).starts(&[1.0]).again("duration"),
            EffectParameter::new("torque_3", "N m", -1e9, 1e9, 0.0)
                .starts(&[0.0])
                .off(0.0)
                .again("torque"),
            EffectParameter::new("time_3", "s", -1e9, 1e9, 0.0).starts(&[0.0]).again("time"),
            EffectParameter::new("duration_3", "s", 0.0, 1e9, 1.0).starts(&[1.0]).again("duration"),
            EffectParameter::new("rise", "s", 0.02, 1e9, 0.02)
                .starts(&[0.02])
                .role(Use::Rise)
                .tried(0.4),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Push],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
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

/// Pushes from outside.
#[derive(Debug, Clone, Copy)]
struct Pushes<S>([S; 10]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Pushes(std::array::from_fn(|k| values[k])))
}

impl<S: Scalar> Effect<S> for Pushes<S> {
    fn push(&self, time: f64) -> S {
        torque(self.0, time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::RISE;

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
