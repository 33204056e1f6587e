//! `joint_coulomb_stribeck`: friction of the joint that is larger at rest than in motion.
//!
//! `exponential`: `tau = -(f_s - f) exp(-(w/w_s)^2) tanh(10 w/w_s)` beside the arm's own Coulomb
//! friction `f`: the stiction above it, that fades over the Stribeck speed `w_s`. Its sign changes
//! over a tenth of that speed. B. Armstrong-Helouvry, P. Dupont & C. Canudas de Wit, "A survey of
//! models, analysis tools and compensation methods for the control of machines with friction",
//! Automatica 30, 1994.
//!
//! `rational`: it fades as `1/(1 + (w/w_s)^2)`, with a long tail. D. P. Hess & A. Soom, "Friction
//! at a lubricated line contact operating at oscillating sliding velocities", J. Tribology 112,
//! 1990.
//!
//! `with_coulomb`: `tau = -(c + (f_s - f) exp(-(w/w_s)^2)) tanh(10 w/w_s)`, where the joint rubs
//! more than the arm says at any speed. Armstrong-Helouvry et al. (1994).
//!
//! `load_proportional`: the same with `c = m T`, `T` the torques that the muscles put on the joint,
//! all counted as positive: what rubs is what the bearing or the pulley carries. P. Hamon, M.
//! Gautier & P. Garrec, "Dynamic identification of robots with a dry friction model depending on
//! load and velocity", IROS 2010.
//!
//! `per_direction`: the exponential form, another `r` times as large where the joint turns to
//! smaller angles. Armstrong-Helouvry et al. (1994).

use super::{At, Effect, EffectInfo, EffectParameter, Extremes, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const STICTION: EffectParameter =
    EffectParameter::new("stiction", "N m", 0.0, 1e6, 1.0).starts(&[0.5, 3.0]).off(0.0);
const SPEED: EffectParameter = EffectParameter::new("stribeck_speed", "rad/s", 0.001, 1000.0, 0.05)
    .starts(&[0.02, 0.1])
    .usually(0.01, 0.1);

const EXPONENTIAL: Form = Form {
    name: "exponential",
    parameters: &[STICTION, SPEED],
    states: &[],
    integrates: false,
    ports: &[Port::Torque],
    make: made_by!(exponential),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "joint_coulomb_stribeck",
    block: "joint",
    at: "joint",
    dry_friction: true,
    source:
        "Armstrong-Helouvry, Dupont & Canudas de Wit (1994); Hess & Soom (1990); Hamon, Gautier \
        & Garrec (2010)",
    forms: &[
        EXPONENTIAL,
        Form { name: "rational", make: made_by!(rational), ..EXPONENTIAL },
        Form {
            name: "with_coulomb",
            parameters: &[
                STICTION,
                SPEED,
                EffectParameter::new("coulomb", "N m", 0.0, 1e6, 1.0).starts(&[0.5, 2.0]).off(0.0),
            ],
            make: made_by!(with_coulomb),
            ..EXPONENTIAL
        },
        Form {
            name: "load_proportional",
            parameters: &[
                STICTION,
                SPEED,
                EffectParameter::new("load_share", "1", 0.0, 1.0, 0.03)
                    .starts(&[0.02, 0.1])
                    .off(0.0),
            ],
            make: made_by!(load_proportional),
            ..EXPONENTIAL
        },
        Form {
            name: "per_direction",
            parameters: &[
                STICTION,
                SPEED,
                EffectParameter::new("backward_ratio", "1", 0.0, 100.0, 0.7).starts(&[0.5, 2.0]),
            ],
            make: made_by!(per_direction),
            ..EXPONENTIAL
        },
    ],
    ..EffectInfo::USUAL
};

const SHARE: f64 = 0.1;

/// How the stiction fades.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fading {
    Exponential,
    Rational,
}

impl Fading {
    /// What is left of the stiction at a speed, in Stribeck speeds.
    #[inline]
    fn left<S: Scalar>(self, relative: S) -> S {
        let square = relative * relative;
        match self {
            Self::Exponential => (-square).exp(),
            Self::Rational => (square + 1.0).recip(),
        }
    }
}

/// Largest slope of the friction over the rate [N m s/rad].
pub fn steepest(stiction: f64, speed: f64) -> f64 {
    stiction / (SHARE * speed)
}

/// Friction of a joint.
#[derive(Debug, Clone, Copy)]
struct Friction<S> {
    fading: Fading,
    stiction: S,
    speed: S,
    /// At any speed [N m].
    coulomb: S,
    /// Share of the load, at any speed [1].
    share: S,
    /// Of what is there where the angle falls.
    backward: S,
}

impl<S: Scalar> Friction<S> {
    fn new(fading: Fading, values: &[S]) -> Self {
        let (zero, one) = (constant(0.0), constant(1.0));
        let (stiction, speed) = (values[0], values[1]);
        Self { fading, stiction, speed, coulomb: zero, share: zero, backward: one }
    }
}

fn exponential<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Friction::new(Fading::Exponential, values))
}

fn rational<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Friction::new(Fading::Rational, values))
}

fn with_coulomb<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Friction { coulomb: values[2], ..Friction::new(Fading::Exponential, values) })
}

fn load_proportional<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Friction { share: values[2], ..Friction::new(Fading::Exponential, values) })
}

fn per_direction<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Friction { backward: values[2], ..Friction::new(Fading::Exponential, values) })
}

impl<S: Scalar> Effect<S> for Friction<S> {
    fn torque(&self, at: &At<S>, _own: &[S]) -> S {
        let At::Joint { rate, load, .. } = at else { return constant(0.0) };
        let relative = *rate / self.speed;
        let steady = self.coulomb + self.share * *load;
        let friction = self.stiction * self.fading.left(relative) + steady;
        let backward = if rate.re() < 0.0 { self.backward } else { constant(1.0) };
        -(friction * (relative / SHARE).tanh() * backward)
    }

    fn resistance(&self, most: &Extremes) -> (f64, f64) {
        let steady = self.coulomb.re() + self.share.re() * most.load;
        let largest = (self.stiction.re() + steady) * self.backward.re().max(1.0);
        (steepest(largest, self.speed.re()), 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Torque [N m] of a form at a rate [rad/s] under a load of 40 N m.
    fn at(form: &str, values: &[f64], rate: f64) -> f64 {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let effect = (INFO.form(form).unwrap().make.plain)(values, &gas);
        effect.torque(&At::Joint { pressure: 3.0, angle: 0.8, rate, load: 40.0 }, &[])
    }

    /// Friction of the usual form, against the motion.
    fn torque(stiction: f64, speed: f64, rate: f64) -> f64 {
        -at("exponential", &[stiction, speed], rate)
    }

    #[test]
    fn it_opposes_slow_motion_only() {
        let peak = (1..200).map(|k| torque(2.0, 0.05, 5e-4 * f64::from(k))).fold(0.0, f64::max);
        assert!(peak > 1.8 && peak < 2.0, "{peak}");
        assert!(torque(2.0, 0.05, 0.5).abs() < 1e-12);
        assert_eq!(torque(2.0, 0.05, -0.02), -torque(2.0, 0.05, 0.02));
        assert!((torque(2.0, 0.05, 1e-7) / 1e-7 - steepest(2.0, 0.05)).abs() < 1e-3);
    }

    #[test]
    fn a_rational_one_falls_with_the_square_of_the_speed() {
        let fast = at("rational", &[2.0, 0.05], 0.5);
        assert!((fast + 2.0 / 101.0).abs() < 1e-12);
        assert!((at("rational", &[2.0, 0.05], 5.0) / fast - 0.01).abs() < 1e-4);
    }

    #[test]
    fn the_steady_part_stays_at_any_speed() {
        assert!((at("with_coulomb", &[2.0, 0.05, 0.7], 3.0) + 0.7).abs() < 1e-12);
        assert!((at("load_proportional", &[2.0, 0.05, 0.1], -3.0) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn one_direction_rubs_more() {
        let values = [2.0, 0.05, 1.5];
        for rate in [0.01, 0.04] {
            let (up, down) =
                (at("per_direction", &values, rate), at("per_direction", &values, -rate));
            assert_eq!(up, at("exponential", &values[..2], rate));
            assert!((down / up + 1.5).abs() < 1e-12);
        }
    }
}
