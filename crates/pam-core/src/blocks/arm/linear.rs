//! Linear loads: a muscle pulls a hanging mass, or a load frame holds its length.
//!
//! `m x'' = F - m g - c x' - f tanh(x'/w) + F_stop`, `x` the shortening of the muscle, `F` the pull
//! of all muscles; stops as of the one-link arm, in metres. A frame prescribes `x` (dissertation
//! ch. 2: length cycled slowly at held pressure).

use crate::scalar::Scalar;

/// A mass that hangs from a muscle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HangingMass<S> {
    /// Mass [kg].
    pub mass: S,
    /// Viscous friction [N s/m].
    pub viscous: S,
    /// Coulomb friction [N].
    pub coulomb: S,
    /// Speed over which Coulomb friction changes sign [m/s].
    pub coulomb_speed: f64,
    /// Gravity [m/s2].
    pub gravity: f64,
}

impl<S: Scalar> HangingMass<S> {
    /// Friction [N] at a speed [m/s], positive against it.
    #[inline]
    pub fn friction(&self, speed: S) -> S {
        speed * self.viscous + (speed / self.coulomb_speed).tanh() * self.coulomb
    }

    /// Acceleration of the shortening [m/s2] under the pull of the muscles and a stop force [N].
    #[inline]
    pub fn acceleration(&self, speed: S, pull: S, stop_force: S) -> S {
        (pull - self.friction(speed) + stop_force - self.mass * self.gravity) / self.mass
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pull_of_the_weight_keeps_the_mass() {
        let load = HangingMass {
            mass: 10.0,
            viscous: 5.0,
            coulomb: 1.0,
            coulomb_speed: 0.01,
            gravity: 9.80665,
        };
        assert!(load.acceleration(0.0_f64, 98.0665, 0.0).abs() < 1e-14);
        assert!(
            load.acceleration(0.1, 98.0665, 0.0) < 0.0
                && load.acceleration(-0.1, 98.0665, 0.0) > 0.0
        );
        assert!((load.acceleration(0.0_f64, 0.0, 0.0) + 9.80665).abs() < 1e-12);
    }
}
