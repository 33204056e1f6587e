//! `muscle_rate_damping`: viscous force of the muscle, that grows with pressure and differs with
//! direction.
//!
//! `F_v = (b_0 + b_1 p_g) L'` while contracting, `s` times that while lengthening; the part of the
//! pressure below zero does not count. D. B. Reynolds, D. W. Repperger, C. A. Phillips & G. Bandry,
//! "Modeling the dynamic characteristics of pneumatic muscle", Annals of Biomedical Engineering 31,
//! 2003: damping is less in relaxation than in contraction.

use super::{AtMuscle, Effect, EffectInfo, EffectParameter, Extremes, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_rate_damping",
    block: "muscle",
    at: "muscle",
    order: 3,
    source: "Reynolds, Repperger, Phillips & Bandry (2003)",
    forms: &[Form {
        name: "linear",
        parameters: &[
            EffectParameter::new("damping_constant", "N s/m", 0.0, 1e7, 200.0)
                .starts(&[100.0])
                .off(0.0),
            EffectParameter::new("damping_pressure", "m s", 0.0, 10.0, 0.0005)
                .starts(&[0.0005])
                .off(0.0),
            EffectParameter::new("lengthening_share", "1", 0.0, 10.0, 1.0).starts(&[1.0]),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Force],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Force of one muscle [N] at a gauge pressure [Pa] and a rate of its length [m/s].
#[inline]
pub fn force<S: Scalar>(damping: [S; 3], pressure: S, length_rate: S) -> S {
    let [fixed, slope, share] = damping;
    let positive = if pressure.re() > 0.0 { pressure } else { constant(0.0) };
    let force = (fixed + slope * positive) * length_rate;
    if length_rate.re() > 0.0 {
        force * share
    } else {
        force
    }
}

/// Largest damping [N s/m] up to a gauge pressure [Pa].
pub fn largest(damping: [f64; 3], pressure: f64) -> f64 {
    (damping[0] + damping[1] * pressure.max(0.0)) * damping[2].max(1.0)
}

/// Viscous damping of a muscle.
#[derive(Debug, Clone, Copy)]
struct Damping<S>([S; 3]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Damping(std::array::from_fn(|k| values[k])))
}

impl<S: Scalar> Effect<S> for Damping<S> {
    fn force(&self, at: &AtMuscle<S>, _own: &[S]) -> S {
        force(self.0, at.gauge, at.rate)
    }

    fn resistance(&self, most: &Extremes) -> (f64, f64) {
        (largest(self.0.map(|v| v.re()), most.pressure - most.ambient), 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_takes_from_the_pull_of_a_contracting_muscle() {
        let b = [300.0, 1e-3, 0.5];
        assert!((force(b, 4e5, -0.1) + 70.0_f64).abs() < 1e-12);
        assert!((force(b, 4e5, 0.1) - 35.0_f64).abs() < 1e-12);
        assert!((force(b, -4e5, -0.1) + 30.0_f64).abs() < 1e-12);
        assert_eq!(force([0.0, 0.0, 1.0], 4e5, 0.3), 0.0);
        assert_eq!(largest(b, 4e5), 700.0);
    }
}
