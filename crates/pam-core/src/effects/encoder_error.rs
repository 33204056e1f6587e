//! `encoder_error`: the encoder of a joint reads an angle with an error that comes back every turn.
//!
//! `y = q + e(q) - e(q_0)`, `e = a sin q + b cos q`: a disc or a magnet that sits beside the axis of
//! the joint by `sqrt(a^2 + b^2)` of its radius. `first_and_second` adds `a_2 sin 2q + b_2 cos 2q`: a
//! disc that is tilted, a magnet that is oval, or two tracks with other gains. The error is none at
//! the angle `q_0`, where the encoder was set. Without amplitudes it has no constant: that is the
//! zero of its sensor. The angle behind a reading is found by Newton steps (`plant/encoder.rs`), and
//! the rate that is read is that of the reading. A stroke that is a small part of a turn has little
//! more of it than a zero and a factor.
//! E. O. Doebelin, *Measurement Systems*, ch. 4; H. C. Hoyt, "Error analysis for optical encoders",
//! and for magnets ams AG, application note AN5000, "Magnet selection and misalignment" (first and
//! second harmonic by displacement and tilt).

use super::{Effect, EffectInfo, EffectParameter, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// Sum of all amplitudes is below what would let the reading turn round: 2 of 0.1, 2 of 0.1 twice
/// as steep, added as squares.
const MOST: f64 = 0.1;

/// What encoders on a shaft err by, one standard deviation [rad]: half a degree. Larger amplitudes
/// stand for something else that goes with the angle, a moment arm or a weight.
const USUAL: f64 = 0.01;

const SINE: EffectParameter = EffectParameter::new("sine", "rad", -MOST, MOST, 0.005)
    .starts(&[-0.005, 0.005])
    .prior(0.0, USUAL)
    .off(0.0);
const COSINE: EffectParameter = EffectParameter::new("cosine", "rad", -MOST, MOST, 0.0)
    .starts(&[0.005])
    .prior(0.0, USUAL)
    .off(0.0);

/// Where nobody says it, the encoder was set at the angle zero; it may have been set anywhere on its
/// turn.
const SET: EffectParameter =
    EffectParameter::new("set_angle", "rad", -FULL, FULL, 0.0).starts(&[0.0]);
const FULL: f64 = std::f64::consts::TAU;

const FIRST: Form = Form {
    name: "first",
    parameters: &[SINE, COSINE, SET],
    states: &[],
    integrates: false,
    ports: &[Port::Encoder],
    make: made_by!(first),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "encoder_error",
    block: "sensors",
    at: "joint",
    acts_in: &["chamber", "arm", "pull"],
    source: "Doebelin, Measurement Systems, ch. 4; ams AG, AN5000",
    forms: &[
        FIRST,
        Form {
            name: "first_and_second",
            parameters: &[
                SINE,
                COSINE,
                EffectParameter { name: "sine_2", default: 0.002, starts: &[0.002], ..SINE },
                EffectParameter { name: "cosine_2", starts: &[0.002], ..COSINE },
                SET,
            ],
            make: made_by!(first_and_second),
            ..FIRST
        },
    ],
    ..EffectInfo::USUAL
};

/// Amplitudes of the first and the second harmonic, and the angle at which there is no error [rad].
#[derive(Debug, Clone, Copy)]
struct Harmonics<S> {
    first: [S; 2],
    second: Option<[S; 2]>,
    set: S,
}

fn first<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Harmonics { first: [values[0], values[1]], second: None, set: values[2] })
}

fn first_and_second<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    let second = Some([values[2], values[3]]);
    Box::new(Harmonics { first: [values[0], values[1]], second, set: values[4] })
}

/// Error of a harmonic at an angle [rad] that is none at another one, and its slope.
fn harmonic<S: Scalar>([sine, cosine]: [S; 2], order: f64, angle: S, set: S) -> (S, S) {
    let ((sin, cos), (sin_set, cos_set)) = ((angle * order).sin_cos(), (set * order).sin_cos());
    let error = sine * (sin - sin_set) + cosine * (cos - cos_set);
    (error, (sine * cos - cosine * sin) * order)
}

impl<S: Scalar> Effect<S> for Harmonics<S> {
    fn misread(&self, angle: S) -> (S, S) {
        let none = (constant(0.0), constant(0.0));
        let (error, slope) = harmonic(self.first, 1.0, angle, self.set);
        let second = |own| harmonic(own, 2.0, angle, self.set);
        let (more, steeper) = self.second.map_or(none, second);
        (error + more, slope + steeper)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_back_every_turn_and_is_none_where_it_was_set() {
        let disc = Harmonics { first: [0.01, -0.02], second: Some([0.003, 0.004]), set: 0.0 };
        let at = |angle: f64| disc.misread(angle).0;
        assert_eq!(at(0.0), 0.0);
        assert!((at(0.7) - at(0.7 + std::f64::consts::TAU)).abs() < 1e-15);
        let elsewhere = Harmonics { set: 0.4, ..disc };
        assert_eq!(elsewhere.misread(0.4).0, 0.0);
        assert!((elsewhere.misread(0.0).0 + at(0.4)).abs() < 1e-15);
        let eccentric = Harmonics { first: [0.01, 0.0], second: None, set: 0.0 };
        assert!((eccentric.misread(std::f64::consts::FRAC_PI_2).0 - 0.01_f64).abs() < 1e-16);
    }

    #[test]
    fn its_slope_is_that_of_differences_and_never_turns_the_reading_round() {
        for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let worst = Harmonics {
                first: [MOST * signs[0], MOST * signs[1]],
                second: Some([MOST * signs[0], MOST * signs[1]]),
                set: 0.0,
            };
            for k in -40..=40 {
                let angle = 0.1 * f64::from(k);
                let (up, down) = (worst.misread(angle + 1e-6).0, worst.misread(angle - 1e-6).0);
                let slope = worst.misread(angle).1;
                assert!((slope - (up - down) / 2e-6).abs() < 1e-9);
                assert!(slope > -0.5);
            }
        }
    }
}
