//! Commands as the valves and regulators see them, within a step and from one step to the next, and where effects begin.

use super::rates::{Controls, Plant};
use super::units::SupplyUnit;
use crate::blocks::supply::Supply;
use crate::blocks::valve::spool_position;
use crate::effects::{
    clock_skew, compressor_cut_in, input_path_lag, pressure_lag, valve_dead_zone, valve_hysteresis,
};
use crate::scalar::{constant, Scalar};

/// What has begun.
const BEGUN: f64 = 1.0;

impl<S: Scalar> Plant<'_, S> {
    /// Commands [V, Pa gauge] of one sample, in the order of the rig's inputs.
    pub fn controls(&self, commands: impl Fn(usize) -> f64) -> Controls<S> {
        let wiring = &self.rig.wiring;
        let mut regulator = wiring.valves.len();
        let spec = self.rig.spec();
        let set_pressure = wiring.supplies.iter().zip(&spec.supplies).map(|(unit, supply)| match unit {
            SupplyUnit::Regulator { .. } => {
                regulator += 1;
                self.set_pressure(commands(regulator - 1))
            }
            _ => self.set_pressure(supply.initial_pressure),
        });
        let set_pressure = set_pressure.collect();
        let spool = (0..wiring.valves.len()).map(|k| self.opened(k, self.commanded(k, commands(k))));
        Controls { set_pressure, spool: spool.collect(), time: 0.0 }
    }

    fn set_pressure(&self, gauge: f64) -> S {
        constant(gauge + self.rig.gas.ambient_pressure)
    }

    /// Normalised position that a command asks of a valve.
    fn commanded(&self, valve: usize, command: f64) -> S {
        spool_position(command, self.valves[valve].null, self.rig.wiring.valves[valve].half_range)
    }

    /// The position that opens a valve, for that of its spool; one that has still to move is left as it is.
    fn opened(&self, valve: usize, spool: S) -> S {
        let here = &self.rig.wiring.valves[valve].effects;
        match self.rig.wiring.effects.dead_zone {
            Some([half_width]) if here.dead_zone && here.spool.is_none() => {
                valve_dead_zone::effective(spool, self.values[half_width])
            }
            _ => spool,
        }
    }

    /// Whether commands act later than they are recorded.
    pub fn skewed(&self) -> bool {
        self.rig.wiring.effects.clock.is_some()
    }

    /// How late pressures and angles are recorded at a time [s]; negative where their clock is ahead.
    pub fn skew(&self, time: f64) -> (S, S) {
        let clock = self.rig.wiring.effects.clock;
        clock.map_or((constant(0.0), constant(0.0)), |[offset, rate, share]| {
            let shift = clock_skew::shift(self.values[offset], self.values[rate], time);
            (shift, shift * self.values[share])
        })
    }

    /// Commands over a step that begins at a time [s], later by a shift [s]; `command` gives those of a sample.
    pub fn skewed_controls(
        &self,
        shift: S,
        time: f64,
        step: f64,
        sample_time: f64,
        command: impl Fn(usize, i64) -> f64,
    ) -> Controls<S> {
        let wiring = &self.rig.wiring;
        let mut controls = self.controls(|_| 0.0);
        for (k, spool) in controls.spool.iter_mut().enumerate() {
            let position = |sample| self.commanded(k, command(k, sample));
            let mean = clock_skew::held_mean(position, time, step, sample_time, shift);
            *spool = self.opened(k, mean);
        }
        let mut input = wiring.valves.len();
        for (unit, set) in wiring.supplies.iter().zip(&mut controls.set_pressure) {
            if matches!(unit, SupplyUnit::Regulator { .. }) {
                let pressure = |sample| self.set_pressure(command(input, sample));
                *set = clock_skew::held_mean(pressure, time, step, sample_time, shift);
                input += 1;
            }
        }
        controls
    }

    /// What an instant of a step sees of its controls: `age` after the step began at `time` [s], the state being that of the
    /// beginning.
    pub fn stage(&self, state: &[S], controls: &Controls<S>, time: f64, age: f64, out: &mut Controls<S>) {
        out.set_pressure.clone_from(&controls.set_pressure);
        out.spool.clone_from(&controls.spool);
        out.time = time + age;
        if !self.rig.wiring.effects.moves_spools() {
            return;
        }
        for (k, spool) in out.spool.iter_mut().enumerate() {
            if let Some(moved) = self.spool_path(k, state, *spool, age) {
                let here = &self.rig.wiring.valves[k].effects;
                *spool = match self.rig.wiring.effects.dead_zone {
                    Some([half_width]) if here.dead_zone => {
                        valve_dead_zone::effective(moved.1, self.values[half_width])
                    }
                    _ => moved.1,
                };
            }
        }
    }

    /// Path and spool of a valve after a time [s] with a held command; None for a valve without.
    fn spool_path(
        &self,
        valve: usize,
        state: &[S],
        input: S,
        age: f64,
    ) -> Option<(input_path_lag::Chain<S>, S)> {
        let (units, here) = (&self.rig.wiring.effects, &self.rig.wiring.valves[valve].effects);
        let first = self.layout.extra(here.spool?);
        if state[first].re() != BEGUN {
            return Some(([input; 4], input)); // at rest where the first command puts it
        }
        let was = std::array::from_fn(|i| state[first + 1 + i]);
        let chain = match units.path {
            Some([lag, delay]) if here.path => {
                input_path_lag::moved(&was, input, self.values[lag], self.values[delay], age)
            }
            _ => [input; 4],
        };
        let spool = match units.play {
            Some([half_width]) if here.play => {
                valve_hysteresis::followed(state[first + 5], chain[3], self.values[half_width])
            }
            _ => chain[3],
        };
        Some((chain, spool))
    }

    /// What effects do between steps: from one state to that a step [s] later, which they complete.
    pub fn between_steps(&self, before: &[S], state: &mut [S], controls: &Controls<S>, step: f64) {
        let (wiring, layout) = (&self.rig.wiring, &self.layout);
        for (k, valve) in wiring.valves.iter().enumerate() {
            let Some(first) = valve.effects.spool else { continue };
            if let Some((chain, spool)) = self.spool_path(k, before, controls.spool[k], step) {
                let first = layout.extra(first);
                state[first] = constant(BEGUN);
                state[first + 1..first + 5].copy_from_slice(&chain);
                state[first + 5] = spool;
            }
        }
        if let Some(ids) = wiring.effects.compressor {
            self.compressors(ids.map(|id| self.values[id]), before, state, step);
        }
    }

    /// What sensors read at the end of a step [s], written to the state; `ends` are the controls at its beginning and its end.
    pub fn read(&self, before: &[S], state: &mut [S], ends: [&Controls<S>; 2], step: f64) {
        let (wiring, layout) = (&self.rig.wiring, &self.layout);
        self.read_taps(state, ends[1]);
        if let Some([time_constant]) = wiring.effects.pressure_lag {
            for (k, gas) in wiring.gases.iter().enumerate() {
                let Some(reading) = gas.lag.map(|lag| layout.extra(lag)) else { continue };
                let (from, to) = (self.at_sensor(k, before, ends[0]), self.at_sensor(k, state, ends[1]));
                let time_constant = self.values[time_constant];
                state[reading] = pressure_lag::read(before[reading], from, to, time_constant, step);
            }
        }
    }

    fn compressors(&self, [delivery, cut_in, cut_out]: [S; 3], before: &[S], state: &mut [S], step: f64) {
        let gas = &self.rig.gas;
        let rt = gas.gas_constant * gas.temperature;
        let ambient = gas.ambient_pressure;
        for (k, here) in self.rig.wiring.supply_effects.iter().enumerate() {
            let (Some(relay), Supply::Tank(volume)) = (here.compressor, &self.supplies[k]) else { continue };
            let (relay, place) = (self.layout.extra(relay), self.layout.supply(k));
            let running = before[relay].re() == BEGUN;
            let (from, to) = (before[place], state[place]);
            let turned = compressor_cut_in::turned(running, from, to, cut_in + ambient, cut_out + ambient);
            let Some(left) = turned else { continue };
            let given = compressor_cut_in::mass_flow(delivery) * left * (step * rt) / *volume;
            if running {
                state[place] -= given;
                state[relay] = constant(0.0);
            } else {
                state[place] += given;
                state[relay] = constant(BEGUN);
            }
        }
    }

    /// What effects need, where a recording begins.
    pub fn start_effects(&self, state: &mut [S]) {
        let (wiring, layout) = (&self.rig.wiring, &self.layout);
        if layout.extras == 0 {
            return;
        }
        self.settle_dampers(state);
        self.settle_arm(state);
        self.settle_closures(state);
        for (k, gas) in wiring.gases.iter().enumerate() {
            for place in gas.lag.into_iter().chain(gas.tap.map(|(_, place)| place)) {
                state[layout.extra(place)] = state[layout.pressure(k)];
            }
        }
        if let Some([_, cut_in, _]) = wiring.effects.compressor {
            for (k, here) in wiring.supply_effects.iter().enumerate() {
                let Some(relay) = here.compressor else { continue };
                let low =
                    state[layout.supply(k)].re() - self.rig.gas.ambient_pressure < self.values[cut_in].re();
                state[layout.extra(relay)] = constant(if low { BEGUN } else { 0.0 });
            }
        }
    }
}
