//! `external_torque`: something from outside pushes a link; the environment, not the base.
//!
//! `pushes`: a torque on the joint from a time on for a duration, each edge over a rise (20 ms of a
//! blow, half a second of a hand), and a second and a third of their own. Time counts from the
//! start of the recording. K. Ohnishi, M. Shibata & T. Murakami, "Motion control for advanced
//! mechatronics", IEEE/ASME Trans. Mechatronics 1, 1996 (disturbance torque).
//!
//! `constant`: `tau = T` at all times. Ohnishi et al. (1996).
//!
//! `vibration`: `tau = T sin(2 pi f t) + U cos(2 pi f t)`, a machine that shakes with one
//! frequency; with both parts the amplitude is linear and the phase free, as in M. Bodson, A. Sacks
//! & P. Khosla, "Harmonic generation in adaptive feedforward cancellation schemes", IEEE Trans.
//! Automatic Control 39, 1994.
//!
//! `two_vibrations`: the sum of two, each with its own frequency. Bodson et al. (1994).

use super::{risen_over, Effect, EffectInfo, EffectParameter, Form, Port, Use};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};
use std::f64::consts::TAU;

const TORQUE: EffectParameter =
    EffectParameter::new("torque", "N m", -1e9, 1e9, 5.0).starts(&[-5.0, 5.0]).off(0.0).tried(1.0);

/// What cables, hoses and a spring that nobody noted pull with all the time, one standard deviation
/// [N m]: what pulls harder is seen, or is a weight.
const STEADY: f64 = 2.0;

const COSINE: EffectParameter =
    EffectParameter::new("torque_cosine", "N m", -1e9, 1e9, 0.0).starts(&[5.0]).off(0.0);

const FREQUENCY: EffectParameter = EffectParameter::new("frequency", "Hz", 0.01, 1000.0, 2.0)
    .starts(&[1.0, 4.0])
    .scan(0.1, 25.0, 25)
    .same_everywhere();

const PUSHES: Form = Form {
    name: "pushes",
    parameters: &[
        TORQUE,
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
    make: made_by!(pushes),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "external_torque",
    block: "arm",
    at: "joint",
    source:
        "Ohnishi, Shibata & Murakami (1996), disturbance torque; Bodson, Sacks & Khosla (1994) \
        for the vibration",
    forms: &[
        PUSHES,
        Form {
            name: "constant",
            parameters: &[TORQUE.prior(0.0, STEADY)],
            make: made_by!(steady),
            ..PUSHES
        },
        Form {
            name: "vibration",
            parameters: &[TORQUE, COSINE, FREQUENCY],
            make: made_by!(vibration),
            ..PUSHES
        },
        Form {
            name: "two_vibrations",
            parameters: &[
                TORQUE,
                COSINE,
                FREQUENCY,
                EffectParameter { name: "torque_2", ..TORQUE }.again("torque"),
                EffectParameter { name: "torque_cosine_2", ..COSINE }.again("torque_cosine"),
                EffectParameter { name: "frequency_2", ..FREQUENCY }.again("frequency"),
            ],
            make: made_by!(two_vibrations),
            ..PUSHES
        },
    ],
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

fn pushes<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Pushes(std::array::from_fn(|k| values[k])))
}

impl<S: Scalar> Effect<S> for Pushes<S> {
    fn push(&self, time: f64) -> S {
        torque(self.0, time)
    }
}

/// A torque that stays, or shakes with a frequency [Hz].
#[derive(Debug, Clone, Copy)]
struct Vibration<S> {
    sine: S,
    cosine: S,
    frequency: S,
}

/// Two of them at once.
#[derive(Debug, Clone, Copy)]
struct TwoVibrations<S>([Vibration<S>; 2]);

fn steady<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    let zero = constant(0.0);
    Box::new(Vibration { sine: zero, cosine: values[0], frequency: zero })
}

fn vibration<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Vibration { sine: values[0], cosine: values[1], frequency: values[2] })
}

fn two_vibrations<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(TwoVibrations([0, 3].map(|k| Vibration {
        sine: values[k],
        cosine: values[k + 1],
        frequency: values[k + 2],
    })))
}

impl<S: Scalar> Effect<S> for TwoVibrations<S> {
    fn push(&self, time: f64) -> S {
        self.0[0].push(time) + self.0[1].push(time)
    }

    fn fastest(&self) -> f64 {
        self.0.iter().map(Effect::fastest).fold(0.0, f64::max)
    }
}

impl<S: Scalar> Effect<S> for Vibration<S> {
    fn push(&self, time: f64) -> S {
        let (sine, cosine) = (self.frequency * (TAU * time)).sin_cos();
        self.sine * sine + self.cosine * cosine
    }

    fn fastest(&self) -> f64 {
        TAU * self.frequency.re()
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

    #[test]
    fn a_vibration_repeats_and_a_constant_stays() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let made = |form: &str, values: &[f64]| (INFO.form(form).unwrap().make.plain)(values, &gas);
        let shaken = made("vibration", &[3.0, 4.0, 2.0]);
        let most = (0..500).map(|k| shaken.push(1e-3 * f64::from(k))).fold(0.0, f64::max);
        assert!((most - 5.0).abs() < 1e-3);
        assert!((shaken.push(0.0) - 4.0).abs() < 1e-12 && (shaken.push(0.125) - 3.0).abs() < 1e-12);
        assert!((shaken.push(0.3) - shaken.push(1.3)).abs() < 1e-12);
        let twice = made("two_vibrations", &[3.0, 4.0, 2.0, 1.0, -2.0, 0.5]);
        let apart = [made("vibration", &[3.0, 4.0, 2.0]), made("vibration", &[1.0, -2.0, 0.5])];
        let sum: f64 = apart.iter().map(|one| one.push(0.3)).sum();
        assert!((twice.push(0.3) - sum).abs() < 1e-12);
        let steady = made("constant", &[-2.0]);
        assert_eq!([0.0, 0.3, 99.0].map(|now| steady.push(now)), [-2.0; 3]);
    }
}
