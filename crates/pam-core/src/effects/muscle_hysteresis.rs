//! `muscle_hysteresis`: rate-independent friction of the braid, `F_h = W m`: more pull while the
//! muscle is extended, less while it contracts.
//!
//! `maxwell_slip`: elements `zeta_i <- clip(zeta_i + dL/d_i, -1, 1)` with `d_i = d (1/8, 1/4, 1/2,
//! 1)`, `m` their mean, and `W = W0 + c pg`. `c = 0` and a vanishing `d` is constant Coulomb
//! friction, `W0 = 0` pressure-proportional friction. Vo-Minh et al. (2011); Al-Bender, Lampaert &
//! Swevers (2005).
//!
//! `pressure_stops`: the Prandtl-Ishlinskii operator of eight stops, evenly spread up to `d` and
//! equally stiff: `m = sum(i zeta_i)/sum(i)` with `d_i = d i/8`, and `W = W0 + c pg` scales
//! stiffness and width together. P. Krejci & K. Kuhnen, "Inverse control of systems with hysteresis
//! and creep", IEE Proc. Control Theory Appl. 148, 2001 (operators of this kind); its way to the
//! full width is a parabola.
//!
//! `force_proportional`: the elements of `maxwell_slip`, `W = W0 + s |F|` with the muscle's force
//! `F` before this effect: threads that rub under the tension that they carry. The form is as
//! commonly used, Coulomb friction under a load; that the threads' friction makes the loop, and how
//! their contact grows: S. Davis & D. G. Caldwell, "Braid effects on contractile range and friction
//! modeling in pneumatic muscle actuators", Int. J. Robotics Research 25, 2006.
//!
//! `dahl`: one state, `m' = 3.75 L'/d (1 - m sgn L')`, as stiff before it slips as the elements. P.
//! R. Dahl, *A solid friction model*, Aerospace Corporation TOR-0158(3107-18)-1 (1968).
//!
//! Between steps the states move in closed form; inside a step the force follows the stage's
//! length, so that smooth stretches keep the integrator's order.

use super::{AtMuscle, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::muscle::slip::{Slip, STUCK};
use crate::scalar::{constant, Scalar};

const CONSTANT: EffectParameter =
    EffectParameter::new("friction_constant", "N", 0.0, 10000.0, 5.0).starts(&[2.0]).off(0.0);
const SLOPE: EffectParameter =
    EffectParameter::new("friction_pressure", "m2", 0.0, 1.0, 5e-5).starts(&[2e-5]).off(0.0);
const SHARE: EffectParameter =
    EffectParameter::new("friction_force", "1", 0.0, 1.0, 0.03).starts(&[0.02]).off(0.0);
const PRESLIDING: EffectParameter =
    EffectParameter::new("presliding", "m", 1e-6, 0.1, 0.001).starts(&[0.0005, 0.003]);

const fn follows(name: &'static str) -> EffectState {
    EffectState { name, role: Role::Follows }
}

const MAXWELL: Form = Form {
    name: "maxwell_slip",
    parameters: &[CONSTANT, SLOPE, PRESLIDING],
    states: &[
        follows("element_1"),
        follows("element_2"),
        follows("element_3"),
        follows("element_4"),
    ],
    integrates: false,
    ports: &[Port::Force],
    make: made_by!(maxwell),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_hysteresis",
    block: "muscle",
    at: "muscle",
    order: 1,
    dry_friction: true,
    source: "Vo-Minh et al. (2011); Al-Bender, Lampaert & Swevers (2005); Robinson (2014) (2.36) \
        as a special case; Krejci & Kuhnen (2001); Davis & Caldwell (2006); Dahl (1968)",
    forms: &[
        MAXWELL,
        Form {
            name: "pressure_stops",
            states: &[
                follows("stop_1"),
                follows("stop_2"),
                follows("stop_3"),
                follows("stop_4"),
                follows("stop_5"),
                follows("stop_6"),
                follows("stop_7"),
                follows("stop_8"),
            ],
            make: made_by!(stops),
            ..MAXWELL
        },
        Form {
            name: "force_proportional",
            parameters: &[CONSTANT, SHARE, PRESLIDING],
            make: made_by!(by_force),
            ..MAXWELL
        },
        Form { name: "dahl", states: &[follows("direction")], make: made_by!(dahl), ..MAXWELL },
    ],
    ..EffectInfo::USUAL
};

/// Friction force of one muscle [N] for its direction, -1 to 1, at a gauge pressure [Pa] (the part
/// below zero does not count).
#[inline]
pub fn force<S: Scalar>(direction: S, constant_part: S, pressure_part: S, pressure: S) -> S {
    let positive = if pressure.re() > 0.0 { pressure } else { constant(0.0) };
    (constant_part + pressure_part * positive) * direction
}

/// The elements that remember the way of a muscle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Memory {
    Maxwell,
    Stops,
    Dahl,
}

/// Stops of the operator.
const STOPS: usize = 8;

/// Relative distances of the stops.
const fn spread(stop: usize) -> f64 {
    (stop + 1) as f64 / STOPS as f64
}

impl Memory {
    /// Bring the states over a stretch [m] with a presliding distance [m].
    fn moved<S: Scalar>(self, own: &mut [S], stretch: S, presliding: S) {
        match self {
            Self::Maxwell => {
                own.copy_from_slice(&slip(own).moved(stretch, presliding).elements());
            }
            Self::Stops => {
                for (k, zeta) in own.iter_mut().enumerate() {
                    *zeta = stopped(*zeta + stretch / (presliding * spread(k)));
                }
            }
            Self::Dahl => own[0] = bristle(own[0], stretch, presliding),
        }
    }

    /// Direction of motion, -1 to 1, a stretch [m] later.
    fn direction<S: Scalar>(self, own: &[S], stretch: S, presliding: S) -> S {
        match self {
            Self::Maxwell => slip(own).moved(stretch, presliding).mean(),
            Self::Stops => {
                let mut sum = constant::<S>(0.0);
                for (k, zeta) in own.iter().enumerate() {
                    sum += stopped(*zeta + stretch / (presliding * spread(k))) * spread(k);
                }
                sum / (0..STOPS).map(spread).sum::<f64>()
            }
            Self::Dahl => bristle(own[0], stretch, presliding),
        }
    }

    /// Slope of the direction where nothing slips, times the presliding distance.
    fn stuck(self) -> f64 {
        match self {
            Self::Maxwell => STUCK,
            Self::Stops => STOPS as f64 / (0..STOPS).map(spread).sum::<f64>(),
            // next to a return the bristle is twice as stiff as where it is not deflected
            Self::Dahl => 2.0 * STUCK,
        }
    }
}

fn slip<S: Scalar>(own: &[S]) -> Slip<S> {
    Slip::from_elements(std::array::from_fn(|k| own[k]))
}

fn stopped<S: Scalar>(zeta: S) -> S {
    if zeta.re() > 1.0 {
        constant(1.0)
    } else if zeta.re() < -1.0 {
        constant(-1.0)
    } else {
        zeta
    }
}

/// Dahl's state after a stretch [m]; where nothing moves its slope is the mean of both ways.
fn bristle<S: Scalar>(direction: S, stretch: S, presliding: S) -> S {
    let way = stretch * STUCK / presliding;
    if way.re() > 0.0 {
        (direction - 1.0) * (-way).exp() + 1.0
    } else if way.re() < 0.0 {
        (direction + 1.0) * way.exp() - 1.0
    } else {
        direction + way
    }
}

/// What the width grows with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Growth {
    Pressure,
    Force,
}

/// Friction of the braid; its states are the stretches of its elements.
#[derive(Debug, Clone, Copy)]
struct Hysteresis<S> {
    memory: Memory,
    growth: Growth,
    constant: S,
    slope: S,
    presliding: S,
}

fn hysteresis<S: Scalar>(memory: Memory, growth: Growth, values: &[S]) -> Box<dyn Effect<S>> {
    let (constant, slope, presliding) = (values[0], values[1], values[2]);
    Box::new(Hysteresis { memory, growth, constant, slope, presliding })
}

fn maxwell<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    hysteresis(Memory::Maxwell, Growth::Pressure, values)
}

fn stops<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    hysteresis(Memory::Stops, Growth::Pressure, values)
}

fn by_force<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    hysteresis(Memory::Maxwell, Growth::Force, values)
}

fn dahl<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    hysteresis(Memory::Dahl, Growth::Pressure, values)
}

impl<S: Scalar> Effect<S> for Hysteresis<S> {
    fn force(&self, at: &AtMuscle<S>, own: &[S]) -> S {
        let by = match self.growth {
            Growth::Pressure => at.gauge,
            Growth::Force => at.force.abs(),
        };
        let direction = self.memory.direction(own, at.stretched, self.presliding);
        force(direction, self.constant, self.slope, by)
    }

    fn moved(&self, own: &mut [S], from: S, to: S, rest_length: f64) {
        self.memory.moved(own, (from - to) * rest_length, self.presliding);
    }

    fn presliding(&self, gauge: f64, force: f64) -> f64 {
        let by = match self.growth {
            Growth::Pressure => gauge,
            Growth::Force => force,
        };
        (self.constant.re() + self.slope.re() * by) * self.memory.stuck() / self.presliding.re()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const D: f64 = 1e-3;

    fn muscle(stretched: f64) -> AtMuscle<f64> {
        let (gauge, contraction, length, rate, force) = (3e5, 0.1, 0.25, 0.0, 200.0);
        AtMuscle { gauge, contraction, length, rate, stretched, force, stiffness: 0.0 }
    }

    type Made = (&'static Form, Box<dyn Effect<f64>>, Vec<f64>, f64);

    /// Every form, 2 N wide without pressure or force, with its states and its width [N].
    fn forms() -> Vec<Made> {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let all = INFO.forms.iter().map(|form| {
            let (slope, width) =
                if form.name == "force_proportional" { (0.05, 12.0) } else { (1e-5, 5.0) };
            let effect = (form.make.plain)(&[2.0, slope, D], &gas);
            (form, effect, vec![0.0; form.states.len()], width)
        });
        all.collect()
    }

    #[test]
    fn a_cycle_dissipates_and_closes() {
        for (form, effect, mut own, width) in forms() {
            let mut work = 0.0;
            let mut ends = Vec::new();
            for k in 0..4000 {
                let dl = 5e-3 * ((f64::from(k + 1) * 0.01).sin() - (f64::from(k) * 0.01).sin());
                work += effect.force(&muscle(0.5 * dl), &own) * dl;
                effect.moved(&mut own, 0.0, -dl, 1.0);
                ends.push(effect.force(&muscle(0.0), &own));
            }
            assert!(work > 0.0, "{}", form.name);
            let most = ends.iter().copied().fold(0.0, f64::max);
            assert!((most / width - 1.0).abs() < 1e-3, "{}: {most}", form.name);
        }
    }

    #[test]
    fn two_moves_one_way_are_one_and_the_way_in_a_step_is_that_after_it() {
        for (form, effect, own, _) in forms() {
            let (mut once, mut twice) = (own.clone(), own.clone());
            effect.moved(&mut once, 0.0, -4e-4, 1.0);
            effect.moved(&mut twice, 0.0, -1e-4, 1.0);
            effect.moved(&mut twice, 0.0, -3e-4, 1.0);
            for (a, b) in once.iter().zip(&twice) {
                assert!((a - b).abs() < 1e-12, "{}", form.name);
            }
            let inside = effect.force(&muscle(4e-4), &own);
            assert!((inside - effect.force(&muscle(0.0), &once)).abs() < 1e-12, "{}", form.name);
        }
    }

    #[test]
    fn stuck_it_is_a_spring() {
        for (form, effect, mut own, width) in forms() {
            let slope = effect.force(&muscle(1e-9), &own) / 1e-9;
            let most = effect.presliding(3e5, 200.0);
            let expected = match form.name {
                "dahl" => 0.5 * most,
                _ => most,
            };
            assert!((slope / expected - 1.0).abs() < 1e-4, "{}: {slope} {most}", form.name);
            // after a return
            effect.moved(&mut own, 0.0, -20.0 * D, 1.0);
            let slope = (width - effect.force(&muscle(-1e-9), &own)) / 1e-9;
            assert!((slope / most - 1.0).abs() < 1e-4, "{}: {slope} {most}", form.name);
        }
    }

    #[test]
    fn evenly_spread_stops_fill_their_loop_along_a_parabola() {
        let (form, effect, own, width) = forms().swap_remove(1);
        assert_eq!(form.name, "pressure_stops");
        for share in [0.25, 0.5, 0.75, 1.0] {
            // of infinitely many stops: 2 x - x^2
            let exact = width * share * (2.0 - share);
            let found = effect.force(&muscle(share * D), &own);
            assert!((found - exact).abs() < 0.03 * width, "{share}: {found} {exact}");
        }
    }
}
