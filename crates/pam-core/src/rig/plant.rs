//! The state equation of a rig, composed of its blocks.
//!
//! State: supply pressure and chamber pressure [Pa, absolute], joint angle [rad] and rate [rad/s], gas mass [kg]
//! (only moved by `heat_transfer`), and the memory of the muscle's motion. Any of the pressures and the motion can
//! be *driven* by a signal instead of being integrated: that is where the chain is cut.

use super::{ParameterId as P, Rig, Values};
use crate::arm::linear::HangingMass;
use crate::arm::one_link::{OneLink, Stops};
use crate::effects::{heat_transfer, leak_muscle, muscle_hysteresis};
use crate::gas::chamber::{pressure_rate, ChamberState, Polytropic};
use crate::gas::valve::spool_position;
use crate::muscle::slip::{Slip, ELEMENTS};
use crate::scalar::{constant, Scalar};
use nalgebra::SVector;

/// Number of continuous states.
pub const STATES: usize = 5;
/// Index of the supply pressure [Pa, absolute].
pub const SUPPLY: usize = 0;
/// Index of the chamber pressure [Pa, absolute].
pub const PRESSURE: usize = 1;
/// Index of the joint angle [rad], or of the shortening [m] of a linear load.
pub const ANGLE: usize = 2;
/// Index of the joint rate [rad/s], or of the rate of shortening [m/s].
pub const RATE: usize = 3;
/// Index of the gas mass [kg].
pub const MASS: usize = 4;

/// Continuous state.
pub type State<S> = SVector<S, STATES>;
/// What the muscle remembers of its motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory<S> {
    /// Elements of the effect `muscle_hysteresis`.
    hysteresis: Slip<S>,
    /// Elements of the direction of motion that the muscle's own force depends on.
    direction: Slip<S>,
}

impl<S: Scalar> Default for Memory<S> {
    fn default() -> Self {
        Self { hysteresis: Slip::default(), direction: Slip::default() }
    }
}

impl Memory<f64> {
    /// Length of [`Self::to_array`].
    pub const NUMBERS: usize = 2 * ELEMENTS;

    /// All elements.
    #[must_use]
    pub fn to_array(&self) -> [f64; 2 * ELEMENTS] {
        let (hysteresis, direction) = (self.hysteresis.elements(), self.direction.elements());
        std::array::from_fn(|k| if k < ELEMENTS { hysteresis[k] } else { direction[k - ELEMENTS] })
    }

    /// The memory of the numbers of [`Self::to_array`]; what is missing is zero.
    #[must_use]
    pub fn from_slice(numbers: &[f64]) -> Self {
        let at = |k: usize| numbers.get(k).copied().unwrap_or(0.0);
        Self {
            hysteresis: Slip::from_elements(std::array::from_fn(at)),
            direction: Slip::from_elements(std::array::from_fn(|k| at(k + ELEMENTS))),
        }
    }
}

/// Which states are integrated; the others are driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Simulated {
    /// Supply pressure.
    pub supply: bool,
    /// Chamber pressure (and gas mass).
    pub chamber: bool,
    /// Joint angle and rate.
    pub arm: bool,
}

impl Simulated {
    /// Nothing is driven.
    pub const ALL: Self = Self { supply: true, chamber: true, arm: true };
}

/// Quantities that follow from a state, for output.
#[derive(Debug, Clone, Copy)]
pub struct Output<S> {
    /// Contraction ratio [1].
    pub contraction_ratio: S,
    /// Chamber volume [m3].
    pub volume: S,
    /// Force of all muscles [N].
    pub force: S,
    /// Joint torque [N m].
    pub torque: S,
    /// Gas temperature [K].
    pub temperature: S,
}

/// A rig with the values of its parameters in a scalar type.
#[derive(Debug, Clone)]
pub struct Plant<'a, S> {
    rig: &'a Rig,
    values: Values<S>,
    count: f64,
    rest_length: f64,
    body: Option<(Body<S>, Stops)>,
}

/// What the muscles move.
#[derive(Debug, Clone)]
enum Body<S> {
    Arm(OneLink<S>),
    Mass(HangingMass),
}

/// What the muscle and joint are at one angle.
struct Mechanics<S> {
    contraction: S,
    torque_arm: S,
    volume: S,
    volume_rate: S,
    muscle_volume: S,
    force: S,
}

impl<'a, S: Scalar> Plant<'a, S> {
    /// Compose a rig with parameter values.
    pub fn new(rig: &'a Rig, values: Values<S>) -> Self {
        let spec = rig.spec();
        let body = match (&spec.arm, &spec.joint, &spec.load, &spec.muscle) {
            (Some(a), Some(j), ..) => Some((
                Body::Arm(OneLink {
                    inertia: values[P::Inertia],
                    first_moment: values[P::FirstMoment],
                    length: a.length,
                    payload: values[P::Payload],
                    viscous: values[P::Viscous],
                    coulomb: values[P::Coulomb],
                    coulomb_speed: a.coulomb_speed,
                    gravity: a.gravity,
                }),
                Stops {
                    min_angle: j.min_angle,
                    max_angle: j.max_angle,
                    stiffness: j.stop_stiffness,
                    damping: j.stop_damping,
                },
            )),
            (_, _, Some(load), Some(muscle)) if !load.is_frame() => Some((
                Body::Mass(HangingMass {
                    mass: load.mass,
                    viscous: load.viscous,
                    coulomb: load.coulomb,
                    coulomb_speed: load.coulomb_speed,
                    gravity: load.gravity,
                }),
                Stops {
                    min_angle: muscle.rest_length - load.max_length,
                    max_angle: muscle.rest_length - load.min_length,
                    stiffness: load.stop_stiffness,
                    damping: load.stop_damping,
                },
            )),
            _ => None,
        };
        let (count, rest_length) =
            spec.muscle.as_ref().map_or((0.0, 1.0), |m| (f64::from(m.count), m.rest_length));
        Self { rig, values, count, rest_length, body }
    }

    /// Parameter values.
    pub fn values(&self) -> &Values<S> {
        &self.values
    }

    /// The rig.
    pub fn rig(&self) -> &Rig {
        self.rig
    }

    fn mechanics(&self, state: &State<S>, memory: &Memory<S>, step_start_contraction: S) -> Mechanics<S> {
        let dead = self.values[P::DeadVolume];
        let (Some(muscle), Some(joint)) = (&self.rig.muscle, &self.rig.joint) else {
            let zero = constant(0.0);
            return Mechanics {
                contraction: zero,
                torque_arm: zero,
                volume: dead,
                volume_rate: zero,
                muscle_volume: zero,
                force: zero,
            };
        };
        let point = joint.eval(state[ANGLE]);
        let contraction = point.shortening / self.rest_length;
        let table = muscle.table.eval(contraction);
        let gauge = state[PRESSURE] - self.rig.gas.ambient_pressure;
        let scale = self.values[P::ModulusScale];
        let mut force = table.force(gauge, scale);
        let stretched = (step_start_contraction - contraction) * self.rest_length;
        if self.rig.active.direction {
            let slip = memory.direction.moved(stretched, constant(muscle.presliding()));
            force = muscle.moving(force, contraction, gauge, scale, slip.mean());
        }
        if self.rig.active.hysteresis {
            force += muscle_hysteresis::force(
                &memory.hysteresis.moved(stretched, self.values[P::Presliding]),
                self.values[P::FrictionConstant],
                self.values[P::FrictionPressure],
                gauge,
            );
        }
        Mechanics {
            contraction,
            torque_arm: point.torque_arm,
            volume: table.volume * self.count + dead,
            volume_rate: table.volume_slope
                * point.moment_arm
                * state[RATE]
                * (self.count / self.rest_length),
            muscle_volume: table.volume,
            force: force * self.count,
        }
    }

    /// Contraction ratio at an angle [rad] (0 without a joint).
    #[inline]
    pub fn contraction(&self, angle: S) -> S {
        match &self.rig.joint {
            Some(joint) => joint.eval(angle).shortening / self.rest_length,
            None => constant(0.0),
        }
    }

    /// Memory after a step that moved the muscle between two contraction ratios.
    #[inline]
    pub fn advance_memory(&self, memory: &Memory<S>, from: S, to: S) -> Memory<S> {
        let stretched = (from - to) * self.rest_length;
        let mut memory = *memory;
        if let (true, Some(muscle)) = (self.rig.active.direction, &self.rig.muscle) {
            memory.direction = memory.direction.moved(stretched, constant(muscle.presliding()));
        }
        if self.rig.active.hysteresis {
            memory.hysteresis = memory.hysteresis.moved(stretched, self.values[P::Presliding]);
        }
        memory
    }

    /// Valve command [V] as a normalised spool position (0 without a valve).
    pub fn spool(&self, command: f64) -> S {
        match &self.rig.spec().valve {
            Some(valve) => spool_position(command, self.values[P::NullVoltage], valve.half_range),
            None => constant(0.0),
        }
    }

    /// Gas mass [kg] at rest temperature for a state.
    pub fn rest_mass(&self, state: &State<S>) -> S {
        let volume = self.mechanics(state, &Memory::default(), constant(0.0)).volume;
        state[PRESSURE] * volume / (self.rig.gas.gas_constant * self.rig.gas.temperature)
    }

    /// Gas mass [kg] of a state at the start of a recording: at rest temperature plus the initial rise.
    pub fn initial_mass(&self, state: &State<S>) -> S {
        let rest = self.rest_mass(state);
        if !self.rig.active.heat {
            return rest;
        }
        let temperature = self.rig.gas.temperature;
        rest * temperature / (self.values[P::InitialTemperatureRise] + temperature)
    }

    /// Time derivative of the state; entries of driven states are zero.
    #[inline]
    pub fn rates(
        &self,
        state: &State<S>,
        spool: S,
        memory: &Memory<S>,
        step_start_contraction: S,
        simulated: Simulated,
    ) -> State<S> {
        let zero = constant(0.0);
        let mut rates = State::<S>::from_element(zero);
        let m = self.mechanics(state, memory, step_start_contraction);
        if simulated.supply || simulated.chamber {
            self.gas_rates(state, spool, &m, simulated, &mut rates);
        }
        if let (true, Some((body, stops))) = (simulated.arm, &self.body) {
            rates[ANGLE] = state[RATE];
            let stop = stops.torque(state[ANGLE], state[RATE]);
            let torque = m.force * m.torque_arm;
            rates[RATE] = match body {
                Body::Arm(arm) => arm.acceleration(state[ANGLE], state[RATE], torque, stop),
                Body::Mass(load) => load.acceleration(state[RATE], torque, stop),
            };
        }
        rates
    }

    #[inline]
    fn gas_rates(
        &self,
        state: &State<S>,
        spool: S,
        m: &Mechanics<S>,
        simulated: Simulated,
        rates: &mut State<S>,
    ) {
        let gas = &self.rig.gas;
        let zero = constant(0.0);
        let pressure = state[PRESSURE];
        let (mut inflow, mut outflow) = (zero, zero);
        if let Some(table) = &self.rig.valve {
            let x = spool.re();
            if x > 0.0 {
                inflow =
                    gas.mass_flow(self.values[P::DischargeArea] * table.eval(spool), state[SUPPLY], pressure);
            } else if x < 0.0 {
                let area = self.values[P::DischargeArea] * table.eval(-spool);
                outflow = gas.mass_flow(area, pressure, constant(gas.ambient_pressure));
            }
        }
        let rt = gas.gas_constant * gas.temperature;
        if simulated.supply && self.rig.valve.is_some() {
            rates[SUPPLY] = -(inflow * rt) / self.values[P::SupplyVolume];
        }
        if !simulated.chamber {
            return;
        }
        if self.rig.active.leak {
            outflow += leak_muscle::mass_flow(
                gas,
                self.values[P::LeakConductance],
                self.values[P::LeakLaminarShare],
                pressure,
            );
        }
        let chamber =
            ChamberState { pressure, volume: m.volume, volume_rate: m.volume_rate, inflow, outflow };
        if self.rig.active.heat {
            let temperature = heat_transfer::temperature(gas, pressure, m.volume, state[MASS]);
            let area = if self.count > 0.0 {
                let length = (-m.contraction + 1.0) * self.rest_length;
                heat_transfer::cylinder_area(self.count, m.muscle_volume, length)
            } else {
                heat_transfer::cube_area(m.volume)
            };
            rates[PRESSURE] = heat_transfer::pressure_rate(
                gas,
                &chamber,
                temperature,
                area,
                self.values[P::HeatCoefficient],
            );
            rates[MASS] = inflow - outflow;
        } else {
            let alpha = Polytropic {
                inflow: self.values[P::AlphaIn],
                outflow: self.values[P::AlphaOut],
                volume: self.values[P::Alpha],
            };
            rates[PRESSURE] = pressure_rate(&chamber, &alpha, rt);
        }
    }

    /// Quantities that follow from a state.
    pub fn output(&self, state: &State<S>, memory: &Memory<S>) -> Output<S> {
        let here = self.contraction(state[ANGLE]);
        let m = self.mechanics(state, memory, here);
        let temperature = if self.rig.active.heat {
            heat_transfer::temperature(&self.rig.gas, state[PRESSURE], m.volume, state[MASS])
        } else {
            constant(self.rig.gas.temperature)
        };
        Output {
            contraction_ratio: m.contraction,
            volume: m.volume,
            force: m.force,
            torque: m.force * m.torque_arm,
            temperature,
        }
    }
}
