//! `muscle_creep`: the muscle relaxes where it is held, and goes on where its pressure is.
//!
//! `standard_linear_solid`: a spring and a damper in series beside the muscle, `F_c = k (L - L_d)`,
//! `L_d' = (L - L_d)/tau`: at constant length the force relaxes, at constant pressure the length
//! creeps on in the direction of its last change. One state for each group of muscles, the length
//! `L_d` of the damper; at the start it is that of the muscle, at rest. W. N. Findley, J. S. Lai &
//! K. Onaran, *Creep and Relaxation of Nonlinear Viscoelastic Materials* (1976); H. F. Schulte Jr,
//! "The characteristics of the McKibben artificial muscle" (1961).
//!
//! `two_branches`: two such pairs with `k/2` each, with `tau` and `10 tau`: two of the terms, a
//! decade apart, of the generalised Maxwell model (Findley, Lai & Onaran, ch. 5).
//!
//! `force_relaxation`: a share of what the muscle pulls relaxes, whatever moved it, pressure or
//! length: `F - s y`, `y' = (F - y)/tau`, `F` the force before this effect; after long rest `(1 -
//! s) F` is left. The quasi-linear viscoelasticity of Y. C. Fung, *Biomechanics: Mechanical
//! Properties of Living Tissues* (1981), ch. 7, with one exponential in the place of his spectrum.
//! One state, the force `y` [N] that has relaxed; at the start it is `relaxed` of that of the
//! muscle: 1 at rest, 0 where the load came on just then.
//!
//! `bladder_relaxation`: the same of the bladder's part of the force, which is what is rubber.

use super::{
    At, AtMuscle, AtRest, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role,
};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const TIME_CONSTANT: EffectParameter = EffectParameter::new("time_constant", "s", 0.001, 1e6, 3.0)
    .starts(&[1.0, 10.0])
    .time_constant();

const SOLID: Form = Form {
    name: "standard_linear_solid",
    parameters: &[
        EffectParameter::new("stiffness", "N/m", 0.0, 1e7, 500.0).starts(&[200.0, 2000.0]).off(0.0),
        TIME_CONSTANT,
    ],
    states: &[EffectState { name: "", role: Role::Moves }],
    integrates: true,
    ports: &[Port::Force],
    make: made_by!(solid),
};

const RELAXATION: Form = Form {
    name: "force_relaxation",
    parameters: &[
        EffectParameter::new("share", "1", 0.0, 0.9, 0.05).starts(&[0.03, 0.1]).off(0.0),
        TIME_CONSTANT,
        EffectParameter::new("relaxed", "1", 0.0, 1.0, 1.0).starts(&[0.0, 1.0]),
    ],
    make: made_by!(of_force),
    ..SOLID
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_creep",
    block: "muscle",
    at: "muscle",
    order: 2,
    at_rest: &[AtRest::Set("relaxed", 1.0)],
    source:
        "Findley, Lai & Onaran (1976); Schulte (1961); Fung, Biomechanics (1981), quasi-linear \
        viscoelasticity for the relaxation of force",
    forms: &[
        SOLID,
        Form {
            name: "two_branches",
            states: &[
                EffectState { name: "fast", role: Role::Moves },
                EffectState { name: "slow", role: Role::Moves },
            ],
            make: made_by!(branches),
            ..SOLID
        },
        RELAXATION,
        Form {
            name: "bladder_relaxation",
            ports: &[Port::Bladder],
            make: made_by!(of_bladder),
            ..RELAXATION
        },
    ],
    ..EffectInfo::USUAL
};

/// How much longer the second branch takes.
const DECADE: f64 = 10.0;

/// Force of one muscle [N] at a length and with a damper's length [m].
#[inline]
pub fn force<S: Scalar>(stiffness: S, length: S, damper: S) -> S {
    stiffness * (length - damper)
}

/// Rate of what follows a length [m] or a force [N], of the same, a second.
#[inline]
pub fn rate<S: Scalar>(time_constant: S, now: S, relaxed: S) -> S {
    (now - relaxed) / time_constant
}

/// Springs and dampers beside a muscle; its states are the lengths of the dampers.
#[derive(Debug, Clone, Copy)]
struct Creep<S> {
    stiffness: S,
    time_constant: S,
}

fn solid<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Creep { stiffness: values[0], time_constant: values[1] })
}

fn branches<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Creep { stiffness: values[0] * 0.5, time_constant: values[1] })
}

impl<S: Scalar> Effect<S> for Creep<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Muscle(muscle) = at {
            own.fill(muscle.length);
        }
    }

    fn rates(&self, at: &At<S>, own: &[S], rates: &mut [S]) {
        let At::Muscle(muscle) = at else { return };
        let mut time_constant = self.time_constant;
        for (rate_of, damper) in rates.iter_mut().zip(own) {
            *rate_of = rate(time_constant, muscle.length, *damper);
            time_constant *= DECADE;
        }
    }

    fn force(&self, at: &AtMuscle<S>, own: &[S]) -> S {
        let branches = own.iter().map(|damper| force(self.stiffness, at.length, *damper));
        branches.fold(constant(0.0), |sum, branch| sum + branch)
    }

    fn fastest(&self) -> f64 {
        1.0 / self.time_constant.re()
    }
}

/// A share of a force that relaxes; its state is the force that has relaxed.
#[derive(Debug, Clone, Copy)]
struct Relaxation<S> {
    bladder: bool,
    share: S,
    time_constant: S,
    relaxed: S,
}

fn relaxation<S: Scalar>(bladder: bool, values: &[S]) -> Box<dyn Effect<S>> {
    let [share, time_constant, relaxed] = [values[0], values[1], values[2]];
    Box::new(Relaxation { bladder, share, time_constant, relaxed })
}

fn of_force<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    relaxation(false, values)
}

fn of_bladder<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    relaxation(true, values)
}

impl<S: Scalar> Relaxation<S> {
    /// What is added to the force [N].
    fn change(&self, own: &[S]) -> S {
        -(self.share * own[0])
    }
}

impl<S: Scalar> Effect<S> for Relaxation<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Muscle(muscle) = at {
            own[0] = self.relaxed * muscle.force;
        }
    }

    fn rates(&self, at: &At<S>, own: &[S], rates: &mut [S]) {
        if let At::Muscle(muscle) = at {
            rates[0] = rate(self.time_constant, muscle.force, own[0]);
        }
    }

    fn force(&self, _at: &AtMuscle<S>, own: &[S]) -> S {
        if self.bladder {
            return constant(0.0);
        }
        self.change(own)
    }

    fn bladder(&self, own: &[S], _bladder: S, _contraction: S) -> S {
        self.change(own)
    }

    fn fastest(&self) -> f64 {
        1.0 / self.time_constant.re()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Form;
    use crate::simulate::integrate::Rk4;

    const TAU: f64 = 3.0;

    fn muscle(length: f64, force: f64) -> AtMuscle<f64> {
        let (gauge, contraction, rate, stretched) = (4e5, 0.1, 0.0, 0.0);
        AtMuscle { gauge, contraction, length, rate, stretched, force, stiffness: 0.0 }
    }

    /// What a form adds to the force after a step of length and force, now and a time [s] later,
    /// with a strength of 2 kN/m or of a tenth, and so much of the first force relaxed before.
    fn step(form: &Form, time: f64, relaxed: f64) -> (f64, f64) {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let strength = if form.parameters[0].name == "share" { 0.1 } else { 2e3 };
        let effect = (form.make.plain)(&[strength, TAU, relaxed], &gas);
        let (n, now) = (form.states.len(), muscle(0.25, 300.0));
        let (mut y, mut method) = (vec![0.0; n], Rk4::new(n));
        effect.start(&gas, &At::Muscle(muscle(0.24, 100.0)), &mut y);
        let added = |y: &[f64]| match form.ports {
            [Port::Bladder] => effect.bladder(y, 300.0, 0.1),
            _ => effect.force(&now, y),
        };
        let first = added(&y);
        let steps = (time / 0.01).round() as usize;
        for _ in 0..steps {
            method.step(&mut y, 0.01, |_, y, out| effect.rates(&At::Muscle(now), y, out));
        }
        (first, added(&y))
    }

    fn near(found: (f64, f64), expected: (f64, f64)) {
        let gap = (found.0 - expected.0).abs().max((found.1 - expected.1).abs());
        assert!(gap < 1e-6, "{found:?} {expected:?}");
    }

    #[test]
    fn a_step_of_length_relaxes_exponentially() {
        near(step(&SOLID, TAU, 1.0), (20.0, 20.0 * (-1.0_f64).exp()));
    }

    #[test]
    fn a_second_branch_takes_ten_times_as_long() {
        let left = 10.0 * ((-1.0_f64).exp() + (-0.1_f64).exp());
        near(step(INFO.form("two_branches").unwrap(), TAU, 1.0), (20.0, left));
    }

    #[test]
    fn a_share_of_the_force_relaxes_whatever_moved_it() {
        for name in ["force_relaxation", "bladder_relaxation"] {
            for (relaxed, before) in [(1.0, 100.0), (0.4, 40.0), (0.0, 0.0)] {
                let later = -0.1 * (300.0 - (300.0 - before) * (-1.0_f64).exp());
                near(step(INFO.form(name).unwrap(), TAU, relaxed), (-0.1 * before, later));
            }
        }
    }
}
