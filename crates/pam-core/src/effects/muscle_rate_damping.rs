//! `muscle_rate_damping`: viscous force of the muscle, that grows with pressure and differs with direction.
//!
//! `F_v = (b_0 + b_1 p_g) L'` while contracting, `s` times that while lengthening; the part of the pressure below zero does not count.
//! D. B. Reynolds, D. W. Repperger, C. A. Phillips & G. Bandry, "Modeling the dynamic characteristics of pneumatic muscle", Annals of
//! Biomedical Engineering 31, 2003: damping is less in relaxation than in contraction.

use super::{EffectInfo, EffectParameter};
use crate::scalar::{constant, Scalar};

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_rate_damping",
    block: "muscle",
    at: "muscle",
    parameters: &[
        EffectParameter::new("damping_constant", "N s/m"),
        EffectParameter::new("damping_pressure", "m s"),
        EffectParameter::new("lengthening_share", "1").within(0.0, 10.0),
    ],
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
