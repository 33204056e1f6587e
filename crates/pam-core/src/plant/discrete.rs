//! Commands as the valves and regulators see them, within a step and from one step to the next, and
//! where effects begin.

use super::ports::{moves, Acting};
use super::rates::{Controls, Plant};
use super::units::SupplyUnit;
use crate::blocks::supply::Supply;
use crate::blocks::valve::spool_position;
use crate::clock::{Edge, Held};
use crate::scalar::{constant, Scalar};

impl<S: Scalar> Plant<'_, S> {
    /// Commands [V, Pa gauge] of one sample, in the order of the rig's inputs.
    pub fn controls(&self, commands: impl Fn(usize) -> f64) -> Controls<S> {
        let zeros = |n: usize| vec![constant(0.0); n];
        let (supplies, valves) = (self.wiring.supplies.len(), self.wiring.valves.len());
        let unset = vec![Edge::steady(constant(0.0)); supplies];
        let (spool, edges) = (zeros(valves), Vec::new());
        let mut out = Controls { set_pressure: unset, spool, edges, time: 0.0 };
        self.command(commands, &mut out);
        out
    }

    /// The same, written over others of this plant.
    pub fn command(&self, commands: impl Fn(usize) -> f64, out: &mut Controls<S>) {
        let wiring = &self.wiring;
        let mut regulator = wiring.valves.len();
        let supplies = wiring.supplies.iter().zip(&self.rig.spec().supplies);
        for ((unit, supply), set) in supplies.zip(&mut out.set_pressure) {
            let pressure = match unit {
                SupplyUnit::Regulator { .. } => {
                    regulator += 1;
                    commands(regulator - 1)
                }
                _ => supply.initial_pressure,
            };
            *set = Edge::steady(self.absolute(pressure));
        }
        for (k, spool) in out.spool.iter_mut().enumerate() {
            *spool = self.opened(k, self.commanded(k, commands(k)));
        }
        out.edges.clear();
        out.time = 0.0;
    }

    fn absolute(&self, gauge: f64) -> S {
        constant(gauge + self.rig.gas.ambient_pressure)
    }

    /// Normalised position that a command asks of a valve.
    fn commanded(&self, valve: usize, command: f64) -> S {
        spool_position(command, self.valves[valve].null, self.wiring.valves[valve].half_range)
    }

    /// The position that opens a valve, for the commanded one; where something on the way moves by
    /// itself it is left as it is.
    fn opened(&self, valve: usize, commanded: S) -> S {
        if self.wiring.ports.moves_valve(valve) {
            return commanded;
        }
        let path = &self.wiring.ports.command[valve];
        path.iter().fold(commanded, |x, acting| self.effect(acting).position(&[], x, 0.0))
    }

    /// Whether pressures, angles and commands are recorded by different clocks.
    pub fn skewed(&self) -> bool {
        !self.wiring.ports.clock.is_empty()
    }

    /// Whether some command acts later than it is recorded.
    pub fn delayed(&self) -> bool {
        // a dead time of zero has a slope too
        let late = self.wiring.ports.late.iter().any(|acting| !acting.is_empty());
        self.skewed() || late || self.dead_time() > 0.0
    }

    /// Whether regulators follow their commands at once, and as fast as their lag lets them.
    pub fn first_order(&self) -> bool {
        self.supplies.iter().all(Supply::first_order)
    }

    /// The longest dead time of a regulator or of a valve [s].
    pub fn dead_time(&self) -> f64 {
        let regulators = self.supplies.iter().map(|supply| supply.dead_time().re());
        let valves = (0..self.wiring.valves.len()).map(|k| self.late(k).re());
        regulators.chain(valves).fold(0.0, f64::max)
    }

    /// How late a valve sees its command [s].
    fn late(&self, valve: usize) -> S {
        let acting = self.wiring.ports.late[valve].iter();
        acting.fold(constant(0.0), |sum, acting| sum + self.effect(acting).late())
    }

    /// How late pressures and angles are recorded at a time [s]; negative where their clock is
    /// ahead.
    pub fn skew(&self, time: f64) -> (S, S) {
        let none = (constant(0.0), constant(0.0));
        self.wiring.ports.clock.iter().fold(none, |(pressures, angles), acting| {
            let (more, later) = self.effect(acting).clock(time);
            (pressures + more, angles + later)
        })
    }

    /// Commands over a step that begins at a time [s], later by a shift [s] and by the dead times of
    /// valves and regulators; `command` gives those of a sample.
    #[allow(clippy::too_many_arguments)]
    pub fn delayed_controls(
        &self,
        shift: S,
        time: f64,
        step: f64,
        sample_time: f64,
        command: impl Fn(usize, i64) -> f64,
        controls: &mut Controls<S>,
    ) {
        let wiring = &self.wiring;
        self.command(|_| 0.0, controls);
        for (k, spool) in controls.spool.iter_mut().enumerate() {
            let held = Held::over(time, step, sample_time, shift + self.late(k));
            let edge = held.edge(|sample| self.opened(k, self.commanded(k, command(k, sample))));
            *spool = if wiring.ports.switching[k].is_some() { edge.now } else { edge.mean() };
            controls.edges.push(edge);
        }
        let mut input = wiring.valves.len();
        for (supply, set) in self.supplies.iter().zip(&mut controls.set_pressure) {
            if matches!(supply, Supply::Regulator { .. }) {
                let late = shift + supply.dead_time();
                let pressure = |sample| self.absolute(command(input, sample));
                *set = Held::over(time, step, sample_time, late).edge(pressure);
                input += 1;
            }
        }
    }

    /// What an instant of a step sees of its controls: `age` after the step began at `time` [s],
    /// the state being that of the beginning.
    pub fn stage(
        &self,
        state: &[S],
        controls: &Controls<S>,
        time: f64,
        age: f64,
        out: &mut Controls<S>,
    ) {
        out.set_pressure.clone_from(&controls.set_pressure);
        out.spool.clone_from(&controls.spool);
        out.edges.clone_from(&controls.edges);
        out.time = time + age;
        let ports = &self.wiring.ports;
        for k in (0..ports.command.len()).filter(|valve| ports.moves_valve(*valve)) {
            let path = ports.command[k].iter().chain(&ports.switching[k]);
            out.spool[k] = path.fold(out.spool[k], |x, acting| {
                self.effect(acting).position(self.own(acting, state), x, age)
            });
        }
    }

    /// What effects do between steps: from one state to that a step [s] later, which they complete.
    pub fn discrete_update(
        &self,
        before: &[S],
        state: &mut [S],
        controls: &Controls<S>,
        step: f64,
    ) {
        let ports = &self.wiring.ports;
        for (k, path) in ports.command.iter().enumerate().filter(|(_, path)| moves(path)) {
            let mut position = controls.spool[k];
            for acting in path {
                let own = self.own_mut(acting, state);
                own.copy_from_slice(self.own(acting, before));
                position = self.effect(acting).follow(own, position, step);
            }
        }
        for (k, feed) in ports.feed.iter().enumerate() {
            for acting in feed.iter().filter(|acting| acting.count > 0) {
                self.switch(k, acting, before, state, step);
            }
        }
    }

    /// What fills a tank may have switched on or off in a step: its gas for the part of the step
    /// after that.
    fn switch(&self, supply: usize, acting: &Acting, before: &[S], state: &mut [S], step: f64) {
        let gas = &self.rig.gas;
        let place = self.layout.supply(supply);
        let (from, to) = (before[place], state[place]);
        let own = self.own_mut(acting, state);
        let (Some((flow, time)), Supply::Tank(volume)) =
            (self.effect(acting).switched(gas, own, from, to, step), &self.supplies[supply])
        else {
            return;
        };
        let given = flow * (time.abs() * (gas.gas_constant * gas.temperature)) / *volume;
        if time < 0.0 {
            state[place] -= given;
        } else {
            state[place] += given;
        }
    }

    /// What sensors read at the end of a step [s], written to the state; `ends` are the controls at
    /// its beginning and its end.
    pub fn read(&self, before: &[S], state: &mut [S], ends: [&Controls<S>; 2], step: f64) {
        let (wiring, layout) = (&self.wiring, &self.layout);
        self.read_taps(state, ends[1]);
        for (k, reading) in wiring.ports.reading.iter().enumerate() {
            let Some(acting) = reading else { continue };
            let place = layout.effect(acting.first);
            let (from, to) =
                (self.at_sensor(k, before, ends[0]), self.at_sensor(k, state, ends[1]));
            state[place] = self.effect(acting).read(before[place], from, to, step);
        }
        for (k, thermometer) in wiring.ports.thermometer.iter().enumerate() {
            let Some(acting) = thermometer else { continue };
            let place = layout.effect(acting.first);
            let (from, to) = (self.temperature(k, before), self.temperature(k, state));
            state[place] = self.effect(acting).read(before[place], from, to, step);
        }
    }
}
