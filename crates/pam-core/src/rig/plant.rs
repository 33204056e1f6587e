//! The state equation of a rig, composed of its blocks.
//!
//! States as in [`Layout`]: absolute pressures of supplies and gases [Pa], gas masses [kg], joint angles [rad] and rates
//! [rad/s], then, where they are kept, the sums of [`super::layout::BOOKS`]. Any of them can be *driven* by a signal
//! instead of being integrated: that is where the rig is cut.

use super::body::Body;
use super::layout::{Channel, Layout, BOOK_COUNT};
use super::wiring::{Group, Node, Path, SupplyUnit};
use super::{Rig, Values};
use crate::effects::{heat_transfer, leak_muscle, muscle_hysteresis};
use crate::gas::chamber::{pressure_rate, ChamberState, Polytropic};
use crate::gas::supply::Supply;
use crate::gas::tube::Tube;
use crate::gas::valve::spool_position;
use crate::muscle::slip::{Slip, ELEMENTS};
use crate::muscle::TablePoint;
use crate::scalar::{constant, Scalar};
use crate::Result;

/// What a muscle remembers of its motion.
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

/// What is integrated; the other states are driven.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Simulated {
    /// One for each state of the layout: not integrated.
    driven: Vec<bool>,
    /// Some pressure is integrated.
    gas: bool,
    /// Some motion is integrated.
    motion: bool,
}

impl Simulated {
    /// Everything is integrated but the states of these places.
    pub fn all_but(layout: &Layout, places: &[usize]) -> Self {
        let driven: Vec<bool> = (0..layout.states()).map(|k| places.contains(&k)).collect();
        let (air, motion) = driven.split_at(layout.angle(0));
        let some = |part: &[bool]| part.iter().any(|d| !d);
        Self { gas: some(&air[..layout.mass(0)]), motion: some(motion), driven }
    }

    /// Only the states of these places are integrated.
    pub fn only(layout: &Layout, places: &[usize]) -> Self {
        let others: Vec<usize> = (0..layout.states()).filter(|k| !places.contains(k)).collect();
        Self::all_but(layout, &others)
    }
}

/// Commands over one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Controls<S> {
    /// Normalised spool position of each valve, -1 to 1.
    pub(crate) spool: Vec<S>,
    /// Set pressure of each supply [Pa, absolute].
    pub(crate) set_pressure: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Valve<S> {
    area: S,
    null: S,
}

#[derive(Debug, Clone)]
enum Line<S> {
    Orifice(S),
    Tube(Tube<S>),
}

/// A rig with the values of its parameters in a scalar type.
#[derive(Debug, Clone)]
pub struct Plant<'a, S> {
    rig: &'a Rig,
    layout: Layout,
    values: Values<S>,
    books: bool,
    supplies: Vec<Supply<S>>,
    /// Fixed volume of each gas, halves of tubes included [m3].
    fixed_volume: Vec<S>,
    alphas: Vec<Polytropic<S>>,
    valves: Vec<Valve<S>>,
    lines: Vec<Line<S>>,
    scales: Vec<S>,
    body: Body<S>,
}

/// What the equations need to write down on the way.
#[derive(Debug, Clone)]
pub struct Scratch<S> {
    volume: Vec<S>,
    volume_rate: Vec<S>,
    wall: Vec<S>,
    inflow: Vec<S>,
    outflow: Vec<S>,
    drawn: Vec<S>,
    torque: Vec<S>,
    vented: S,
    muscle_work: S,
}

/// One group at one instant.
struct Pull<S> {
    contraction: S,
    /// Of all its muscles [N].
    force: S,
    moment_arm: S,
    torque_arm: S,
    table: TablePoint<S>,
}

impl<'a, S: Scalar> Plant<'a, S> {
    /// Compose a rig with parameter values; `books` keeps the sums of [`super::layout::BOOKS`] behind the states.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for links that cannot be.
    pub fn new(rig: &'a Rig, values: Values<S>, books: bool) -> Result<Self> {
        let wiring = &rig.wiring;
        let line = |line: &super::wiring::LineUnit| match line.path {
            Path::Orifice(area) => Line::Orifice(values[area]),
            Path::Tube { length, diameter } => {
                Line::Tube(Tube::new(values[length], values[diameter], rig.gas.temperature))
            }
        };
        let lines: Vec<Line<S>> = wiring.lines.iter().map(line).collect();
        let half_volume = |line: usize| match wiring.lines[line].path {
            Path::Tube { length, diameter } => {
                values[diameter] * values[diameter] * values[length] * (std::f64::consts::PI / 8.0)
            }
            Path::Orifice(_) => constant(0.0),
        };
        let isothermal = Polytropic { inflow: constant(1.0), outflow: constant(1.0), volume: constant(1.0) };
        Ok(Self {
            layout: rig.layout,
            books,
            supplies: (wiring.supplies.iter())
                .map(|supply| match supply {
                    SupplyUnit::Tank(volume) => Supply::Tank(values[*volume]),
                    SupplyUnit::Constant => Supply::Constant,
                    SupplyUnit::Regulator { time_constant, droop } => {
                        Supply::Regulator { time_constant: values[*time_constant], droop: values[*droop] }
                    }
                })
                .collect(),
            fixed_volume: (wiring.gases.iter())
                .map(|gas| gas.tubes.iter().fold(values[gas.volume], |sum, line| sum + half_volume(*line)))
                .collect(),
            alphas: (wiring.gases.iter())
                .map(|gas| match gas.alphas {
                    Some([inflow, outflow, volume]) => Polytropic {
                        inflow: values[inflow],
                        outflow: values[outflow],
                        volume: values[volume],
                    },
                    None => isothermal,
                })
                .collect(),
            valves: (wiring.valves.iter())
                .map(|valve| Valve { area: values[valve.area], null: values[valve.null] })
                .collect(),
            lines,
            scales: wiring.groups.iter().map(|group| values[group.scale]).collect(),
            body: Body::new(&wiring.body, &wiring.coordinates, &values)?,
            rig,
            values,
        })
    }

    /// Parameter values.
    pub fn values(&self) -> &Values<S> {
        &self.values
    }

    /// The rig.
    pub fn rig(&self) -> &'a Rig {
        self.rig
    }

    /// Length of the state, books included.
    pub fn states(&self) -> usize {
        self.layout.states() + if self.books { BOOK_COUNT } else { 0 }
    }

    /// Room for the equations.
    pub fn scratch(&self) -> Scratch<S> {
        let zeros = |n: usize| vec![constant::<S>(0.0); n];
        let Layout { supplies, gases, coordinates, .. } = self.layout;
        Scratch {
            volume: zeros(gases),
            volume_rate: zeros(gases),
            wall: zeros(gases),
            inflow: zeros(gases),
            outflow: zeros(gases),
            drawn: zeros(supplies),
            torque: zeros(coordinates),
            vented: constant(0.0),
            muscle_work: constant(0.0),
        }
    }

    /// Commands [V, Pa gauge] of one sample, in the order of the rig's inputs.
    pub fn controls(&self, commands: impl Fn(usize) -> f64) -> Controls<S> {
        let wiring = &self.rig.wiring;
        let ambient = self.rig.gas.ambient_pressure;
        let valves = wiring.valves.iter().zip(&self.valves).enumerate();
        let mut regulator = wiring.valves.len();
        let spec = self.rig.spec();
        let set_pressure = wiring.supplies.iter().zip(&spec.supplies).map(|(unit, supply)| match unit {
            SupplyUnit::Regulator { .. } => {
                regulator += 1;
                commands(regulator - 1) + ambient
            }
            _ => supply.initial_pressure + ambient,
        });
        Controls {
            set_pressure: set_pressure.collect(),
            spool: valves
                .map(|(k, (unit, v))| spool_position(commands(k), v.null, unit.half_range))
                .collect(),
        }
    }

    #[inline(always)]
    fn pull(&self, k: usize, group: &Group, state: &[S], memory: &Memory<S>, start: S) -> Pull<S> {
        let point = group.joint.eval(state[self.layout.angle(group.coordinate)]);
        let contraction = point.shortening / group.rest_length;
        let table = group.muscle.table.eval(contraction);
        let gauge = state[self.layout.pressure(group.chamber)] - self.rig.gas.ambient_pressure;
        let scale = self.scales[k];
        let mut force = table.force(gauge, scale);
        let stretched = (start - contraction) * group.rest_length;
        if group.direction {
            let slip = memory.direction.moved(stretched, constant(group.muscle.presliding()));
            force = group.muscle.moving(force, contraction, gauge, scale, slip.mean());
        }
        if let (true, Some([friction, pressure, presliding])) =
            (group.hysteresis, self.rig.wiring.effects.hysteresis)
        {
            force += muscle_hysteresis::force(
                &memory.hysteresis.moved(stretched, self.values[presliding]),
                self.values[friction],
                self.values[pressure],
                gauge,
            );
        }
        Pull {
            contraction,
            force: force * group.count,
            moment_arm: point.moment_arm,
            torque_arm: point.torque_arm,
            table,
        }
    }

    /// Volumes, torques and what the muscles do, written to the scratch.
    #[inline(always)]
    fn mechanics(&self, state: &[S], memory: &[Memory<S>], start: &[S], here: &mut Scratch<S>) {
        let zero = constant::<S>(0.0);
        here.volume.copy_from_slice(&self.fixed_volume);
        here.volume_rate.fill(zero);
        here.torque.fill(zero);
        here.muscle_work = zero;
        let heat = self.rig.wiring.effects.heat.is_some();
        if heat {
            here.wall.fill(zero);
        }
        for (k, group) in self.rig.wiring.groups.iter().enumerate() {
            let pull = self.pull(k, group, state, &memory[k], start[k]);
            let rate = state[self.layout.rate(group.coordinate)];
            here.volume[group.chamber] += pull.table.volume * group.count;
            here.volume_rate[group.chamber] +=
                pull.table.volume_slope * pull.moment_arm * rate * (group.count / group.rest_length);
            here.torque[group.coordinate] += pull.force * pull.torque_arm;
            if self.books {
                here.muscle_work += pull.force * pull.moment_arm * rate;
            }
            if heat {
                let length = (-pull.contraction + 1.0) * group.rest_length;
                here.wall[group.chamber] +=
                    heat_transfer::cylinder_area(group.count, pull.table.volume, length);
            }
        }
        if heat {
            self.cubes(here);
        }
    }

    /// Wall area of the gases without muscles [m2]: the cube of their volume.
    fn cubes(&self, here: &mut Scratch<S>) {
        for (k, gas) in self.rig.wiring.gases.iter().enumerate() {
            if gas.heat && self.rig.wiring.groups.iter().all(|g| g.chamber != k) {
                here.wall[k] = heat_transfer::cube_area(here.volume[k]);
            }
        }
    }

    /// Contraction ratio of each group at a state.
    pub fn contractions(&self, state: &[S], out: &mut [S]) {
        for (out, group) in out.iter_mut().zip(&self.rig.wiring.groups) {
            *out =
                group.joint.eval(state[self.layout.angle(group.coordinate)]).shortening / group.rest_length;
        }
    }

    /// Memories after a step that moved the muscles between contraction ratios.
    pub fn advance_memory(&self, memory: &mut [Memory<S>], from: &[S], to: &[S]) {
        for (k, group) in self.rig.wiring.groups.iter().enumerate() {
            let stretched = (from[k] - to[k]) * group.rest_length;
            if group.direction {
                memory[k].direction =
                    memory[k].direction.moved(stretched, constant(group.muscle.presliding()));
            }
            if let (true, Some([.., presliding])) = (group.hysteresis, self.rig.wiring.effects.hysteresis) {
                memory[k].hysteresis = memory[k].hysteresis.moved(stretched, self.values[presliding]);
            }
        }
    }

    /// Whether any muscle remembers its motion.
    pub fn remembers(&self) -> bool {
        self.rig.wiring.groups.iter().any(|g| g.direction || g.hysteresis)
    }

    /// Mass of a gas [kg] at rest temperature for a state.
    pub fn rest_mass(&self, gas: usize, state: &[S]) -> S {
        let mut volume = self.fixed_volume[gas];
        for group in self.rig.wiring.groups.iter().filter(|g| g.chamber == gas) {
            let point = group.joint.eval(state[self.layout.angle(group.coordinate)]);
            volume += group.muscle.table.eval(point.shortening / group.rest_length).volume * group.count;
        }
        state[self.layout.pressure(gas)] * volume / (self.rig.gas.gas_constant * self.rig.gas.temperature)
    }

    /// Mass of a gas [kg] at the start of a recording: at rest temperature plus the initial rise.
    pub fn initial_mass(&self, gas: usize, state: &[S]) -> S {
        let rest = self.rest_mass(gas, state);
        match self.rig.wiring.effects.heat {
            Some([_, rise]) if self.rig.wiring.gases[gas].heat => {
                let temperature = self.rig.gas.temperature;
                rest * temperature / (self.values[rise] + temperature)
            }
            _ => rest,
        }
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
        self.mechanics(state, memory, start, here);
        if simulated.gas {
            self.flows(state, controls, here);
            self.gas_rates(state, controls, here, out);
        } else {
            out[..layout.angle(0)].fill(constant(0.0));
        }
        let (angle, rate) = (layout.angle(0), layout.rate(0));
        let end = layout.states();
        if simulated.motion && self.body.moves() {
            let (angles, rates) = state[angle..end].split_at(layout.coordinates);
            out[angle..rate].copy_from_slice(rates);
            self.body.accelerations(angles, rates, &here.torque, &mut out[rate..end]);
        } else {
            out[angle..end].fill(constant(0.0));
        }
        if self.books {
            self.book(state, here, out);
        }
        for (out, driven) in out.iter_mut().zip(&simulated.driven) {
            if *driven {
                *out = constant(0.0);
            }
        }
    }

    #[inline]
    fn pressure_at(&self, node: Node, state: &[S]) -> S {
        match node {
            Node::Ambient => constant(self.rig.gas.ambient_pressure),
            Node::Supply(k) => state[self.layout.supply(k)],
            Node::Gas(k) => state[self.layout.pressure(k)],
        }
    }

    /// Mass flows between all nodes, written to the scratch.
    #[inline(always)]
    fn flows(&self, state: &[S], controls: &Controls<S>, here: &mut Scratch<S>) {
        let zero = constant::<S>(0.0);
        let gas = &self.rig.gas;
        let ambient = constant::<S>(gas.ambient_pressure);
        here.inflow.fill(zero);
        here.outflow.fill(zero);
        here.drawn.fill(zero);
        here.vented = zero;
        for ((unit, valve), spool) in self.rig.wiring.valves.iter().zip(&self.valves).zip(&controls.spool) {
            let pressure = state[self.layout.pressure(unit.to)];
            if spool.re() > 0.0 {
                let flow = gas.mass_flow(
                    valve.area * unit.table.eval(*spool),
                    self.pressure_at(unit.from, state),
                    pressure,
                );
                here.inflow[unit.to] += flow;
                here.take(unit.from, flow);
            } else if spool.re() < 0.0 {
                let flow = gas.mass_flow(valve.area * unit.table.eval(-*spool), pressure, ambient);
                here.outflow[unit.to] += flow;
                here.vented += flow;
            }
        }
        for (unit, line) in self.rig.wiring.lines.iter().zip(&self.lines) {
            let (from, to) = (self.pressure_at(unit.from, state), self.pressure_at(unit.to, state));
            let flow = match line {
                Line::Orifice(area) => gas.mass_flow(*area, from, to),
                Line::Tube(tube) => tube.mass_flow(from, to),
            };
            // What goes against the arrow goes out of its end and into its beginning.
            let (giver, taker, flow) =
                if flow.re() >= 0.0 { (unit.from, unit.to, flow) } else { (unit.to, unit.from, -flow) };
            here.take(giver, flow);
            here.give(taker, flow);
        }
        if let Some([conductance, share]) = self.rig.wiring.effects.leak {
            for (k, _) in self.rig.wiring.gases.iter().enumerate().filter(|(_, unit)| unit.leak) {
                let pressure = state[self.layout.pressure(k)];
                let flow =
                    leak_muscle::mass_flow(gas, self.values[conductance], self.values[share], pressure);
                here.outflow[k] += flow;
                here.vented += flow;
            }
        }
    }

    #[inline(always)]
    fn gas_rates(&self, state: &[S], controls: &Controls<S>, here: &mut Scratch<S>, out: &mut [S]) {
        let (gas, layout) = (&self.rig.gas, &self.layout);
        let rt = gas.gas_constant * gas.temperature;
        for (k, supply) in self.supplies.iter().enumerate() {
            let set = controls.set_pressure[k];
            out[layout.supply(k)] = supply.pressure_rate(state[layout.supply(k)], here.drawn[k], rt, set);
        }
        for (k, unit) in self.rig.wiring.gases.iter().enumerate() {
            let chamber = ChamberState {
                pressure: state[layout.pressure(k)],
                volume: here.volume[k],
                volume_rate: here.volume_rate[k],
                inflow: here.inflow[k],
                outflow: here.outflow[k],
            };
            out[layout.mass(k)] = chamber.inflow - chamber.outflow;
            out[layout.pressure(k)] = match self.rig.wiring.effects.heat {
                Some([coefficient, _]) if unit.heat => {
                    let mass = state[layout.mass(k)];
                    let temperature = heat_transfer::temperature(gas, chamber.pressure, chamber.volume, mass);
                    let coefficient = self.values[coefficient];
                    heat_transfer::pressure_rate(gas, &chamber, temperature, here.wall[k], coefficient)
                }
                _ => pressure_rate(&chamber, &self.alphas[k], rt),
            };
        }
    }

    fn book(&self, state: &[S], here: &Scratch<S>, out: &mut [S]) {
        let (gas, layout) = (&self.rig.gas, &self.layout);
        let rt = gas.gas_constant * gas.temperature;
        let (mut drawn, mut exergy) = (constant::<S>(0.0), constant::<S>(0.0));
        for (k, flow) in here.drawn.iter().enumerate() {
            drawn += *flow;
            if flow.re() == 0.0 {
                continue; // most of the time, and the logarithm is dear
            }
            exergy += (state[layout.supply(k)] / gas.ambient_pressure).ln() * *flow * rt;
        }
        let mut work = constant::<S>(0.0);
        for (k, torque) in here.torque.iter().enumerate() {
            let power = *torque * state[layout.rate(k)];
            if power.re() > 0.0 {
                work += power;
            }
        }
        let sums = [drawn, here.vented, drawn * rt, exergy, here.muscle_work, work];
        out[layout.states()..].copy_from_slice(&sums);
    }
}

impl<S: Scalar> Scratch<S> {
    #[inline]
    fn take(&mut self, node: Node, flow: S) {
        match node {
            Node::Ambient => self.vented -= flow,
            Node::Supply(k) => self.drawn[k] += flow,
            Node::Gas(k) => self.outflow[k] += flow,
        }
    }

    #[inline]
    fn give(&mut self, node: Node, flow: S) {
        match node {
            Node::Ambient => self.vented += flow,
            Node::Supply(k) => self.drawn[k] -= flow,
            Node::Gas(k) => self.inflow[k] += flow,
        }
    }
}

impl Plant<'_, f64> {
    /// Value of each channel of the rig at a state, appended to `out`.
    pub fn observe(
        &self,
        state: &[f64],
        memory: &[Memory<f64>],
        here: &mut Scratch<f64>,
        out: &mut [Vec<f64>],
    ) {
        let (layout, wiring) = (&self.layout, &self.rig.wiring);
        let ambient = self.rig.gas.ambient_pressure;
        let mut now = vec![0.0; wiring.groups.len()];
        self.contractions(state, &mut now);
        self.mechanics(state, memory, &now, here);
        let zero = |id: Option<super::ParameterId>| id.map_or(0.0, |id| self.values[id]);
        for ((_, channel), out) in self.rig.names.channels.iter().zip(out) {
            out.push(match *channel {
                Channel::Supply(k) => state[layout.supply(k)] - ambient,
                Channel::Pressure(k) => {
                    state[layout.pressure(k)] - ambient + zero(wiring.gases[k].pressure_zero)
                }
                Channel::Angle(k) => state[layout.angle(k)] + zero(wiring.coordinates[k].zero),
                Channel::Rate(k) => state[layout.rate(k)],
                Channel::Length => wiring.groups[0].rest_length - state[layout.angle(0)],
                Channel::LengthRate => -state[layout.rate(0)],
                Channel::Contraction(k) => now[k],
                Channel::Force(k) => self.pull(k, &wiring.groups[k], state, &memory[k], now[k]).force,
                Channel::Torque(k) => here.torque[k],
                Channel::Volume(k) => here.volume[k],
                Channel::Mass(k) => state[layout.mass(k)],
                Channel::Temperature(k) if wiring.gases[k].heat => heat_transfer::temperature(
                    &self.rig.gas,
                    state[layout.pressure(k)],
                    here.volume[k],
                    state[layout.mass(k)],
                ),
                Channel::Temperature(_) => self.rig.gas.temperature,
                Channel::Book(k) => state.get(layout.book(k)).copied().unwrap_or(f64::NAN),
            });
        }
    }

    /// Choked, for each valve and then each line: what flows is faster than its narrowest place lets pressure back.
    pub fn choked(&self, state: &[f64], controls: &Controls<f64>) -> Vec<bool> {
        self.ratios(state, controls).map(|(ratio, critical)| ratio < critical).collect()
    }

    /// Pressure ratio (1 where nothing can flow) and critical ratio of each valve and line.
    pub(crate) fn ratios<'b>(
        &'b self,
        state: &'b [f64],
        controls: &'b Controls<f64>,
    ) -> impl Iterator<Item = (f64, f64)> + 'b {
        let gas = &self.rig.gas;
        let ratio = |a: f64, b: f64| a.min(b) / a.max(b).max(f64::MIN_POSITIVE);
        let valves = self.rig.wiring.valves.iter().zip(&self.valves).zip(&controls.spool);
        let valves = valves.map(move |((unit, valve), spool)| {
            let here = state[self.layout.pressure(unit.to)];
            let other = if *spool > 0.0 { self.pressure_at(unit.from, state) } else { gas.ambient_pressure };
            let open = valve.area * unit.table.eval(spool.abs()) > 0.0;
            (if open { ratio(here, other) } else { 1.0 }, gas.critical_ratio())
        });
        let lines = self.rig.wiring.lines.iter().zip(&self.lines).map(move |(unit, line)| {
            let critical = match line {
                Line::Orifice(_) => gas.critical_ratio(),
                Line::Tube(tube) => tube.critical_ratio(),
            };
            (ratio(self.pressure_at(unit.from, state), self.pressure_at(unit.to, state)), critical)
        });
        valves.chain(lines)
    }

    /// Fastest rate of the gas [1/s], and the gas that it is in (none for a supply): a bound by Gershgorin's rows, every
    /// valve open, next to equal pressures.
    pub(crate) fn fastest_gas(&self) -> (f64, Option<usize>) {
        let (wiring, gas) = (&self.rig.wiring, &self.rig.gas);
        let rt = gas.gas_constant * gas.temperature;
        let mut steepest = vec![0.0; wiring.gases.len()];
        let mut drawn = vec![0.0; wiring.supplies.len()];
        let mut add = |node: Node, other: Node, slope: f64| {
            // The other end answers with the same slope where its pressure is a state.
            let twice = if matches!(other, Node::Ambient) { slope } else { 2.0 * slope };
            match node {
                Node::Gas(k) => steepest[k] += twice,
                Node::Supply(k) => drawn[k] += twice,
                Node::Ambient => {}
            }
        };
        for (unit, valve) in wiring.valves.iter().zip(&self.valves) {
            let slope = gas.steepest(valve.area * unit.table.eval(1.0));
            add(Node::Gas(unit.to), unit.from, slope);
            add(unit.from, Node::Gas(unit.to), slope);
        }
        for (unit, line) in wiring.lines.iter().zip(&self.lines) {
            let slope = match line {
                Line::Orifice(area) => gas.steepest(*area),
                Line::Tube(tube) => tube.steepest(),
            };
            add(unit.from, unit.to, slope);
            add(unit.to, unit.from, slope);
        }
        let mut worst = (0.0, None);
        for (k, slope) in steepest.iter().enumerate() {
            let alpha = self.alphas[k].inflow.max(self.alphas[k].outflow).max(gas.gamma);
            let rate = alpha * rt * slope / self.least_volume(k);
            if rate > worst.0 {
                worst = (rate, Some(k));
            }
        }
        for (supply, slope) in self.supplies.iter().zip(&drawn) {
            let rate = supply.fastest(*slope, rt);
            if rate > worst.0 {
                worst = (rate, None);
            }
        }
        worst
    }

    /// Least volume of a gas over the range of its muscles [m3].
    fn least_volume(&self, gas: usize) -> f64 {
        let mut volume = self.fixed_volume[gas];
        for group in self.rig.wiring.groups.iter().filter(|g| g.chamber == gas) {
            let (low, high) = self.rig.range(group);
            let least = (0..=32)
                .map(|i| group.muscle.table.eval(low + (high - low) * f64::from(i) / 32.0).volume)
                .fold(f64::INFINITY, f64::min);
            volume += least.max(0.0) * group.count;
        }
        volume.max(f64::MIN_POSITIVE)
    }

    /// Fastest rate of the body [1/s].
    pub(crate) fn fastest_body(&self) -> f64 {
        self.body.fastest(&self.rig.wiring.coordinates)
    }
}
