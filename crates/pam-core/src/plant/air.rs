//! Flows between the nodes of a rig, what they do to the pressures, and how fast.

use super::rates::{Controls, Line, Plant, Scratch};
use super::units::Node;
use crate::blocks::chamber::{pressure_rate, ChamberState};
use crate::effects::{
    compressor_cut_in, heat_transfer, leak_muscle, supply_leak, supply_regulator_deadband,
    tube_flow_restriction, valve_centre_leakage,
};
use crate::scalar::{constant, Scalar};

impl<S: Scalar> Plant<'_, S> {
    #[inline]
    pub(super) fn pressure_at(&self, node: Node, state: &[S]) -> S {
        match node {
            Node::Ambient => constant(self.rig.gas.ambient_pressure),
            Node::Supply(k) => state[self.layout.supply(k)],
            Node::Gas(k) => state[self.layout.pressure(k)],
        }
    }

    /// Mass flows between all nodes, written to the scratch.
    #[inline(always)]
    pub(super) fn flows(&self, state: &[S], controls: &Controls<S>, here: &mut Scratch<S>) {
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
                let area = valve.area * unit.table.eval(*spool);
                let upstream = self.pressure_at(unit.from, state);
                let flow = match &self.restriction {
                    Some(tube) if unit.effects.restriction => {
                        tube_flow_restriction::mass_flow(gas, area, tube, upstream, pressure, false)
                    }
                    _ => gas.mass_flow(area, upstream, pressure),
                };
                here.pass(unit.from, Node::Gas(unit.to), flow);
            } else if spool.re() < 0.0 {
                let area = valve.area * unit.table.eval(-*spool);
                let flow = match &self.restriction {
                    Some(tube) if unit.effects.restriction => {
                        tube_flow_restriction::mass_flow(gas, area, tube, pressure, ambient, true)
                    }
                    _ => gas.mass_flow(area, pressure, ambient),
                };
                here.pass(Node::Gas(unit.to), Node::Ambient, flow);
            }
        }
        for (unit, line) in self.rig.wiring.lines.iter().zip(&self.lines) {
            let (from, to) = (self.pressure_at(unit.from, state), self.pressure_at(unit.to, state));
            let flow = match line {
                Line::Orifice(area) => gas.mass_flow(*area, from, to),
                Line::Tube(tube) => tube.mass_flow(from, to),
            };
            here.pass(unit.from, unit.to, flow);
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
        if let Some([conductance, opening]) = self.rig.wiring.effects.centre_leak {
            self.centre_leaks(self.values[conductance], self.values[opening], state, controls, here);
        }
        if let Some([conductance]) = self.rig.wiring.effects.supply_leak {
            for (k, _) in self.rig.wiring.supply_effects.iter().enumerate().filter(|(_, unit)| unit.leak) {
                let pressure = state[self.layout.supply(k)];
                let flow = supply_leak::mass_flow(gas, self.values[conductance], pressure);
                here.drawn[k] += flow;
                here.vented += flow;
            }
        }
        if self.rig.wiring.effects.closes_air() {
            self.closing_flows(state, controls, here);
        }
    }

    /// Flows around the null of the valves, from the supply and to the ambient.
    #[inline(never)]
    fn centre_leaks(
        &self,
        conductance: S,
        opening: S,
        state: &[S],
        controls: &Controls<S>,
        here: &mut Scratch<S>,
    ) {
        let gas = &self.rig.gas;
        for (unit, spool) in self.rig.wiring.valves.iter().zip(&controls.spool) {
            if !unit.effects.centre_leak {
                continue;
            }
            let area = valve_centre_leakage::area(gas, conductance, opening, *spool);
            for (from, to) in [(unit.from, Node::Gas(unit.to)), (Node::Gas(unit.to), Node::Ambient)] {
                let flow = gas.mass_flow(area, self.pressure_at(from, state), self.pressure_at(to, state));
                if flow.re() >= 0.0 {
                    here.take(from, flow);
                    here.give(to, flow);
                } else {
                    here.take(to, -flow);
                    here.give(from, -flow);
                }
            }
        }
    }

    /// Rate of a supply's pressure with the effects on it [Pa/s].
    #[inline(never)]
    fn altered_supply(&self, k: usize, state: &[S], drawn: S, rt: f64, set: S) -> S {
        let (units, here) = (&self.rig.wiring.effects, &self.rig.wiring.supply_effects[k]);
        let pressure = state[self.layout.supply(k)];
        match (units.dead_band, units.compressor, here.compressor) {
            (Some([dead_band]), ..) if here.dead_band => {
                let error = set - pressure;
                let ignored = error - supply_regulator_deadband::answered(error, self.values[dead_band]);
                self.supplies[k].pressure_rate(pressure, drawn, rt, set - ignored)
            }
            (_, Some([delivery, ..]), Some(relay)) if state[self.layout.extra(relay)].re() > 0.5 => {
                let given = compressor_cut_in::mass_flow(self.values[delivery]);
                self.supplies[k].pressure_rate(pressure, drawn - given, rt, set)
            }
            _ => self.supplies[k].pressure_rate(pressure, drawn, rt, set),
        }
    }

    #[inline(always)]
    pub(super) fn gas_rates(
        &self,
        state: &[S],
        controls: &Controls<S>,
        here: &mut Scratch<S>,
        out: &mut [S],
    ) {
        let (gas, layout) = (&self.rig.gas, &self.layout);
        let rt = gas.gas_constant * gas.temperature;
        for (k, supply) in self.supplies.iter().enumerate() {
            let set = controls.set_pressure[k];
            out[layout.supply(k)] = if self.supplies_altered {
                self.altered_supply(k, state, here.drawn[k], rt, set)
            } else {
                supply.pressure_rate(state[layout.supply(k)], here.drawn[k], rt, set)
            };
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
                Some([coefficient, _, share]) if unit.heat => {
                    let mass = state[layout.mass(k)];
                    let temperature = heat_transfer::temperature(gas, chamber.pressure, chamber.volume, mass);
                    let coefficient = self.values[coefficient];
                    let balance =
                        heat_transfer::pressure_rate(gas, &chamber, temperature, here.wall[k], coefficient);
                    let rest = (-self.values[share] + 1.0)
                        * (pressure_rate(&chamber, &self.alphas[k], rt) - balance);
                    // The temperature follows the balance, whatever the pressure does.
                    out[layout.mass(k)] += mass * rest / chamber.pressure;
                    balance + rest
                }
                _ => pressure_rate(&chamber, &self.alphas[k], rt),
            };
        }
    }
}

impl<S: Scalar> Scratch<S> {
    /// A mass flow along the arrow; what goes against it goes out of its end and into its beginning.
    #[inline]
    pub(super) fn pass(&mut self, from: Node, to: Node, flow: S) {
        let (giver, taker, flow) = if flow.re() >= 0.0 { (from, to, flow) } else { (to, from, -flow) };
        self.take(giver, flow);
        self.give(taker, flow);
    }

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
        if let Some([conductance, _]) = wiring.effects.centre_leak {
            let slope = gas.steepest(gas.area_of_conductance(self.values[conductance]));
            for unit in wiring.valves.iter().filter(|unit| unit.effects.centre_leak) {
                add(Node::Gas(unit.to), unit.from, slope);
                add(unit.from, Node::Gas(unit.to), slope);
                add(Node::Gas(unit.to), Node::Ambient, slope);
            }
        }
        let mut worst = (self.closure_air_memory(), None);
        for (k, slope) in steepest.iter().enumerate() {
            let alpha = self.alphas[k].inflow.max(self.alphas[k].outflow).max(gas.gamma);
            let (volume, wall) = self.least_volume(k);
            let leak = self.steepest_leak(k) + self.steepest_closure(k);
            let rate = alpha * rt * (slope + leak) / volume + self.wall_rate(k, volume, wall);
            if rate > worst.0 {
                worst = (rate, Some(k));
            }
        }
        for (k, (supply, slope)) in self.supplies.iter().zip(&drawn).enumerate() {
            let rate = supply.fastest(*slope + self.steepest_supply(k), rt);
            if rate > worst.0 {
                worst = (rate, None);
            }
        }
        worst
    }

    /// Largest change of a gas's leak per pressure [kg/(s Pa)].
    fn steepest_leak(&self, gas: usize) -> f64 {
        let (wiring, air) = (&self.rig.wiring, &self.rig.gas);
        match wiring.effects.leak {
            Some([conductance, share]) if wiring.gases[gas].leak => {
                let (conductance, share) = (self.values[conductance], self.values[share]);
                let area = air.area_of_conductance(conductance);
                let high = self.rig.highest_pressure();
                let laminar = 2.0 * air.choked_flow(area, high) / leak_muscle::REFERENCE_PRESSURE;
                (1.0 - share) * air.steepest(area) + share * laminar
            }
            _ => 0.0,
        }
    }

    /// Rate at which a gas takes the temperature of its wall [1/s], with the least of it: at ambient pressure.
    fn wall_rate(&self, gas: usize, volume: f64, wall: f64) -> f64 {
        let (wiring, air) = (&self.rig.wiring, &self.rig.gas);
        match wiring.effects.heat {
            Some([coefficient, ..]) if wiring.gases[gas].heat => {
                (air.gamma - 1.0) * self.values[coefficient] * wall * air.temperature
                    / (air.ambient_pressure * volume)
            }
            _ => 0.0,
        }
    }

    /// Least volume of a gas over the range of its muscles [m3], with the largest wall [m2].
    fn least_volume(&self, gas: usize) -> (f64, f64) {
        let (mut volume, mut wall) = (self.fixed_volume[gas], 0.0);
        for group in self.rig.wiring.groups.iter().filter(|g| g.chamber == gas) {
            let (low, high) = self.rig.range(group);
            let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
            for i in 0..=32 {
                let contraction = low + (high - low) * f64::from(i) / 32.0;
                let here = group.muscle.table.eval(contraction).volume.max(0.0);
                least = least.min(here);
                let length = (1.0 - contraction) * group.rest_length;
                most = most.max(heat_transfer::cylinder_area(group.count, here, length));
            }
            volume += least * group.count;
            wall += most;
        }
        let volume = volume.max(f64::MIN_POSITIVE);
        (volume, if wall > 0.0 { wall } else { heat_transfer::cube_area(volume) })
    }
}
