//! `tendon_give`: cable, strap, fitting or frame between a muscle and its load gives way.
//!
//! A spring stands in series with each muscle of a group: it is longer by `s` under the pull `F`,
//! and the muscle is as much shorter at the same angle: `e = (x(q) + s)/L`. It comes to rest with
//! the muscle within `tau`: `s' = (s_F - s)/(tau (1 + c k))`, with `s_F` the stretch that holds `F`
//! at rest, `c` its slope over `F` and `k` the stiffness of the muscle with its air, a step of
//! Newton for each `tau`. That is no damper of any material, and as fast for a soft cable as for a
//! stiff one. The gas has the volume of the shorter muscle. Damping of the muscle follows the motion
//! of its load; what remembers a way, or creeps, follows its own. One state for each group, the
//! stretch [m]; at the start it is at rest under the pull. G. A. Pratt & M. M. Williamson, "Series
//! elastic actuators", IROS 1995.
//!
//! `linear`: `s_F = c F`.
//!
//! `toe`: `s_F = c F/(1 + F/F_h)`, soft at first, stiffer as its fibres align, as braided cords and
//! straps are: the toe region of Y. C. Fung, *Biomechanics: Mechanical Properties of Living Tissues*
//! (1981), ch. 7, with a hyperbola in the place of his exponential.

use super::{At, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role, Use};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// It comes to rest faster than any arm moves.
const TIME: EffectParameter =
    EffectParameter::new("time_constant", "s", 0.0005, 1.0, 0.001).starts(&[0.001]).role(Use::Held);

const COMPLIANCE: EffectParameter =
    EffectParameter::new("compliance", "m/N", 0.0, 1e-3, 2e-6).starts(&[2e-6, 2e-5]).off(0.0);

const LINEAR: Form = Form {
    name: "linear",
    parameters: &[COMPLIANCE, TIME],
    states: &[EffectState { name: "", role: Role::Moves }],
    integrates: true,
    ports: &[Port::Give],
    make: made_by!(linear),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "tendon_give",
    block: "muscle",
    at: "muscle",
    // last: what is at rest with the muscle is at rest with its pull
    order: 9,
    acts_in: &["chamber", "arm", "pull"],
    source: "Pratt & Williamson (1995), a spring in series; Fung (1981), the toe of a cord",
    forms: &[
        LINEAR,
        Form {
            name: "toe",
            parameters: &[
                COMPLIANCE,
                EffectParameter::new("half_force", "N", 1.0, 1e5, 100.0).starts(&[50.0, 500.0]),
                TIME,
            ],
            make: made_by!(toe),
            ..LINEAR
        },
    ],
    ..EffectInfo::USUAL
};

/// What gives between a muscle and its load; its state is by how much [m].
#[derive(Debug, Clone, Copy)]
struct Give<S> {
    compliance: S,
    /// Pull at which a toe has half of its compliance; none of what has no toe.
    half_force: Option<S>,
    time_constant: S,
}

fn linear<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Give { compliance: values[0], half_force: None, time_constant: values[1] })
}

fn toe<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Give { compliance: values[0], half_force: Some(values[1]), time_constant: values[2] })
}

impl<S: Scalar> Give<S> {
    /// Stretch [m] at rest under a pull [N]; a push is no cord's: as soft as at no pull.
    #[inline]
    fn rest(&self, pull: S) -> S {
        match self.half_force {
            Some(half) if pull.re() > 0.0 => self.compliance * pull / (pull / half + 1.0),
            _ => self.compliance * pull,
        }
    }

    /// Slope of that stretch over the pull [m/N].
    #[inline]
    fn slope(&self, pull: S) -> S {
        match self.half_force {
            Some(half) if pull.re() > 0.0 => {
                let away = pull / half + 1.0;
                self.compliance / (away * away)
            }
            _ => self.compliance,
        }
    }
}

impl<S: Scalar> Effect<S> for Give<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Muscle(muscle) = at {
            own[0] = self.rest(muscle.force);
        }
    }

    fn rates(&self, at: &At<S>, own: &[S], rates: &mut [S]) {
        if let At::Muscle(muscle) = at {
            let softer = self.slope(muscle.force) * muscle.stiffness + 1.0;
            rates[0] = (self.rest(muscle.force) - own[0]) / (self.time_constant * softer);
        }
    }

    fn fastest(&self) -> f64 {
        1.0 / self.time_constant.re()
    }

    fn mobility(&self) -> f64 {
        self.compliance.re()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::AtMuscle;

    fn pulled(force: f64) -> At<f64> {
        let (gauge, contraction, length, rate, stretched) = (4e5, 0.1, 0.2, 0.0, 0.0);
        let stiffness = 1e5;
        At::Muscle(AtMuscle { gauge, contraction, length, rate, stretched, force, stiffness })
    }

    #[test]
    fn it_comes_to_rest_where_the_pull_holds_it() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let toe = INFO.form("toe").unwrap();
        // slower by the 100 N/mm of the muscle; at its half force a toe has a quarter of its slope
        for (form, values, rest, softer) in
            [(&LINEAR, vec![2e-6, 0.01], 1e-3, 1.2), (toe, vec![4e-6, 500.0, 0.01], 1e-3, 1.1)]
        {
            let effect = (form.make.plain)(&values, &gas);
            let (mut own, mut rates) = ([0.0], [0.0]);
            effect.rates(&pulled(500.0), &own, &mut rates);
            assert!((rates[0] - rest / (0.01 * softer)).abs() < 1e-12);
            effect.start(&gas, &pulled(500.0), &mut own);
            assert!((own[0] - rest).abs() < 1e-15);
            effect.rates(&pulled(500.0), &own, &mut rates);
            assert!(rates[0].abs() < 1e-12);
        }
    }

    #[test]
    fn a_toe_is_as_soft_as_at_no_pull_where_it_is_pushed() {
        let give = Give { compliance: 4e-6, half_force: Some(500.0), time_constant: 0.01 };
        let slope = |from: f64| (give.rest(from + 1e-3) - give.rest(from)) / 1e-3;
        assert!((slope(-100.0) / give.mobility() - 1.0).abs() < 1e-9);
        assert!((slope(0.0) / give.mobility() - 1.0).abs() < 1e-5);
        assert!(slope(500.0) < 0.3 * give.mobility());
    }
}
