//! `toy_joint_spring`: a torsion spring at the joint that begins at an angle and relaxes.
//!
//! `tau = -k (s(d) - 0.8 z)`, `z' = (s(d) - z)/T`, `d` the depth beyond the spring's angle, the
//! corner rounded over 1 deg. Form `linear`: `s = d`; form `cubic`: `s = d^3/d_0^2`, so that `k` is
//! the secant stiffness at `d_0` = 0.5 rad. One state at each joint, the deflection `z` that has
//! relaxed [rad]; at the start it is that of rest. A standard linear solid with a corner: W. N.
//! Findley, J. S. Lai & K. Onaran, *Creep and Relaxation of Nonlinear Viscoelastic Materials*
//! (1976). An example of what a new effect takes.

use crate::blocks::gas::Gas;
use crate::effects::{
    beyond, At, Effect, EffectInfo, EffectParameter, EffectState, Extremes, Form, Port, Role,
};
use crate::made_by;
use crate::scalar::{constant, Scalar};

const PARAMETERS: &[EffectParameter] = &[
    EffectParameter::new("stiffness", "N m/rad", 0.0, 1e9, 30.0).starts(&[10.0, 100.0]).off(0.0),
    EffectParameter::new("angle", "rad", -7.0, 7.0, 0.8).starts(&[0.5, 0.9]),
    EffectParameter::new("time_constant", "s", 1e-3, 1e6, 0.5).starts(&[0.2, 1.0]),
];

const STATES: &[EffectState] = &[EffectState { name: "relaxed", role: Role::Moves }];

const LINEAR: Form = Form {
    name: "linear",
    parameters: PARAMETERS,
    states: STATES,
    integrates: true,
    ports: &[Port::Torque],
    make: made_by!(linear),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "toy_joint_spring",
    block: "joint",
    at: "joint",
    order: 1,
    source: "Findley, Lai & Onaran (1976)",
    forms: &[LINEAR, Form { name: "cubic", make: made_by!(cubic), ..LINEAR }],
    ..EffectInfo::USUAL
};

/// Width of the round corner [rad].
const CORNER: f64 = std::f64::consts::PI / 180.0;
/// Depth at which the stiffness of the cubic form is a secant [rad].
pub const SECANT: f64 = 0.5;
/// Share of the torque that relaxes [1].
pub const RELAXING: f64 = 0.8;

/// How the torque grows with the depth.
#[derive(Debug, Clone, Copy)]
enum Law {
    Linear,
    Cubic,
}

/// A spring with its parameters; its state is the deflection that has relaxed [rad].
#[derive(Debug, Clone, Copy)]
struct Spring<S> {
    law: Law,
    stiffness: S,
    angle: S,
    time_constant: S,
}

fn spring<S: Scalar>(law: Law, values: &[S]) -> Box<dyn Effect<S>> {
    Box::new(Spring { law, stiffness: values[0], angle: values[1], time_constant: values[2] })
}

fn linear<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    spring(Law::Linear, values)
}

fn cubic<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    spring(Law::Cubic, values)
}

impl<S: Scalar> Spring<S> {
    /// Deflection [rad] at a joint.
    fn deflection(&self, at: &At<S>) -> S {
        let At::Joint { angle, .. } = at else { return constant(0.0) };
        let depth = beyond(*angle - self.angle, CORNER);
        match self.law {
            Law::Linear => depth,
            Law::Cubic => depth * depth * depth / (SECANT * SECANT),
        }
    }
}

impl<S: Scalar> Effect<S> for Spring<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        own[0] = self.deflection(at);
    }

    fn rates(&self, at: &At<S>, own: &[S], rates: &mut [S]) {
        rates[0] = (self.deflection(at) - own[0]) / self.time_constant;
    }

    fn torque(&self, at: &At<S>, own: &[S]) -> S {
        -(self.stiffness * (self.deflection(at) - own[0] * RELAXING))
    }

    fn fastest(&self) -> f64 {
        1.0 / self.time_constant.re()
    }

    fn resistance(&self, most: &Extremes) -> (f64, f64) {
        let depth = (most.angles.1 - self.angle.re()).max(0.0);
        let steepest = match self.law {
            Law::Linear => 1.0,
            Law::Cubic => 3.0 * (depth / SECANT).powi(2),
        };
        (0.0, if depth > 0.0 { self.stiffness.re() * steepest } else { 0.0 })
    }
}
