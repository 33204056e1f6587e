//! One-link arm with payload, friction and elastic stops.
//!
//! `(Iz + mp l^2) theta'' = tau - c theta' - f tanh(theta'/w) - (m lc + mp l) g sin(theta) +
//! tau_stop - k (theta - theta_k)`, angle from the gravity vector (physics of dissertation ch. 5;
//! stops as one-sided spring and damper; a spring beside the muscles, `k`, at rest at `theta_k`).
//! On a tilted base, and with a centre of mass off the line of the link, the weight is
//! `m lc g sin(theta + b + e) + mp l g sin(theta + b)`.

use crate::scalar::{constant, Scalar};

/// Parameters of a one-link arm.
#[derive(Debug, Clone, Copy)]
pub struct OneLink<S> {
    /// Inertia about the joint without payload [kg m2].
    pub inertia: S,
    /// First moment without payload [kg m].
    pub first_moment: S,
    /// Distance of the payload from the joint [m].
    pub length: f64,
    /// Payload mass [kg].
    pub payload: S,
    /// Viscous friction [N m s/rad].
    pub viscous: S,
    /// Coulomb friction [N m].
    pub coulomb: S,
    /// Speed over which Coulomb friction changes sign [rad/s].
    pub coulomb_speed: f64,
    /// Gravity [m/s2].
    pub gravity: f64,
    /// Spring across the joint.
    pub spring: Spring<S>,
    /// How it hangs.
    pub mounting: Mounting<S>,
}

/// Directions of an arm's own centre of mass, and of its payload, where the joint's angle is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting<S> {
    /// Cosine and sine of the angle of the centre of mass from the gravity vector.
    own: [S; 2],
    /// The same of the payload.
    payload: [S; 2],
    base_angle: S,
    /// Both are straight down, and stay so whatever varies.
    plumb: bool,
}

impl<S: Scalar> Mounting<S> {
    /// A base whose zero is `base_angle` off the gravity vector, and a centre of mass that is
    /// `centre_angle` off the line to the payload [rad].
    pub fn new(base_angle: S, centre_angle: S) -> Self {
        let at = |angle: S| [angle.cos(), angle.sin()];
        let (own, payload) = (at(base_angle + centre_angle), at(base_angle));
        let plumb = [own, payload].iter().all(|at| at[1].same(&constant(0.0)));
        Self { own, payload, base_angle, plumb }
    }

    /// Angle of the line to the payload from the gravity vector, where the joint's is zero [rad].
    pub fn base_angle(&self) -> S {
        self.base_angle
    }

    /// Straight down.
    pub fn plumb() -> Self {
        Self::new(constant(0.0), constant(0.0))
    }
}

/// A linear spring across a joint, beside the muscles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring<S> {
    /// Stiffness [N m/rad].
    pub stiffness: S,
    /// Angle at which it is at rest [rad].
    pub angle: S,
}

impl<S: Scalar> Spring<S> {
    /// None at all.
    pub fn none() -> Self {
        Self { stiffness: constant(0.0), angle: constant(0.0) }
    }

    /// Its torque on the joint [N m], towards its rest.
    #[inline]
    pub fn torque(&self, angle: S) -> S {
        self.stiffness * (self.angle - angle)
    }
}

/// Elastic stops at both ends of the range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stops {
    /// Lower limit [rad].
    pub min_angle: f64,
    /// Upper limit [rad].
    pub max_angle: f64,
    /// Stiffness [N m/rad].
    pub stiffness: f64,
    /// Damping [N m s/rad].
    pub damping: f64,
}

impl Stops {
    /// Torque of the stops [N m]: never pulls.
    #[inline]
    pub fn torque<S: Scalar>(&self, angle: S, rate: S) -> S {
        let zero = constant(0.0);
        if angle.re() < self.min_angle {
            let push = (-angle + self.min_angle) * self.stiffness - rate * self.damping;
            if push.re() > 0.0 {
                push
            } else {
                zero
            }
        } else if angle.re() > self.max_angle {
            let push = (angle - self.max_angle) * self.stiffness + rate * self.damping;
            if push.re() > 0.0 {
                -push
            } else {
                zero
            }
        } else {
            zero
        }
    }
}

impl<S: Scalar> OneLink<S> {
    /// Inertia about the joint with payload [kg m2].
    #[inline]
    pub fn total_inertia(&self) -> S {
        self.inertia + self.payload * (self.length * self.length)
    }

    /// Friction of the joint [N m] at a rate [rad/s], positive against it.
    #[inline]
    pub fn friction(&self, rate: S) -> S {
        self.viscous * rate + self.coulomb * (rate / self.coulomb_speed).tanh()
    }

    /// Largest torque of its weight by the sine and by the cosine of the joint's angle [N m].
    #[inline]
    pub fn weights(&self) -> [S; 2] {
        let Mounting { own, payload, plumb, .. } = self.mounting;
        if plumb {
            return [self.level_weight(), constant(0.0)];
        }
        let hanging = self.payload * self.length;
        [0, 1].map(|k| (self.first_moment * own[k] + hanging * payload[k]) * self.gravity)
    }

    /// Torque of gravity where the link is level, its payload included [N m].
    #[inline]
    pub fn level_weight(&self) -> S {
        (self.first_moment + self.payload * self.length) * self.gravity
    }

    /// Torque that holds the arm against gravity [N m].
    #[inline]
    pub fn weight(&self, angle: S) -> S {
        let [level, side] = self.weights();
        if self.mounting.plumb {
            return level * angle.sin(); // as most are, and a cosine is dear
        }
        level * angle.sin() + side * angle.cos()
    }

    /// Angular acceleration [rad/s2] under a joint torque and a stop torque [N m].
    #[inline]
    pub fn acceleration(&self, angle: S, rate: S, torque: S, stop_torque: S) -> S {
        let own = self.spring.torque(angle) - self.friction(rate);
        (torque + own - self.weight(angle) + stop_torque) / self.total_inertia()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_push_only_inwards() {
        let stops = Stops { min_angle: 0.2, max_angle: 2.0, stiffness: 2e4, damping: 60.0 };
        assert_eq!(stops.torque(1.0, 5.0), 0.0);
        assert!(stops.torque(0.19, 0.0) > 0.0 && stops.torque(2.01, 0.0) < 0.0);
        assert_eq!(stops.torque(0.199, 10.0), 0.0, "leaving the stop fast: it does not pull");
    }

    #[test]
    fn hanging_arm_is_in_equilibrium() {
        let arm = OneLink {
            inertia: 0.6,
            first_moment: 1.8,
            length: 0.9,
            payload: 9.0,
            viscous: 3.0,
            coulomb: 1.5,
            coulomb_speed: 0.02,
            gravity: 9.80665,
            spring: Spring::none(),
            mounting: Mounting::plumb(),
        };
        assert_eq!(arm.acceleration(0.0, 0.0, 0.0, 0.0), 0.0);
        let weight = (1.8 + 9.0 * 0.9) * 9.80665;
        assert!(arm.acceleration(std::f64::consts::FRAC_PI_2, 0.0, weight, 0.0).abs() < 1e-12);
    }

    #[test]
    fn a_tilt_is_an_angle_of_the_joint_and_the_centre_of_mass_has_one_of_its_own() {
        let arm = |base: f64, centre: f64, payload: f64| OneLink {
            inertia: 0.6,
            first_moment: 1.8,
            length: 0.9,
            payload,
            viscous: 0.0,
            coulomb: 0.0,
            coulomb_speed: 0.02,
            gravity: 9.80665,
            spring: Spring::none(),
            mounting: Mounting::new(base, centre),
        };
        let (quarter, near) = (std::f64::consts::FRAC_PI_2, |a: f64, b: f64| (a - b).abs() < 1e-12);
        for angle in [-1.3_f64, 0.0, 0.4, 2.0] {
            let plumb = arm(0.0, 0.0, 5.0).weight(angle);
            assert!(near(arm(0.3, 0.0, 5.0).weight(angle - 0.3), plumb));
            let across = (1.8 + 5.0 * 0.9) * 9.80665 * angle.cos();
            assert!(near(arm(quarter, 0.0, 5.0).weight(angle), across));
            let both = arm(0.2, 0.5, 0.0).weight(angle) + 5.0 * 0.9 * 9.80665 * (angle + 0.2).sin();
            assert!(near(arm(0.2, 0.5, 5.0).weight(angle), both));
            assert!(near(arm(0.2, 0.5, 0.0).weight(angle), arm(0.7, 0.0, 0.0).weight(angle)));
        }
    }

    #[test]
    fn a_spring_pulls_to_its_rest() {
        let spring = Spring { stiffness: 40.0_f64, angle: 0.5 };
        assert_eq!((spring.torque(0.5), Spring::none().torque(0.3)), (0.0, 0.0));
        assert!((spring.torque(0.75) + 10.0).abs() < 1e-12 && spring.torque(0.0) > 0.0);
    }
}
