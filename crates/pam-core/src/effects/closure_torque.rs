//! `closure_torque`: torque that no named effect explains, as a sum of coefficients times terms of
//! a fixed dictionary.
//!
//! `tau = sum_k c_k t_k(s, a, w, memory)`, every coefficient in N m: `s` is the gauge pressure in
//! bar (the mean over the groups that pull on the joint), `a` the angle in rad, `w` the rate in
//! rad/s. Three terms remember, with a state each: `z' = (a - z)/T` (creep of the angle),
//! `zs' = (s - zs)/T` (of the pressure) and the rate-independent `q' = w/d (1 - q sign w)`, which
//! is 1 after a motion by some `d` and -1 after one back (P. R. Dahl, *A solid friction model*,
//! 1968). A model of a mismatch, not a name for it: S. L. Brunton, J. L. Proctor & J. N. Kutz, PNAS
//! 113, 2016 (sparse dictionaries).

use super::{
    At, Effect, EffectInfo, EffectParameter, EffectState, Extremes, Form, Port, Role, BAR,
};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// Number of terms.
pub const TERMS: usize = 22;
/// Parameters: the coefficients of the terms, then memory time and memory angle.
pub const PARAMETERS: usize = TERMS + 2;
/// States of a joint with it: `z`, `zs`, `q`.
pub const STATES: usize = 3;

const fn term(name: &'static str) -> EffectParameter {
    EffectParameter::new(name, "N m", -1e9, 1e9, 0.0).starts(&[-1.0, 1.0]).off(0.0)
}

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "closure_torque",
    block: "joint",
    at: "joint",
    named: false,
    order: 2,
    source: "Brunton, Proctor & Kutz (2016), sparse dictionaries; Dahl (1968), solid friction",
    forms: &[Form {
        name: "sum_of_terms",
        parameters: &[
            term("constant"),
            term("angle"),
            term("angle_squared"),
            term("sine_4"),
            term("cosine_4"),
            term("sine_8"),
            term("cosine_8"),
            term("pressure"),
            term("pressure_squared"),
            term("pressure_angle"),
            term("pressure_angle_squared"),
            term("rate"),
            term("angle_rate"),
            term("rate_quadratic"),
            term("pressure_rate"),
            term("sign"),
            term("pressure_sign"),
            term("creep"),
            term("pressure_creep"),
            term("pressure_memory"),
            term("slip"),
            term("pressure_slip"),
            EffectParameter::new("memory_time", "s", 0.01, 1e6, 1.0).starts(&[0.1, 0.5, 2.0, 8.0]),
            EffectParameter::new("memory_angle", "rad", 0.01, 10.0, 0.1)
                .starts(&[0.02, 0.05, 0.15, 0.4]),
        ],
        states: &[
            EffectState { name: "angle", role: Role::Moves },
            EffectState { name: "pressure", role: Role::Moves },
            EffectState { name: "slip", role: Role::Follows },
        ],
        integrates: true,
        ports: &[Port::Torque],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Speed over which the terms `sign` and `pressure_sign` turn [rad/s].
pub const SIGN_SPEED: f64 = 0.02;
/// Speed from which the slip is no faster [rad/s]: it has long been on its end by then, and would
/// want ever shorter steps.
const FASTEST_SLIP: f64 = 10.0;

/// A joint at one instant: gauge pressure [bar], angle [rad], rate [rad/s], and what it remembers.
#[derive(Debug, Clone, Copy)]
pub struct Here<S> {
    /// Gauge pressure [bar].
    pub pressure: S,
    /// Angle [rad].
    pub angle: S,
    /// Rate [rad/s].
    pub rate: S,
    /// `z` [rad], `zs` [bar], `q`.
    pub memory: [S; STATES],
}

impl<S: Scalar> Here<S> {
    /// Every term, in the order of the parameters.
    #[inline]
    pub fn terms(&self) -> [S; TERMS] {
        let Self { pressure: s, angle: a, rate: w, memory: [z, zs, q] } = *self;
        let speed = if w.re() < 0.0 { -w } else { w };
        let sign = (w / SIGN_SPEED).tanh();
        let (once, twice) = (a * 4.0, a * 8.0);
        [
            constant(1.0),
            a,
            a * a,
            once.sin(),
            once.cos(),
            twice.sin(),
            twice.cos(),
            s,
            s * s,
            s * a,
            s * a * a,
            w,
            a * w,
            w * speed,
            s * w,
            sign,
            s * sign,
            a - z,
            s * (a - z),
            s - zs,
            q,
            s * q,
        ]
    }

    /// Torque [N m].
    #[inline]
    pub fn torque(&self, coefficients: &[S]) -> S {
        self.terms().iter().zip(coefficients).fold(constant(0.0), |sum, (term, c)| sum + *term * *c)
    }

    /// Rates of what is remembered, for a memory time [s] and angle [rad].
    #[inline]
    pub fn rates(&self, time: S, angle: S) -> [S; STATES] {
        let [z, zs, q] = self.memory;
        let w = if self.rate.re() > FASTEST_SLIP {
            constant(FASTEST_SLIP)
        } else if self.rate.re() < -FASTEST_SLIP {
            constant(-FASTEST_SLIP)
        } else {
            self.rate
        };
        let left = if w.re() < 0.0 { q + 1.0 } else { -q + 1.0 };
        [(self.angle - z) / time, (self.pressure - zs) / time, w / angle * left]
    }
}

/// Damping [N m s/rad] and stiffness [N m/rad] that it adds at most, up to a gauge pressure [bar]
/// and an angle [rad].
pub fn resistance(values: &[f64; PARAMETERS], pressure: f64, angle: f64) -> (f64, f64) {
    let c = |name: &str| {
        let k = INFO.parameters().iter().position(|p| p.name == name);
        k.map_or(0.0, |k| values[k].abs())
    };
    let damping = c("rate")
        + c("angle_rate") * angle
        + 2.0 * c("rate_quadratic") * FASTEST_SLIP
        + c("pressure_rate") * pressure
        + (c("sign") + c("pressure_sign") * pressure) / SIGN_SPEED;
    let stiffness = c("angle")
        + 2.0 * c("angle_squared") * angle
        + 4.0 * (c("sine_4") + c("cosine_4"))
        + 8.0 * (c("sine_8") + c("cosine_8"))
        + pressure * (c("pressure_angle") + 2.0 * c("pressure_angle_squared") * angle)
        + c("angle_rate") * FASTEST_SLIP
        + c("creep")
        + c("pressure_creep") * pressure
        + (c("slip") + c("pressure_slip") * pressure) / c("memory_angle");
    (damping, stiffness)
}

/// Fastest rate of what is remembered [1/s].
pub fn fastest(time: f64, angle: f64) -> f64 {
    (1.0 / time).max(FASTEST_SLIP / angle)
}

/// A sum of torques of a joint; its states are the remembered angle and pressure, and the slip.
#[derive(Debug, Clone, Copy)]
struct ClosureTorque<S>([S; PARAMETERS]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(ClosureTorque(std::array::from_fn(|k| values[k])))
}

/// What it sees of a joint, None elsewhere.
fn here<S: Scalar>(at: &At<S>, own: &[S]) -> Option<Here<S>> {
    match at {
        At::Joint { pressure, angle, rate, .. } => Some(Here {
            pressure: *pressure,
            angle: *angle,
            rate: *rate,
            memory: std::array::from_fn(|k| own[k]),
        }),
        _ => None,
    }
}

impl<S: Scalar> Effect<S> for ClosureTorque<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Joint { pressure, angle, .. } = at {
            own.copy_from_slice(&[*angle, *pressure, constant(0.0)]);
        }
    }

    fn rates(&self, at: &At<S>, own: &[S], rates: &mut [S]) {
        if let Some(here) = here(at, own) {
            rates.copy_from_slice(&here.rates(self.0[TERMS], self.0[TERMS + 1]));
        }
    }

    fn torque(&self, at: &At<S>, own: &[S]) -> S {
        here(at, own).map_or(constant(0.0), |here| here.torque(&self.0))
    }

    fn fastest(&self) -> f64 {
        fastest(self.0[TERMS].re(), self.0[TERMS + 1].re())
    }

    fn resistance(&self, most: &Extremes) -> (f64, f64) {
        let pressure = (most.pressure - most.ambient) / BAR;
        let angle = most.angles.0.abs().max(most.angles.1.abs());
        resistance(&self.0.map(|v| v.re()), pressure, angle)
    }

    fn terms(&self, at: &At<S>, own: &[S]) -> Vec<S> {
        here(at, own).map_or(Vec::new(), |here| here.terms().to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::integrate::Rk4;

    fn here(pressure: f64, angle: f64, rate: f64, memory: [f64; STATES]) -> Here<f64> {
        Here { pressure, angle, rate, memory }
    }

    fn place(name: &str) -> usize {
        INFO.parameters().iter().position(|p| p.name == name).unwrap()
    }

    #[test]
    fn each_term_is_what_its_name_says() {
        let point = here(3.0, 0.5, -2.0, [0.2, 1.0, -0.4]);
        let terms = point.terms();
        let of = |name: &str| terms[place(name)];
        assert_eq!(
            (of("constant"), of("angle_squared"), of("pressure_angle_squared")),
            (1.0, 0.25, 0.75)
        );
        assert_eq!(
            (of("rate_quadratic"), of("pressure_rate"), of("angle_rate")),
            (-4.0, -6.0, -1.0)
        );
        assert_eq!((of("sign"), of("pressure_sign")), (-1.0, -3.0));
        assert!(
            (of("pressure_creep") - 0.9).abs() < 1e-12
                && (of("pressure_memory") - 2.0).abs() < 1e-12
        );
        assert!(
            (of("pressure_slip") + 1.2).abs() < 1e-12
                && (of("sine_4") - 2.0_f64.sin()).abs() < 1e-12
        );
        let mut coefficients = [0.0; TERMS];
        assert_eq!(point.torque(&coefficients), 0.0);
        coefficients[place("pressure_rate")] = 2.0;
        coefficients[place("constant")] = 1.5;
        assert_eq!(point.torque(&coefficients), -10.5);
    }

    #[test]
    fn the_slip_does_not_depend_on_the_rate_and_the_creep_does() {
        let after = |speed: f64| {
            let (mut y, mut method) = ([0.0; STATES], Rk4::new(STATES));
            let step = 1e-3 / speed;
            for k in 0..200 {
                let angle = |fraction: f64| 1e-3 * (f64::from(k) + fraction);
                method.step(&mut y, step, |fraction, y, out| {
                    let point = here(0.0, angle(fraction), speed, [y[0], y[1], y[2]]);
                    out.copy_from_slice(&point.rates(0.5, 0.1));
                });
            }
            y
        };
        let (slow, fast) = (after(0.1), after(2.0));
        assert!((slow[2] - (1.0 - (-2.0_f64).exp())).abs() < 1e-6, "{slow:?}");
        assert!((slow[2] - fast[2]).abs() < 1e-9);
        assert!(slow[0] > 2.0 * fast[0]);
    }

    #[test]
    fn resistance_bounds_the_slopes() {
        let values: [f64; PARAMETERS] = std::array::from_fn(|k| 0.3 + 0.1 * k as f64);
        let (damping, stiffness) = resistance(&values, 8.0, 2.0);
        let torque = |a: f64, w: f64| here(8.0, a, w, [0.0; STATES]).torque(&values);
        let h = 1e-6;
        for w in [-9.0, -0.01, 0.0, 0.3, 9.0] {
            assert!((torque(1.9, w + h) - torque(1.9, w - h)).abs() / (2.0 * h) < damping);
            assert!((torque(1.9 + h, w) - torque(1.9 - h, w)).abs() / (2.0 * h) < stiffness);
        }
    }
}
