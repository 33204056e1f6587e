//! The state equation of a rig, composed of its blocks.
//!
//! States as in [`Layout`]: absolute pressures of supplies and gases [Pa], gas masses [kg], flows in
//! tubes that carry waves [kg/s], joint angles [rad] and rates [rad/s], then what effects need and, where they are kept, the sums of
//! [`super::layout::BALANCE`]. Any of them can be *driven* by a signal instead of being integrated:
//! that is where the rig is cut.

use super::body::Body;
use super::layout::{Channel, Layout};
use super::memory::Memory;
use super::ports::{Acting, Place, Ports};
use super::units::{GasLaw, LineUnit, Node, Passes, Path, SupplyUnit, ValveUnit, WaveUnit};
use super::wired::Wiring;
use super::{Rig, Values};
use crate::blocks::chamber::Polytropic;
use crate::blocks::chamber::{cube_area, cylinder_area, gas_temperature};
use crate::blocks::gas::Gas;
use crate::blocks::supply::Supply;
use crate::blocks::tube::Tube;
use crate::blocks::valve::Opening;
use crate::blocks::wave::Wave;
use crate::clock::Edge;
use crate::effects::{Effect, Number};
use crate::scalar::{constant, Scalar};
use crate::Result;
use std::ops::Range;

/// What is integrated; the other states are driven.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Simulated {
    /// One for each state of the layout: not integrated.
    driven: Vec<bool>,
    /// The places that are integrated, neighbours together.
    runs: Vec<Range<usize>>,
    /// Some pressure is integrated.
    gas: bool,
    /// Some motion is integrated.
    motion: bool,
    /// Some state of an effect is integrated.
    effects: bool,
    /// Somebody needs the volumes of the gases: all that asks for the muscles' shape without motion.
    volumes: bool,
    /// Somebody asks what the muscles pull.
    forces: bool,
}

impl Simulated {
    /// Everything is integrated but the states of these places.
    pub fn all_but(rig: &Rig, places: &[usize]) -> Self {
        let layout = rig.layout();
        let driven: Vec<bool> = (0..layout.states()).map(|k| places.contains(&k)).collect();
        let some = |from: usize, to: usize| driven[from..to].iter().any(|d| !d);
        let end = layout.effect(0);
        let mut effects = rig.wiring.ports.integrated().filter(|(_, acting)| {
            let first = layout.effect(acting.first);
            some(first, first + acting.count)
        });
        Self {
            gas: some(0, layout.angle(0)),
            motion: some(layout.angle(0), end),
            forces: some(layout.angle(0), end),
            effects: some(end, layout.states()),
            volumes: some(layout.pressure(0), layout.angle(0))
                || effects.any(|(at, _)| matches!(at, Place::Gas(_))),
            runs: runs(&driven),
            driven,
        }
    }

    /// Only the states of these places are integrated.
    pub fn only(rig: &Rig, places: &[usize]) -> Self {
        let states = 0..rig.layout().states();
        let others: Vec<usize> = states.filter(|k| !places.contains(k)).collect();
        Self::all_but(rig, &others)
    }

    /// The same, and somebody asks what the muscles pull.
    #[must_use]
    pub fn pulling(self) -> Self {
        Self { forces: true, ..self }
    }

    /// The places that are integrated, neighbours together.
    pub fn runs(&self) -> &[Range<usize>] {
        &self.runs
    }

    /// Whether anything is moved by angles or asks for them.
    pub fn sees_angles(&self) -> bool {
        self.forces || self.volumes
    }

    /// Whether the state at a place is integrated.
    pub(crate) fn moves(&self, place: usize) -> bool {
        !self.driven[place]
    }
}

/// Neighbours that are not driven, together.
fn runs(driven: &[bool]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for place in (0..driven.len()).filter(|place| !driven[*place]) {
        match runs.last_mut().filter(|run| run.end == place) {
            Some(run) => run.end += 1,
            None => runs.push(place..place + 1),
        }
    }
    runs
}

/// Commands over one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Controls<S> {
    /// Normalised spool position of each valve, -1 to 1.
    pub(crate) spool: Vec<S>,
    /// What each valve is asked for in the step, where commands come late.
    pub(crate) edges: Vec<Edge<S>>,
    /// Set pressure of each supply.
    pub(crate) set_pressure: Vec<Edge<S>>,
    /// Time since the start [s], where an effect asks for it.
    pub(crate) time: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Valve<S> {
    /// Wide open, where it fills and where it vents.
    pub paths: [Opening<S>; 2],
    pub null: S,
}

#[derive(Debug, Clone)]
pub(crate) enum Line<S> {
    Orifice(S),
    Tube(Tube<S>),
}

impl<S: Scalar> Line<S> {
    /// Mass flow [kg/s] between two pressures [Pa, absolute], what it holds left out.
    #[inline(always)]
    pub fn mass_flow(&self, gas: &Gas, from: S, to: S) -> S {
        match self {
            Self::Orifice(area) => gas.mass_flow(*area, from, to),
            Self::Tube(tube) => tube.mass_flow(from, to),
        }
    }
}

/// A rig with the values of its parameters in a scalar type.
#[derive(Debug)]
pub struct Plant<'a, S> {
    pub(super) rig: &'a Rig,
    pub(super) wiring: &'a Wiring,
    pub(super) layout: Layout,
    pub(crate) values: Values<S>,
    balanced: bool,
    pub(crate) supplies: Vec<Supply<S>>,
    /// Fixed volume of each gas, halves of tubes included [m3].
    pub(crate) fixed_volume: Vec<S>,
    pub(crate) alphas: Vec<Polytropic<S>>,
    /// Heat transfer coefficient of each gas that has an energy balance [W/(m2 K)].
    pub(super) walls: Vec<Option<S>>,
    pub(crate) valves: Vec<Valve<S>>,
    pub(crate) lines: Vec<Line<S>>,
    pub(super) waves: Vec<Wave<S>>,
    pub(crate) scales: Vec<S>,
    pub(crate) body: Body<S>,
    /// Effects that are switched on.
    effects: Vec<Box<dyn Effect<S>>>,
    pub(super) altered: Altered,
}

/// Where effects act at all: what they do not touch costs nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Altered {
    pub supplies: bool,
    /// Some regulator has a supply in front of it.
    pub inlets: bool,
    pub areas: bool,
    pub passages: bool,
    pub flows: bool,
    /// Some line has a law of its own.
    pub laws: bool,
    /// Some tube carries waves.
    pub waves: bool,
    pub balances: bool,
    /// Some gas has an energy balance.
    pub heats: bool,
    pub muscles: bool,
    /// Something gives between a muscle and its load.
    pub gives: bool,
    pub motion: bool,
}

impl Altered {
    /// As a rig is wired, and effects are plugged into its ports.
    fn at(wiring: &Wiring) -> Self {
        let ports: &Ports = &wiring.ports;
        Self {
            heats: wiring.heated(),
            waves: !wiring.waves.is_empty(),
            supplies: ports.on_supplies(),
            inlets: wiring.inlets_of_regulators().next().is_some(),
            areas: ports.area.iter().any(Option::is_some),
            passages: ports.passage.iter().any(Option::is_some),
            flows: !ports.flows.is_empty(),
            laws: ports.law.iter().any(Option::is_some),
            balances: ports.on_balance(),
            muscles: ports.muscles.iter().any(|muscle| muscle.some),
            gives: ports.muscles.iter().any(|muscle| muscle.give.is_some()),
            motion: ports.on_motion(),
        }
    }
}

/// An input that no equation makes: what a model would need to follow a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InputPort {
    /// Torque on a joint [N m], force on a linear load [N].
    Torque(usize),
    /// Mass flow into a supply or a gas [kg/s].
    Flow(Node),
}

/// What an energy balance needs of a gas.
#[derive(Debug, Clone, Copy)]
pub(super) struct Warm<S> {
    pub temperature: S,
    pub share: S,
    pub carried: S,
    pub heat: S,
}

/// What the equations need to write down on the way.
#[derive(Debug, Clone)]
pub struct Scratch<S> {
    pub(super) volume: Vec<S>,
    /// Angles and rates that the volumes were found for, where they alone were asked for.
    seen: Vec<S>,
    pub(super) volume_rate: Vec<S>,
    pub(super) wall: Vec<S>,
    pub(super) inflow: Vec<S>,
    pub(super) outflow: Vec<S>,
    pub(super) drawn: Vec<S>,
    pub(super) torque: Vec<S>,
    pub(super) vented: S,
    /// Of each gas, where some have an energy balance: its temperature [K], the share of a flow at
    /// rest temperature that leaves it, what the flows into it carry [kg K/s], and heat from its
    /// wall [W].
    pub(super) warm: Vec<Warm<S>>,
    /// [K]
    pub(super) rest_temperature: f64,
    /// A flow that is none goes against its arrow, and not along it.
    pub(super) backwards: bool,
    pub(super) muscle_work: S,
    /// Poses, rates and torques that effects on the arm change.
    pub(super) arm: [Vec<S>; 4],
    /// Torques of the muscles on each coordinate, all counted as positive, where effects act there.
    pub(super) load: Vec<S>,
    /// What effects with states act on at a muscle, where the first of their states stands.
    pub(super) felt: Vec<S>,
    /// Contraction ratio and force of each group.
    contraction: Vec<S>,
    force: Vec<S>,
    /// Contraction ratio that each group has come to, where a muscle remembers its motion.
    now: Vec<S>,
    /// Missing input.
    pub(crate) input: Option<(InputPort, S)>,
}

/// A supply with the values of its parameters.
fn supply<S: Scalar>(unit: &SupplyUnit, values: &Values<S>) -> Supply<S> {
    match unit {
        SupplyUnit::Tank(volume) => Supply::Tank(values[*volume]),
        SupplyUnit::Constant => Supply::Constant,
        SupplyUnit::Regulator {
            time_constant,
            droop,
            rise_limit,
            fall_limit,
            dead_time,
            dead_band,
            ..
        } => Supply::Regulator {
            time_constant: values[*time_constant],
            droop: values[*droop],
            rise_limit: values[*rise_limit],
            fall_limit: values[*fall_limit],
            dead_time: values[*dead_time],
            dead_band: values[*dead_band],
        },
    }
}

/// A valve: one area for both ways, or sonic conductances and critical ratios of ISO 6358.
fn valve<S: Scalar>(unit: &ValveUnit, values: &Values<S>, temperature: f64) -> Valve<S> {
    let paths = match unit.passes {
        Passes::Area(area) => [Opening::Area(values[area]); 2],
        Passes::Conductances(paths) => paths.map(|[conductance, ratio]| {
            let (c, b) = (values[conductance], values[ratio]);
            Opening::Conductance(Tube::of_conductance(c, b, temperature))
        }),
    };
    Valve { paths, null: values[unit.null] }
}

/// The coefficients of a gas.
fn polytropic<S: Scalar>(law: GasLaw, values: &Values<S>, gamma: f64) -> Polytropic<S> {
    let alike = |alpha: S| Polytropic { inflow: alpha, outflow: alpha, volume: alpha };
    match law {
        GasLaw::Coefficients([inflow, outflow, volume]) => {
            Polytropic { inflow: values[inflow], outflow: values[outflow], volume: values[volume] }
        }
        GasLaw::Isothermal => alike(constant(1.0)),
        GasLaw::Alike(alpha) => alike(values[alpha]),
        GasLaw::Energy(_) => alike(constant(gamma)),
    }
}

impl<'a, S: Number> Plant<'a, S> {
    /// Compose a rig with parameter values; `balanced` keeps the sums of [`super::layout::BALANCE`]
    /// behind the states.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for links that cannot be.
    pub fn new(rig: &'a Rig, values: Values<S>, balanced: bool) -> Result<Self> {
        let wiring: &'a Wiring = &rig.wiring;
        let line = |line: &LineUnit| match line.path {
            Path::Orifice(area) => Line::Orifice(values[area]),
            Path::Tube { length, diameter } => {
                Line::Tube(Tube::new(values[length], values[diameter], rig.gas.temperature))
            }
        };
        let lines: Vec<Line<S>> = wiring.lines.iter().map(line).collect();
        let half_volume = |line: usize| match wiring.lines[line].path {
            Path::Tube { length, diameter } => {
                let parts = wiring.lines[line].segments.max(1) as f64;
                let share = std::f64::consts::PI / 8.0 / parts;
                values[diameter] * values[diameter] * values[length] * share
            }
            Path::Orifice(_) => constant(0.0),
        };
        let wave = |unit: &WaveUnit| {
            let [length, diameter, alpha] = [unit.length, unit.diameter, unit.alpha];
            Wave::new(values[length], values[diameter], values[alpha], unit.segments, &rig.gas)
        };
        let effects: Vec<Box<dyn Effect<S>>> = (wiring.ports.effects.iter())
            .map(|effect| {
                let own: Vec<S> = effect.parameters.iter().map(|id| values[*id]).collect();
                S::effect(&effect.form.make, &own, &rig.gas)
            })
            .collect();
        let supplied = |(unit, feed): (&SupplyUnit, &Vec<Acting>)| {
            let mut supply = supply(unit, &values);
            feed.iter().for_each(|acting| effects[acting.effect].answers(&mut supply));
            supply
        };
        let supplies = wiring.supplies.iter().zip(&wiring.ports.feed).map(supplied).collect();
        Ok(Self {
            layout: rig.layout,
            balanced,
            supplies,
            fixed_volume: (wiring.gases.iter())
                .map(|gas| {
                    let own = gas.volume.map_or(constant(0.0), |volume| values[volume]);
                    gas.tubes.iter().fold(own, |sum, line| sum + half_volume(*line))
                })
                .collect(),
            alphas: (wiring.gases.iter())
                .map(|gas| polytropic(gas.law, &values, rig.gas.gamma))
                .collect(),
            walls: (wiring.gases.iter())
                .map(|gas| match gas.law {
                    GasLaw::Energy(coefficient) => Some(values[coefficient]),
                    _ => None,
                })
                .collect(),
            valves: (wiring.valves.iter())
                .map(|unit| valve(unit, &values, rig.gas.temperature))
                .collect(),
            lines,
            waves: wiring.waves.iter().map(wave).collect(),
            scales: wiring.groups.iter().map(|group| group.elastic_scale(&values)).collect(),
            body: Body::new(&wiring.body, &wiring.coordinates, &values)?,
            altered: Altered::at(wiring),
            wiring,
            effects,
            rig,
            values,
        })
    }
}

impl<'a, S: Scalar> Plant<'a, S> {
    /// Parameter values.
    pub fn values(&self) -> &Values<S> {
        &self.values
    }

    /// What acts.
    #[inline]
    pub(super) fn effect(&self, acting: &Acting) -> &dyn Effect<S> {
        &*self.effects[acting.effect]
    }

    /// The states of what acts.
    #[inline]
    pub(super) fn own<'s>(&self, acting: &Acting, state: &'s [S]) -> &'s [S] {
        let first = self.layout.effect(acting.first);
        &state[first..first + acting.count]
    }

    /// The same, to be written.
    #[inline]
    pub(super) fn own_mut<'s>(&self, acting: &Acting, state: &'s mut [S]) -> &'s mut [S] {
        let first = self.layout.effect(acting.first);
        &mut state[first..first + acting.count]
    }

    /// The rig.
    pub fn rig(&self) -> &'a Rig {
        self.rig
    }

    /// Length of the state, the sums of the balance included.
    pub fn states(&self) -> usize {
        self.layout.states() + if self.balanced { self.layout.sums } else { 0 }
    }

    /// Room for the equations.
    pub fn scratch(&self) -> Scratch<S> {
        let zeros = |n: usize| vec![constant::<S>(0.0); n];
        let Layout { supplies, gases, coordinates, .. } = self.layout;
        Scratch {
            volume: zeros(gases),
            seen: Vec::with_capacity(2 * coordinates),
            volume_rate: zeros(gases),
            wall: zeros(gases),
            inflow: zeros(gases),
            outflow: zeros(gases),
            drawn: zeros(supplies),
            torque: zeros(coordinates),
            vented: constant(0.0),
            rest_temperature: self.rig.gas.temperature,
            warm: if self.altered.heats { vec![self.cold(); gases] } else { Vec::new() },
            backwards: false,
            muscle_work: constant(0.0),
            arm: std::array::from_fn(|_| zeros(coordinates)),
            load: zeros(coordinates),
            felt: zeros(self.wiring.ports.states),
            contraction: zeros(self.wiring.groups.len()),
            force: zeros(self.wiring.groups.len()),
            now: zeros(self.wiring.groups.len()),
            input: None,
        }
    }

    /// Volumes, and torques with what the muscles do where they are asked for, written to the
    /// scratch.
    #[inline(always)]
    fn mechanics(
        &self,
        state: &[S],
        memory: &[Memory<S>],
        start: &[S],
        forces: bool,
        here: &mut Scratch<S>,
    ) {
        let zero = constant::<S>(0.0);
        here.seen.clear();
        here.volume.copy_from_slice(&self.fixed_volume);
        here.volume_rate.fill(zero);
        here.torque.fill(zero);
        here.muscle_work = zero;
        let loads = self.altered.motion;
        if loads {
            here.load.fill(zero);
        }
        let heat = self.altered.balances || self.altered.heats;
        if heat {
            here.wall.fill(zero);
        }
        for (k, group) in self.wiring.groups.iter().enumerate() {
            let muscle = self.muscle_shape(k, group, state);
            let rate = state[self.layout.rate(group.coordinate)];
            here.volume[group.chamber] += muscle.table.volume * group.count;
            here.volume_rate[group.chamber] += muscle.table.volume_slope
                * muscle.point.moment_arm
                * rate
                * (group.count / group.rest_length);
            if forces {
                let felt = &mut here.felt;
                let force = self.muscle_force(k, group, state, &memory[k], start[k], &muscle, felt);
                (here.contraction[k], here.force[k]) = (muscle.contraction, force);
                if self.altered.gives {
                    let rate = self.give_rate(k, state, force, here);
                    here.volume_rate[group.chamber] +=
                        muscle.table.volume_slope * rate * (group.count / group.rest_length);
                    here.muscle_work += force * rate;
                }
                let torque = force * muscle.point.torque_arm;
                here.torque[group.coordinate] += torque;
                if loads {
                    here.load[group.coordinate] += torque.abs();
                }
                if self.balanced {
                    here.muscle_work += force * muscle.point.moment_arm * rate;
                }
            }
            if heat {
                let length = (-muscle.contraction + 1.0) * group.rest_length;
                here.wall[group.chamber] += cylinder_area(group.count, muscle.table.volume, length);
            }
        }
        if heat {
            self.cubes(here);
        }
    }

    /// What muscles that have not moved put on the joints, and what effects act on there, written to
    /// the scratch.
    #[inline(never)]
    pub(super) fn mechanics_at_rest(&self, state: &[S], here: &mut Scratch<S>) {
        self.mechanics_now(state, &self.fresh_memory(), here);
        here.volume_rate.fill(constant(0.0));
    }

    /// What the muscles at a joint put on it [N m], or on a linear load [N].
    pub fn pull(
        &self,
        coordinate: usize,
        state: &[S],
        memory: &[Memory<S>],
        here: &mut Scratch<S>,
    ) -> S {
        self.mechanics_now(state, memory, here);
        here.torque[coordinate]
    }

    /// Volumes, and what the muscles put on the joints, at an instant at which no step moves them.
    fn mechanics_now(&self, state: &[S], memory: &[Memory<S>], here: &mut Scratch<S>) {
        let mut now = std::mem::take(&mut here.now);
        self.contractions(state, &mut now);
        self.mechanics(state, memory, &now, true, here);
        here.now = now;
    }

    /// Wall area of the gases without muscles [m2]: the cube of their volume.
    fn cubes(&self, here: &mut Scratch<S>) {
        for (k, balance) in self.wiring.ports.balance.iter().enumerate() {
            let walled = balance.is_some() || self.walls[k].is_some();
            if walled && self.wiring.groups.iter().all(|g| g.chamber != k) {
                here.wall[k] = cube_area(here.volume[k]);
            }
        }
    }

    /// Volume of a gas [m3] for a state.
    pub(super) fn volume(&self, gas: usize, state: &[S]) -> S {
        let mut volume = self.fixed_volume[gas];
        let groups = self.wiring.groups.iter().enumerate();
        for (k, group) in groups.filter(|(_, g)| g.chamber == gas) {
            volume += self.muscle_shape(k, group, state).table.volume * group.count;
        }
        volume
    }

    /// Mass of a gas [kg] at rest temperature for a state.
    pub fn rest_mass(&self, gas: usize, state: &[S]) -> S {
        state[self.layout.pressure(gas)] * self.volume(gas, state)
            / (self.rig.gas.gas_constant * self.rig.gas.temperature)
    }

    /// Whether a gas has a temperature of its own, by an energy balance or an effect.
    pub fn warms(&self, gas: usize) -> bool {
        self.wiring.ports.balance[gas].is_some() || self.walls[gas].is_some()
    }

    /// Temperature of a gas [K] for a state; that of the room where it has none of its own.
    pub fn temperature(&self, gas: usize, state: &[S]) -> S {
        if !self.warms(gas) {
            return constant(self.rig.gas.temperature);
        }
        let (pressure, mass) = (self.layout.pressure(gas), self.layout.mass(gas));
        gas_temperature(&self.rig.gas, state[pressure], self.volume(gas, state), state[mass])
    }

    /// Mass of a gas [kg] at the start of a recording: at rest temperature plus the initial rise.
    pub fn initial_mass(&self, gas: usize, state: &[S]) -> S {
        let rest = self.rest_mass(gas, state);
        match &self.wiring.ports.balance[gas] {
            Some(acting) => self.effect(acting).initial_mass(&self.rig.gas, rest),
            None => rest,
        }
    }

    /// Whether anybody asks what the muscles pull.
    #[inline]
    pub fn pulls(&self, simulated: &Simulated) -> bool {
        simulated.forces || self.balanced || (self.altered.gives && simulated.volumes)
    }

    /// Time derivative of the state; entries of driven states are zero.
    #[inline]
    #[allow(clippy::too_many_arguments)]
    pub fn rates(
        &self,
        state: &[S],
        controls: &Controls<S>,
        memory: &[Memory<S>],
        start: &[S],
        simulated: &Simulated,
        here: &mut Scratch<S>,
        out: &mut [S],
    ) {
        let layout = &self.layout;
        let forces = self.pulls(simulated);
        if forces {
            self.mechanics(state, memory, start, true, here);
            if let Some((InputPort::Torque(k), torque)) = here.input {
                here.torque[k] += torque;
            }
        } else if simulated.volumes {
            // a signal that drives the angles gives the same in two of four stages
            let motion = &state[layout.angle(0)..layout.effect(0)];
            if here.seen.is_empty() || !motion.iter().zip(&here.seen).all(|(a, b)| a.same(b)) {
                self.mechanics(state, memory, start, false, here);
                here.seen.extend_from_slice(motion);
            }
        }
        if simulated.gas {
            if self.altered.heats {
                self.temperatures(state, simulated, here);
            }
            self.flows(state, controls, here);
            self.gas_rates(state, controls, here, out);
        } else {
            out[..layout.angle(0)].fill(constant(0.0));
        }
        let (angle, rate) = (layout.angle(0), layout.rate(0));
        let end = layout.effect(0);
        if simulated.effects {
            self.effect_rates(state, controls, simulated, here, out);
        }
        if simulated.motion && self.body.moves() {
            let (angles, rates) = state[angle..end].split_at(layout.coordinates);
            out[angle..rate].copy_from_slice(rates);
            if self.altered.motion {
                self.altered_motion(state, controls.time, here, out);
            } else {
                self.body.accelerations(angles, rates, &here.torque, &mut out[rate..end]);
            }
        } else {
            out[angle..end].fill(constant(0.0));
        }
        if self.balanced {
            self.balances(state, here, out);
        }
        for (out, driven) in out.iter_mut().zip(&simulated.driven) {
            if *driven {
                *out = constant(0.0);
            }
        }
    }

    #[inline(always)]
    fn balances(&self, state: &[S], here: &Scratch<S>, out: &mut [S]) {
        let (gas, layout) = (&self.rig.gas, &self.layout);
        let rt = gas.gas_constant * gas.temperature;
        let (mut drawn, mut exergy, mut vented) =
            (constant::<S>(0.0), constant::<S>(0.0), here.vented);
        for (k, flow) in here.drawn.iter().enumerate() {
            if flow.re() == 0.0 {
                continue; // most of the time, and the logarithm is dear
            }
            if flow.re() < 0.0 && matches!(self.supplies[k], Supply::Regulator { .. }) {
                vented -= *flow; // a regulator relieves to the ambient what it takes back
                continue;
            }
            if self.wiring.supplies[k].inlet().is_some() {
                continue; // the supply in front of it gives that, and counts it
            }
            drawn += *flow;
            exergy += (state[layout.supply(k)] / gas.ambient_pressure).ln() * *flow * rt;
        }
        let mut work = constant::<S>(0.0);
        for (k, torque) in here.torque.iter().enumerate() {
            let power = *torque * state[layout.rate(k)];
            if power.re() > 0.0 {
                work += power;
            }
        }
        let sums = [drawn, vented, drawn * rt, exergy, here.muscle_work, work];
        out[layout.states()..layout.balance(sums.len())].copy_from_slice(&sums);
        if self.altered.heats {
            let sums = self.heat_sums(state, here);
            out[layout.balance(layout.sums - sums.len())..].copy_from_slice(&sums);
        }
    }
}

impl Plant<'_, f64> {
    /// Value of each channel of the rig at a state and a time [s], appended to `out`.
    pub fn observe(
        &self,
        state: &[f64],
        time: f64,
        memory: &[Memory<f64>],
        here: &mut Scratch<f64>,
        out: &mut [Vec<f64>],
    ) {
        if out.is_empty() {
            return; // nobody looks
        }
        let (layout, wiring) = (&self.layout, &self.wiring);
        let ambient = self.rig.gas.ambient_pressure;
        let mut now = std::mem::take(&mut here.now);
        if self.remembers() {
            self.contractions(state, &mut now);
        }
        self.mechanics(state, memory, &now, true, here);
        let zero = |id: Option<super::ParameterId>| id.map_or(0.0, |id| self.values[id]);
        for ((_, channel), out) in self.rig.names.channels.iter().zip(out) {
            out.push(match *channel {
                Channel::Supply(k) => {
                    state[layout.supply(k)] - ambient + self.values[wiring.supply_zeros[k]]
                }
                Channel::Pressure(k) => {
                    state[self.reading(k)] - ambient
                        + zero(wiring.gases[k].pressure_zero)
                        + self.gauge_drift(k, time).unwrap_or(0.0)
                }
                Channel::Angle(k) => {
                    self.read_angle(k, state[layout.angle(k)]) + zero(wiring.coordinates[k].zero)
                }
                Channel::Rate(k) => {
                    let gain = self.encoder_gain(k, state[layout.angle(k)]);
                    state[layout.rate(k)] * gain
                }
                Channel::Length => {
                    wiring.groups[0].rest_length - state[layout.angle(0)]
                        + zero(wiring.coordinates[0].zero)
                }
                Channel::LengthRate => -state[layout.rate(0)],
                Channel::Contraction(k) => here.contraction[k],
                // a load cell reads what all muscles on a load pull
                Channel::Force(0) if self.rig.spec().load.is_some() => {
                    self.at_cell(here.force[0], time)
                }
                Channel::Force(k) => self.at_gain(here.force[k]),
                Channel::Torque(k) => self.at_cell(here.torque[k], time),
                Channel::Volume(k) => here.volume[k],
                Channel::Mass(k) => state[layout.mass(k)],
                Channel::Flow(k) => state[layout.flow(k)],
                Channel::Temperature(k) if wiring.ports.thermometer[k].is_some() => {
                    state[self.thermometer(k).map_or(0, |(place, _)| place)]
                }
                Channel::Temperature(k) if self.warms(k) => gas_temperature(
                    &self.rig.gas,
                    state[layout.pressure(k)],
                    here.volume[k],
                    state[layout.mass(k)],
                ),
                Channel::Temperature(_) => self.rig.gas.temperature,
                Channel::Balance(k) => state.get(layout.balance(k)).copied().unwrap_or(f64::NAN),
            });
        }
        here.now = now;
    }
}
