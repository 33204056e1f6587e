//! Closures where they act: what each sees of its block, and what it does there.

use super::rates::{Controls, Plant, Scratch};
use super::units::Node;
use crate::effects::{closure_flow, closure_supply, closure_torque};
use crate::scalar::{constant, Scalar};

/// One bar [Pa].
const BAR: f64 = 1e5;
/// One litre [m3].
const LITRE: f64 = 1e-3;

impl<S: Scalar> Plant<'_, S> {
    /// What the closure of a joint sees; None where there is none.
    fn at_joint(&self, coordinate: usize, state: &[S]) -> Option<closure_torque::Here<S>> {
        let (layout, wiring) = (&self.layout, &self.rig.wiring);
        let memory = layout.extra(wiring.coordinates[coordinate].effects.closure?);
        let mut pressure = constant::<S>(0.0);
        let mut groups = 0.0;
        for group in wiring.groups.iter().filter(|g| g.coordinate == coordinate) {
            pressure += (state[layout.pressure(group.chamber)] - self.rig.gas.ambient_pressure) / BAR;
            groups += 1.0;
        }
        Some(closure_torque::Here {
            pressure: if groups > 1.0 { pressure / groups } else { pressure },
            angle: state[layout.angle(coordinate)],
            rate: state[layout.rate(coordinate)],
            memory: std::array::from_fn(|k| state[memory + k]),
        })
    }

    /// What the closure of a chamber sees; None where there is none.
    fn at_chamber(
        &self,
        gas: usize,
        state: &[S],
        controls: &Controls<S>,
        here: &Scratch<S>,
    ) -> Option<closure_flow::Here<S>> {
        let (layout, wiring) = (&self.layout, &self.rig.wiring);
        let memory = layout.extra(wiring.gases[gas].closure?);
        let pressure = state[layout.pressure(gas)] / BAR;
        let (mut opening, mut supply) = (constant::<S>(0.0), pressure);
        for (unit, spool) in wiring.valves.iter().zip(&controls.spool) {
            // Through the line that begins at the valve, if there is one.
            let end = unit.to.checked_sub(wiring.chambers).and_then(|k| wiring.inlets.get(k));
            if unit.to == gas || end.is_some_and(|(_, end)| *end == Node::Gas(gas)) {
                opening += *spool;
                supply = unit.from.place(layout).map_or(supply, |place| state[place] / BAR);
            }
        }
        let memory = [state[memory], state[memory + 1]];
        let volume_rate = here.volume_rate[gas] / LITRE;
        Some(closure_flow::Here { pressure, supply, opening, volume_rate, memory })
    }

    /// What the closure of a supply sees; None where there is none.
    fn at_supply(
        &self,
        supply: usize,
        state: &[S],
        controls: &Controls<S>,
    ) -> Option<closure_supply::Here<S>> {
        let (layout, wiring) = (&self.layout, &self.rig.wiring);
        let memory = state[layout.extra(wiring.supply_effects[supply].closure?)];
        let mut opening = constant::<S>(0.0);
        for (_, spool) in
            wiring.valves.iter().zip(&controls.spool).filter(|(v, _)| v.from == Node::Supply(supply))
        {
            if spool.re() > 0.0 {
                opening += *spool;
            }
        }
        Some(closure_supply::Here { pressure: state[layout.supply(supply)] / BAR, opening, memory })
    }

    /// Torque of the closure of a joint [N m].
    #[inline(never)]
    pub(super) fn closing_torque(&self, coordinate: usize, state: &[S]) -> S {
        match (self.rig.wiring.effects.closure_torque, self.at_joint(coordinate, state)) {
            (Some(ids), Some(here)) => here.torque(&ids.map(|id| self.values[id])),
            _ => constant(0.0),
        }
    }

    /// Flows of the closures of chambers and supplies, written to the scratch.
    #[inline(never)]
    pub(super) fn closing_flows(&self, state: &[S], controls: &Controls<S>, here: &mut Scratch<S>) {
        let (wiring, ambient) = (&self.rig.wiring, Node::Ambient);
        if let Some(ids) = wiring.effects.closure_flow {
            for gas in 0..wiring.chambers {
                let Some(seen) = self.at_chamber(gas, state, controls, here) else { continue };
                here.pass(ambient, Node::Gas(gas), seen.mass_flow(&ids.map(|id| self.values[id])));
            }
        }
        if let Some(ids) = wiring.effects.closure_supply {
            for supply in 0..wiring.supplies.len() {
                let Some(seen) = self.at_supply(supply, state, controls) else { continue };
                here.pass(ambient, Node::Supply(supply), seen.mass_flow(&ids.map(|id| self.values[id])));
            }
        }
    }

    /// Rates of what closures remember.
    #[inline(never)]
    pub(super) fn closure_rates(
        &self,
        state: &[S],
        controls: &Controls<S>,
        here: &Scratch<S>,
        out: &mut [S],
    ) {
        let (layout, wiring) = (&self.layout, &self.rig.wiring);
        if let Some([.., time, angle]) = wiring.effects.closure_torque {
            for (k, coordinate) in wiring.coordinates.iter().enumerate() {
                let (Some(place), Some(seen)) = (coordinate.effects.closure, self.at_joint(k, state)) else {
                    continue;
                };
                let place = layout.extra(place);
                out[place..place + closure_torque::STATES]
                    .copy_from_slice(&seen.rates(self.values[time], self.values[angle]));
            }
        }
        if let Some([.., time]) = wiring.effects.closure_flow {
            for (k, gas) in wiring.gases.iter().enumerate() {
                let (Some(place), Some(seen)) = (gas.closure, self.at_chamber(k, state, controls, here))
                else {
                    continue;
                };
                let place = layout.extra(place);
                out[place..place + closure_flow::STATES].copy_from_slice(&seen.rates(self.values[time]));
            }
        }
        if let Some([.., time]) = wiring.effects.closure_supply {
            for (k, supply) in wiring.supply_effects.iter().enumerate() {
                if let (Some(place), Some(seen)) = (supply.closure, self.at_supply(k, state, controls)) {
                    out[layout.extra(place)] = seen.rate(self.values[time]);
                }
            }
        }
    }

    /// Where a recording begins nothing has moved for long: what is remembered is what is, valves shut, no slip.
    pub(super) fn settle_closures(&self, state: &mut [S]) {
        let (layout, wiring) = (&self.layout, &self.rig.wiring);
        for k in 0..wiring.coordinates.len() {
            let (Some(place), Some(seen)) = (wiring.coordinates[k].effects.closure, self.at_joint(k, state))
            else {
                continue;
            };
            let place = layout.extra(place);
            (state[place], state[place + 1], state[place + 2]) = (seen.angle, seen.pressure, constant(0.0));
        }
        for (k, gas) in wiring.gases.iter().enumerate() {
            if let Some(place) = gas.closure.map(|place| layout.extra(place)) {
                (state[place], state[place + 1]) = (state[layout.pressure(k)] / BAR, constant(0.0));
            }
        }
        for (k, supply) in wiring.supply_effects.iter().enumerate() {
            if let Some(place) = supply.closure {
                state[layout.extra(place)] = state[layout.supply(k)] / BAR;
            }
        }
    }

    /// Terms of the closure of a joint, a chamber or a supply at an instant; empty where there is none.
    pub(crate) fn closure_terms(
        &self,
        node: ClosureAt,
        state: &[S],
        controls: &Controls<S>,
        here: &Scratch<S>,
    ) -> Vec<S> {
        match node {
            ClosureAt::Joint(k) => self.at_joint(k, state).map_or(vec![], |seen| seen.terms().to_vec()),
            ClosureAt::Chamber(k) => {
                self.at_chamber(k, state, controls, here).map_or(vec![], |seen| seen.terms().to_vec())
            }
            ClosureAt::Supply(k) => {
                self.at_supply(k, state, controls).map_or(vec![], |seen| seen.terms().to_vec())
            }
        }
    }
}

/// Where a closure acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ClosureAt {
    /// A joint.
    Joint(usize),
    /// A chamber.
    Chamber(usize),
    /// A supply.
    Supply(usize),
}

impl Plant<'_, f64> {
    /// Damping and stiffness that the closure adds to a coordinate at most, and the fastest rate of what it remembers [1/s].
    pub(super) fn closure_resistance(&self, coordinate: usize) -> (f64, f64) {
        let wiring = &self.rig.wiring;
        let own = &wiring.coordinates[coordinate];
        let (Some(ids), Some(_)) = (wiring.effects.closure_torque, own.effects.closure) else {
            return (0.0, 0.0);
        };
        let pressure = (self.rig.highest_pressure() - self.rig.gas.ambient_pressure) / BAR;
        let angle = own.stops.map_or(0.0, |s| s.min_angle.abs().max(s.max_angle.abs()));
        closure_torque::resistance(&ids.map(|id| self.values[id]), pressure, angle)
    }

    /// Fastest rate of what the closures of joints remember [1/s].
    pub(super) fn closure_memory(&self) -> f64 {
        let value = |id| self.values[id];
        match self.rig.wiring.effects.closure_torque {
            Some([.., time, angle]) => closure_torque::fastest(value(time), value(angle)),
            None => 0.0,
        }
    }

    /// Largest change of the closure's flow into a chamber per pressure [kg/(s Pa)].
    pub(super) fn steepest_closure(&self, gas: usize) -> f64 {
        let wiring = &self.rig.wiring;
        match (wiring.effects.closure_flow, wiring.gases[gas].closure) {
            (Some(ids), Some(_)) => {
                let pressure = self.rig.highest_pressure() / BAR;
                // Openings of several valves add up.
                let valves = wiring.valves.iter().filter(|v| v.to == gas).count().max(1);
                closure_flow::steepest(&ids.map(|id| self.values[id]), pressure) * valves as f64 / BAR
            }
            _ => 0.0,
        }
    }

    /// The same for a supply.
    pub(super) fn steepest_supply(&self, supply: usize) -> f64 {
        let wiring = &self.rig.wiring;
        match (wiring.effects.closure_supply, wiring.supply_effects[supply].closure) {
            (Some(ids), Some(_)) => {
                let valves = wiring.valves.iter().filter(|v| v.from == Node::Supply(supply)).count();
                closure_supply::steepest(&ids.map(|id| self.values[id]), valves as f64) / BAR
            }
            _ => 0.0,
        }
    }

    /// Fastest rate of what the closures of the air remember [1/s].
    pub(super) fn closure_air_memory(&self) -> f64 {
        let units = &self.rig.wiring.effects;
        let times = [units.closure_flow.map(|[.., t]| t), units.closure_supply.map(|[.., t]| t)];
        times.into_iter().flatten().map(|id| 1.0 / self.values[id]).fold(0.0, f64::max)
    }
}
