//! `base_flexibility`: a mounting that gives way under the torque of the first joint.
//!
//! `q'' + 2 zeta w q' + w^2 q = -c w^2 tau` with the compliance `c` and the base's own frequency
//! `w`, so that its inertia is `1/(c w^2)`; `tau` is all that joint and base exchange. The link
//! stands at `theta + q` against gravity, the sensor and the muscles see `theta`. At `c = 0`
//! nothing moves. Two states; at the start the base carries the arm's weight at rest. M. W. Spong,
//! "Modeling and control of elastic joint robots", ASME J. Dyn. Syst. Meas. Control 109, 1987.
//!
//! `with_play`: backlash of the joint. Between its two sides nothing pulls over an angle `b`, so
//! that the spring has `q` less what is inside the play, `|q| < b/2`, in the place of `q`; its
//! corners are round over a twentieth of `b/2`. M. Nordin & P.-O. Gutman, "Controlling mechanical
//! systems with backlash, a survey", Automatica 38, 2002 (dead-zone model).

use super::{At, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

const COMPLIANCE: EffectParameter = EffectParameter::new("compliance", "rad/(N m)", 0.0, 1.0, 5e-5)
    .starts(&[2e-5, 0.0002])
    .off(0.0);
const FREQUENCY: EffectParameter =
    EffectParameter::new("natural_frequency", "Hz", 0.01, 1000.0, 8.0)
        .starts(&[5.0, 12.0])
        .usually(3.0, 15.0);
const DAMPING: EffectParameter =
    EffectParameter::new("damping_ratio", "1", 0.0, 10.0, 0.03).starts(&[0.03]).usually(0.0, 0.05);

const ONE_MODE: Form = Form {
    name: "one_mode",
    parameters: &[COMPLIANCE, FREQUENCY, DAMPING],
    states: &[
        EffectState { name: "angle", role: Role::Moves },
        EffectState { name: "rate", role: Role::Moves },
    ],
    integrates: false,
    ports: &[Port::Mounting],
    make: made_by!(make),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "base_flexibility",
    block: "arm",
    at: "",
    source: "Spong (1987), elastic joint with the spring in the base",
    forms: &[
        ONE_MODE,
        Form {
            name: "with_play",
            parameters: &[
                COMPLIANCE,
                FREQUENCY,
                DAMPING,
                // a quarter of a degree, as gears and worn pins have
                EffectParameter::new("play", "rad", 1e-6, 1.0, 0.005).starts(&[0.005]),
            ],
            make: made_by!(make_with_play),
            ..ONE_MODE
        },
    ],
    ..EffectInfo::USUAL
};

/// Angular acceleration of the base [rad/s2] under the torque of the joint on the link [N m], where
/// its spring is turned by an angle (its own, less what is inside a play) and it has a rate.
#[inline]
pub fn acceleration<S: Scalar>(base: [S; 3], turned: S, rate: S, torque: S) -> S {
    let [compliance, frequency, damping] = base;
    let w = frequency * std::f64::consts::TAU;
    -(w * (w * (turned + compliance * torque) + damping * rate * 2.0))
}

/// Roundness of the corners of a play, in halves of it.
const ROUND: f64 = 0.05;
/// Newton steps to the angle at which a spring behind a play is turned so far.
const STEPS: usize = 12;

/// How far a spring behind a play is turned at an angle [rad], and its slope.
#[inline]
pub fn beyond<S: Scalar>(play: S, angle: S) -> (S, S) {
    let half = play * 0.5;
    let corner = half * half * (ROUND * ROUND);
    let (above, below) = (angle - half, angle + half);
    let (far, near) = ((above * above + corner).sqrt(), (below * below + corner).sqrt());
    (angle + (far - near) * 0.5, (above / far - below / near) * 0.5 + 1.0)
}

/// Angle at which a spring behind a play is turned so far [rad].
fn turned_by<S: Scalar>(play: S, turned: S) -> S {
    if turned.re() == 0.0 {
        return turned;
    }
    let half = play * (0.5 * turned.re().signum());
    let mut angle = turned + half;
    for _ in 0..STEPS {
        let (found, slope) = beyond(play, angle);
        angle -= (found - turned) / slope;
    }
    angle
}

/// How much a torque accelerates the base [1/(kg m2)], and its fastest rate [1/s].
pub fn mobility(base: [f64; 3]) -> (f64, f64) {
    let w = base[1] * std::f64::consts::TAU;
    (base[0] * w * w, w * (1.0 + 2.0 * base[2]))
}

/// A mounting that gives way; its states are its angle and rate.
#[derive(Debug, Clone, Copy)]
struct Base<S>([S; 3]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Base(std::array::from_fn(|k| values[k])))
}

impl<S: Scalar> Effect<S> for Base<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Arm { weight } = at {
            own[0] = -(self.0[0] * *weight);
        }
    }

    fn mounting(&self, own: &[S], torque: S) -> S {
        acceleration(self.0, own[0], own[1], torque)
    }

    fn mobility(&self) -> f64 {
        mobility(self.0.map(|v| v.re())).0
    }

    fn fastest(&self) -> f64 {
        mobility(self.0.map(|v| v.re())).1
    }
}

/// A joint whose two sides have play between them; its states are their angle and rate.
#[derive(Debug, Clone, Copy)]
struct Loose<S> {
    base: [S; 3],
    play: S,
}

fn make_with_play<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Loose { base: std::array::from_fn(|k| values[k]), play: values[3] })
}

impl<S: Scalar> Effect<S> for Loose<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Arm { weight } = at {
            own[0] = turned_by(self.play, -(self.base[0] * *weight));
        }
    }

    fn mounting(&self, own: &[S], torque: S) -> S {
        acceleration(self.base, beyond(self.play, own[0]).0, own[1], torque)
    }

    fn mobility(&self) -> f64 {
        mobility(self.base.map(|v| v.re())).0
    }

    fn fastest(&self) -> f64 {
        mobility(self.base.map(|v| v.re())).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_gives_way_by_its_compliance() {
        let base = [1e-4, 8.0, 0.02];
        assert!(acceleration(base, -1e-4 * 150.0, 0.0, 150.0_f64).abs() < 1e-9);
        assert!(acceleration(base, 0.0, 0.0, 150.0_f64) < 0.0);
        assert_eq!(acceleration([0.0, 8.0, 0.02], 0.0, 0.0, 150.0_f64), 0.0);
    }

    #[test]
    fn inside_its_play_a_joint_is_free() {
        let play = 0.01;
        assert_eq!(beyond(play, 0.0).0, 0.0);
        assert!(beyond(play, 0.003_f64).0.abs() < 3e-5);
        for angle in [-0.1_f64, -0.02, 0.02, 0.1] {
            let (found, slope) = beyond(play, angle);
            assert!((found - (angle - 0.005 * angle.signum())).abs() < 1e-6);
            assert!((slope - 1.0).abs() < 2e-4);
        }
        // the slope is that of differences, corners included
        for angle in [-0.0051_f64, -0.002, 0.0, 0.0049, 0.0052] {
            let slope = (beyond(play, angle + 1e-8).0 - beyond(play, angle - 1e-8).0) / 2e-8;
            assert!((beyond(play, angle).1 - slope).abs() < 1e-6);
        }
    }

    #[test]
    fn it_begins_where_its_spring_carries_the_weight() {
        for turned in [-0.02_f64, -1e-5, 0.0, 3e-4, 0.05] {
            let angle = turned_by(0.01, turned);
            assert!((beyond(0.01, angle).0 - turned).abs() < 1e-13);
        }
    }
}
