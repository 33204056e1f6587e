//! Flows between the nodes of a rig, what they do to the pressures, and how fast.

use super::ports::{Flow, Place};
use super::rates::{Controls, InputPort, Line, Plant, Scratch, Simulated, Warm};
use super::units::Node;
use crate::blocks::chamber::{
    cube_area, cylinder_area, energy_rate, gas_temperature, pressure_rate, wall_heat, wall_rate,
    ChamberState,
};
use crate::blocks::supply::Supply;
use crate::blocks::valve::Opening;
use crate::clock::Edge;
use crate::effects::{Extremes, BAR};
use crate::scalar::{constant, Scalar};

/// Pressures at which the slope of a line's law is looked at, and how many of them to a decade.
const LAW_POINTS: i32 = 70;
const LAW_PER_DECADE: f64 = 10.0;

/// A pressure [Pa, absolute]: one of the states, by its place, or one that stays.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pressure {
    At(usize),
    Held(f64),
}

impl<S: Scalar> Plant<'_, S> {
    #[inline]
    pub(super) fn pressure_at(&self, node: Node, state: &[S]) -> S {
        match node {
            Node::Ambient => constant(self.rig.gas.ambient_pressure),
            Node::Supply(k) => state[self.layout.supply(k)],
            Node::Gas(k) => state[self.layout.pressure(k)],
        }
    }

    /// A gas at rest temperature.
    pub(super) fn cold(&self) -> Warm<S> {
        let (one, zero) = (constant(1.0), constant(0.0));
        Warm {
            temperature: constant(self.rig.gas.temperature),
            share: one,
            carried: zero,
            heat: zero,
        }
    }

    /// Temperatures of all gases, written to the scratch: that of an energy balance where mass and
    /// pressure are integrated, else that of the room.
    #[inline(never)]
    pub(super) fn temperatures(&self, state: &[S], simulated: &Simulated, here: &mut Scratch<S>) {
        let (gas, layout) = (&self.rig.gas, &self.layout);
        for k in 0..layout.gases {
            here.warm[k] = self.cold();
            let (pressure, mass) = (layout.pressure(k), layout.mass(k));
            if self.walls[k].is_some() && simulated.moves(pressure) && simulated.moves(mass) {
                let temperature =
                    gas_temperature(gas, state[pressure], here.volume[k], state[mass]);
                here.warm[k].temperature = temperature;
                here.warm[k].share = (temperature.recip() * gas.temperature).sqrt();
            }
        }
    }

    /// Rates of the sums of [`super::layout::HEAT_BALANCE`] [W].
    #[inline(never)]
    pub(super) fn heat_sums(&self, state: &[S], here: &Scratch<S>) -> [S; 3] {
        let gas = &self.rig.gas;
        let heat_capacity = gas.gamma / (gas.gamma - 1.0) * gas.gas_constant;
        let mut sums = [constant(0.0); 3];
        for (k, warm) in here.warm.iter().enumerate().filter(|(k, _)| self.walls[*k].is_some()) {
            sums[0] += (warm.carried - here.outflow[k] * warm.temperature) * heat_capacity;
            sums[1] += warm.heat;
            sums[2] += state[self.layout.pressure(k)] * here.volume_rate[k];
        }
        sums
    }

    /// Mass flows between all nodes, written to the scratch.
    #[inline(always)]
    pub(super) fn flows(&self, state: &[S], controls: &Controls<S>, here: &mut Scratch<S>) {
        let zero = constant::<S>(0.0);
        here.inflow.fill(zero);
        here.outflow.fill(zero);
        here.drawn.fill(zero);
        here.vented = zero;
        for k in 0..self.valves.len() {
            let moves = || self.wiring.ports.moves_valve(k);
            match controls.edges.get(k).filter(|edge| edge.changes() && !moves()) {
                None => {
                    if let Some((from, to, flow)) = self.through_valve(k, controls.spool[k], state)
                    {
                        here.pass(from, to, flow);
                    }
                }
                Some(Edge { now, before, share_before }) => {
                    for (spool, share) in [(before, *share_before), (now, -*share_before + 1.0)] {
                        if let Some((from, to, flow)) = self.through_valve(k, *spool, state) {
                            here.pass(from, to, flow * share);
                        }
                    }
                }
            }
        }
        for (k, unit) in self.wiring.lines.iter().enumerate() {
            if unit.segments == 0 {
                here.pass(unit.from, unit.to, self.along_line(k, state));
            }
        }
        if self.altered.waves {
            self.wave_flows(state, here);
        }
        if self.altered.flows {
            self.effect_flows(state, controls, here);
        }
        if let Some((InputPort::Flow(node), flow)) = here.input {
            here.pass(Node::Ambient, node, flow);
        }
        if self.altered.inlets {
            self.inlet_flows(here);
        }
    }

    /// Between which nodes a valve passes air, and how much [kg/s]; None where it is shut.
    #[inline(always)]
    fn through_valve(&self, k: usize, spool: S, state: &[S]) -> Option<(Node, Node, S)> {
        let (unit, valve) = (&self.wiring.valves[k], &self.valves[k]);
        let pressure = state[self.layout.pressure(unit.to)];
        if spool.re() > 0.0 {
            let opening = valve.paths[0].part(self.share(k, unit.table.eval(spool), false));
            let upstream = self.pressure_at(unit.from, state);
            let flow = self.valve_flow(k, &opening, upstream, pressure, false);
            Some((unit.from, Node::Gas(unit.to), flow))
        } else if spool.re() < 0.0 {
            let opening = valve.paths[1].part(self.share(k, unit.table.eval(-spool), true));
            let ambient = constant(self.rig.gas.ambient_pressure);
            let flow = self.valve_flow(k, &opening, pressure, ambient, true);
            Some((Node::Gas(unit.to), Node::Ambient, flow))
        } else {
            None
        }
    }

    /// Mass flow along a line without segments [kg/s].
    #[inline(always)]
    fn along_line(&self, k: usize, state: &[S]) -> S {
        let unit = &self.wiring.lines[k];
        let (from, to) = (self.pressure_at(unit.from, state), self.pressure_at(unit.to, state));
        let flow = self.lines[k].mass_flow(&self.rig.gas, from, to);
        if self.altered.laws {
            self.altered_line_flow(k, flow, from, to)
        } else {
            flow
        }
    }

    /// Mass flow into a gas [kg/s] through the valves and the lines that lead to it, as a meter in
    /// front of it reads it; air at the temperature of the room.
    pub fn metered(&self, gas: usize, state: &[S], spools: &[S]) -> S {
        let (here, air, mut sum) = (Node::Gas(gas), &self.rig.gas, constant::<S>(0.0));
        let mut add = |from: Node, to: Node, flow: S| {
            if to == here {
                sum += flow;
            } else if from == here {
                sum -= flow;
            }
        };
        let leads = |valve: &usize| self.wiring.valves[*valve].to == gas;
        for k in (0..self.valves.len()).filter(leads) {
            if let Some((from, to, flow)) = self.through_valve(k, spools[k], state) {
                add(from, to, flow);
            }
        }
        for (k, unit) in self.wiring.lines.iter().enumerate().filter(|(_, l)| l.to == here) {
            let wave = self.wiring.waves.iter().find(|wave| wave.line == k);
            let last = wave.map(|wave| state[self.layout.flow(wave.flow + wave.segments - 1)]);
            add(unit.from, unit.to, last.unwrap_or_else(|| self.along_line(k, state)));
        }
        for (flow, acting) in &self.wiring.ports.flows {
            let Flow::Clearance(valve) = flow else { continue };
            if leads(valve) {
                let area = self.effect(acting).clearance(air, spools[*valve]);
                for (from, to) in [(self.wiring.valves[*valve].from, here), (here, Node::Ambient)] {
                    let (up, down) = (self.pressure_at(from, state), self.pressure_at(to, state));
                    add(from, to, air.mass_flow(area, up, down));
                }
            }
        }
        sum
    }

    /// What goes out of regulators is drawn from the supplies in front of them; what these take back
    /// goes to the ambient.
    #[inline(never)]
    fn inlet_flows(&self, here: &mut Scratch<S>) {
        for (regulator, inlet) in self.wiring.inlets_of_regulators() {
            let flow = here.drawn[regulator];
            if flow.re() > 0.0 || (flow.re() == 0.0 && !here.backwards) {
                here.drawn[inlet] += flow;
            }
        }
    }

    /// Absolute pressure in front of a regulator [Pa], where a supply stands there.
    #[inline(always)]
    fn inlet_pressure(&self, supply: usize, state: &[S]) -> Option<S> {
        if !self.altered.inlets {
            return None;
        }
        self.wiring.supplies[supply].inlet().map(|inlet| state[self.layout.supply(inlet)])
    }

    /// What flows through the segments of tubes, written to the scratch.
    #[inline(never)]
    fn wave_flows(&self, state: &[S], here: &mut Scratch<S>) {
        let lines = &self.wiring.lines;
        for unit in &self.wiring.waves {
            for k in 0..unit.segments {
                let flow = state[self.layout.flow(unit.flow + k)];
                here.carry(unit.node(lines, k), unit.node(lines, k + 1), flow);
            }
        }
    }

    /// Rates of these flows.
    #[inline(never)]
    fn wave_rates(&self, state: &[S], out: &mut [S]) {
        let lines = &self.wiring.lines;
        for (unit, wave) in self.wiring.waves.iter().zip(&self.waves) {
            let mut from = self.pressure_at(unit.node(lines, 0), state);
            for k in 0..unit.segments {
                let to = self.pressure_at(unit.node(lines, k + 1), state);
                let place = self.layout.flow(unit.flow + k);
                out[place] = wave.flow_rate(from, to, state[place]);
                from = to;
            }
        }
    }

    /// Share of a valve's widest opening where its table gives one [1].
    #[inline(always)]
    pub(super) fn share(&self, valve: usize, share: S, venting: bool) -> S {
        if self.altered.areas {
            self.altered_share(valve, share, venting)
        } else {
            share
        }
    }

    #[inline(never)]
    fn altered_share(&self, valve: usize, share: S, venting: bool) -> S {
        match &self.wiring.ports.area[valve] {
            None => share,
            Some(acting) => self.effect(acting).area(share, venting),
        }
    }

    /// Mass flow through an opening of a valve [kg/s], and what lies behind it.
    #[inline(always)]
    fn valve_flow(
        &self,
        valve: usize,
        opening: &Opening<S>,
        upstream: S,
        downstream: S,
        venting: bool,
    ) -> S {
        if self.altered.passages {
            self.altered_valve_flow(valve, opening, upstream, downstream, venting)
        } else {
            opening.mass_flow(&self.rig.gas, upstream, downstream)
        }
    }

    #[inline(never)]
    fn altered_valve_flow(
        &self,
        valve: usize,
        opening: &Opening<S>,
        upstream: S,
        downstream: S,
        venting: bool,
    ) -> S {
        let gas = &self.rig.gas;
        match &self.wiring.ports.passage[valve] {
            None => opening.mass_flow(gas, upstream, downstream),
            Some(acting) => {
                self.effect(acting).through(gas, opening, upstream, downstream, venting)
            }
        }
    }

    /// Mass flow through a line [kg/s] whose own law says `flow`.
    #[inline(never)]
    fn altered_line_flow(&self, line: usize, flow: S, from: S, to: S) -> S {
        match &self.wiring.ports.law[line] {
            None => flow,
            Some(acting) => {
                let gas = &self.rig.gas;
                let ambient = gas.ambient_pressure;
                let (above, ambient) = (constant(ambient + BAR), constant(ambient));
                let unit = self.lines[line].mass_flow(gas, above, ambient);
                self.effect(acting).along(gas, flow, unit, from, to)
            }
        }
    }

    /// Flows of effects, written to the scratch.
    #[inline(never)]
    fn effect_flows(&self, state: &[S], controls: &Controls<S>, here: &mut Scratch<S>) {
        let gas = &self.rig.gas;
        for (flow, acting) in &self.wiring.ports.flows {
            let effect = self.effect(acting);
            match *flow {
                Flow::Leak(node) => {
                    let lost = effect.leak(gas, self.pressure_at(node, state));
                    let lost = here.of_temperature(node, lost);
                    here.take(node, lost);
                    here.vented += lost;
                }
                Flow::Clearance(valve) => {
                    let unit = &self.wiring.valves[valve];
                    let area = effect.clearance(gas, controls.spool[valve]);
                    let chamber = Node::Gas(unit.to);
                    for (from, to) in [(unit.from, chamber), (chamber, Node::Ambient)] {
                        let (upstream, downstream) =
                            (self.pressure_at(from, state), self.pressure_at(to, state));
                        here.pass(from, to, gas.mass_flow(area, upstream, downstream));
                    }
                }
                Flow::Inflow(node) => {
                    let at = self.at_node(node, state, controls, here);
                    here.pass(Node::Ambient, node, effect.inflow(&at, self.own(acting, state)));
                }
            }
        }
    }

    /// Rate of a supply's pressure with the effects on it [Pa/s].
    #[inline(never)]
    fn altered_supply(&self, k: usize, state: &[S], drawn: S, rt: f64, set: &Edge<S>) -> S {
        let pressure = state[self.layout.supply(k)];
        let altered = |mut set: S| {
            let mut drawn = drawn;
            for acting in &self.wiring.ports.feed[k] {
                self.effect(acting).feed(self.own(acting, state), pressure, &mut drawn, &mut set);
            }
            (drawn, set)
        };
        let (drawn, now) = altered(set.now);
        let before = if set.changes() { altered(set.before).1 } else { now };
        let (set, inlet) = (Edge { now, before, ..*set }, self.inlet_pressure(k, state));
        self.supplies[k].pressure_rate(pressure, drawn, rt, &set, inlet)
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
        if self.altered.waves {
            self.wave_rates(state, out);
        }
        for (k, supply) in self.supplies.iter().enumerate() {
            let set = &controls.set_pressure[k];
            out[layout.supply(k)] = if self.altered.supplies {
                self.altered_supply(k, state, here.drawn[k], rt, set)
            } else {
                let inlet = self.inlet_pressure(k, state);
                supply.pressure_rate(state[layout.supply(k)], here.drawn[k], rt, set, inlet)
            };
        }
        for k in 0..layout.gases {
            let chamber = ChamberState {
                pressure: state[layout.pressure(k)],
                volume: here.volume[k],
                volume_rate: here.volume_rate[k],
                inflow: here.inflow[k],
                outflow: here.outflow[k],
            };
            out[layout.mass(k)] = chamber.inflow - chamber.outflow;
            if let Some(coefficient) = self.walls[k] {
                let Warm { temperature, carried, .. } = here.warm[k];
                let heat = wall_heat(gas, chamber.pressure, temperature, here.wall[k], coefficient);
                here.warm[k].heat = heat;
                out[layout.pressure(k)] = energy_rate(gas, &chamber, carried, temperature, heat);
                continue;
            }
            let fixed = pressure_rate(&chamber, &self.alphas[k], rt);
            let balance =
                if self.altered.balances { self.wiring.ports.balance[k].as_ref() } else { None };
            out[layout.pressure(k)] = match balance {
                None => fixed,
                Some(acting) => {
                    let mass = state[layout.mass(k)];
                    let (rate, more) =
                        self.effect(acting).balance(gas, &chamber, here.wall[k], mass, fixed);
                    out[layout.mass(k)] += more;
                    rate
                }
            };
        }
    }
}

impl<S: Scalar> Scratch<S> {
    /// A mass flow along the arrow; what goes against it goes out of its end and into its
    /// beginning.
    #[inline]
    pub(super) fn pass(&mut self, from: Node, to: Node, flow: S) {
        let (giver, taker, flow) = self.along(from, to, flow);
        if self.warm.is_empty() {
            self.take(giver, flow);
            self.give(taker, flow);
        } else {
            let flow = self.of_temperature(giver, flow);
            self.pass_heat(giver, taker, flow);
        }
    }

    /// The same of a flow that is a state, whatever its temperature.
    #[inline]
    fn carry(&mut self, from: Node, to: Node, flow: S) {
        let (giver, taker, flow) = self.along(from, to, flow);
        if self.warm.is_empty() {
            self.take(giver, flow);
            self.give(taker, flow);
        } else {
            self.pass_heat(giver, taker, flow);
        }
    }

    /// Where a flow begins, where it goes, and how much it is that way.
    #[inline(always)]
    fn along(&self, from: Node, to: Node, flow: S) -> (Node, Node, S) {
        let along = flow.re() > 0.0 || (flow.re() == 0.0 && !self.backwards);
        if along {
            (from, to, flow)
        } else {
            (to, from, -flow)
        }
    }

    /// A flow with its temperature.
    #[inline(never)]
    fn pass_heat(&mut self, giver: Node, taker: Node, flow: S) {
        self.take(giver, flow);
        self.give(taker, flow);
        if let Node::Gas(k) = taker {
            let temperature = match giver {
                Node::Gas(from) => self.warm[from].temperature,
                _ => constant(self.rest_temperature),
            };
            self.warm[k].carried += flow * temperature;
        }
    }

    /// Mass flow out of a node where it would be so much [kg/s] at rest temperature: the same
    /// pressures move less of a warmer gas.
    #[inline]
    fn of_temperature(&self, giver: Node, flow: S) -> S {
        match giver {
            Node::Gas(k) if !self.warm.is_empty() => flow * self.warm[k].share,
            _ => flow,
        }
    }

    #[inline(always)]
    pub(super) fn take(&mut self, node: Node, flow: S) {
        match node {
            Node::Ambient => self.vented -= flow,
            Node::Supply(k) => self.drawn[k] += flow,
            Node::Gas(k) => self.outflow[k] += flow,
        }
    }

    #[inline(always)]
    fn give(&mut self, node: Node, flow: S) {
        match node {
            Node::Ambient => self.vented += flow,
            Node::Supply(k) => self.drawn[k] -= flow,
            Node::Gas(k) => self.inflow[k] += flow,
        }
    }
}

impl Plant<'_, f64> {
    /// Pressures at both ends of each valve (none where it is shut) and line, and the ratio of them
    /// at which its flow becomes choked.
    pub(crate) fn passages<'b>(
        &'b self,
        controls: &'b Controls<f64>,
    ) -> impl Iterator<Item = (Option<(Pressure, Pressure)>, f64)> + 'b {
        let gas = &self.rig.gas;
        let pressure = |node: Node| {
            node.place(&self.layout).map_or(Pressure::Held(gas.ambient_pressure), Pressure::At)
        };
        let valves = self.wiring.valves.iter().zip(&self.valves).zip(&controls.spool);
        let valves = valves.map(move |((unit, valve), spool)| {
            let other = if *spool > 0.0 { unit.from } else { Node::Ambient };
            let path = &valve.paths[usize::from(*spool <= 0.0)];
            let open = !path.part(unit.table.eval(spool.abs())).shut();
            let ends = open.then(|| (pressure(Node::Gas(unit.to)), pressure(other)));
            (ends, path.critical_ratio(gas))
        });
        let lines = self.wiring.lines.iter().zip(&self.lines).map(move |(unit, line)| {
            let critical = match line {
                Line::Orifice(_) => gas.critical_ratio(),
                Line::Tube(tube) => tube.critical_ratio(),
            };
            (Some((pressure(unit.from), pressure(unit.to))), critical)
        });
        valves.chain(lines)
    }

    /// Fastest rate of the air [1/s] where some pressures move and a signal drives the others, and
    /// the gas that it is in (none for a supply): a bound by Gershgorin's rows, every valve open,
    /// next to equal pressures.
    pub(crate) fn fastest_air(&self, moves: impl Fn(Node) -> bool) -> (f64, Option<usize>) {
        let (wiring, gas) = (&self.wiring, &self.rig.gas);
        let rt = gas.gas_constant * gas.temperature;
        let mut steepest = vec![0.0; wiring.gases.len()];
        let mut drawn = vec![0.0; wiring.supplies.len()];
        let mut add = |node: Node, other: Node, slope: f64| {
            // The other end answers with the same slope where its pressure moves.
            let answers = !matches!(other, Node::Ambient) && moves(other);
            let twice = if answers { 2.0 * slope } else { slope };
            match node {
                Node::Gas(k) => steepest[k] += twice,
                Node::Supply(k) => drawn[k] += twice,
                Node::Ambient => {}
            }
        };
        for (k, (unit, valve)) in wiring.valves.iter().zip(&self.valves).enumerate() {
            let full = unit.table.eval(1.0);
            let most = self.share(k, full, false).max(self.share(k, full, true));
            let [fill, vent] = valve.paths.map(|path| path.part(most).steepest(gas));
            let slope = fill.max(vent);
            add(Node::Gas(unit.to), unit.from, slope);
            add(unit.from, Node::Gas(unit.to), slope);
        }
        for (k, unit) in wiring.lines.iter().enumerate().filter(|(_, unit)| unit.segments == 0) {
            let slope = self.steepest_line(k);
            add(unit.from, unit.to, slope);
            add(unit.to, unit.from, slope);
        }
        for (flow, acting) in &wiring.ports.flows {
            if let Flow::Clearance(valve) = *flow {
                let slope = self.effect(acting).steepest(gas, &self.extremes(0));
                let unit = &wiring.valves[valve];
                add(Node::Gas(unit.to), unit.from, slope);
                add(unit.from, Node::Gas(unit.to), slope);
                add(Node::Gas(unit.to), Node::Ambient, slope);
            }
        }
        self.steepest_waves(&mut steepest, &mut drawn);
        let of_effects = self.fastest_effect(|place| match place {
            Place::Supply(k) => moves(Node::Supply(k)),
            Place::Gas(k) => moves(Node::Gas(k)),
            _ => false,
        });
        let of_waves = self.fastest_wave().map_or(0.0, |(rate, _)| rate);
        let mut worst = (of_effects.max(of_waves), None);
        for (k, slope) in steepest.iter().enumerate().filter(|(k, _)| moves(Node::Gas(*k))) {
            let alpha = self.alphas[k].inflow.max(self.alphas[k].outflow).max(gas.gamma);
            let (volume, wall) = self.least_volume(k);
            let leak = self.steepest_flows(Node::Gas(k));
            let rate = alpha * rt * (slope + leak) / volume + self.wall_rate(k, volume, wall);
            if rate > worst.0 {
                worst = (rate, Some(k));
            }
        }
        let of_supplies = self.fastest_supply(&mut drawn, moves);
        if of_supplies > worst.0 {
            worst = (of_supplies, None);
        }
        worst
    }

    /// Largest change of the flow through a line per pressure [kg/(s Pa)]: its own law's next to
    /// equal pressures, another one's wherever it is steepest.
    fn steepest_line(&self, k: usize) -> f64 {
        let gas = &self.rig.gas;
        let own = match &self.lines[k] {
            Line::Orifice(area) => gas.steepest(*area),
            Line::Tube(tube) => tube.steepest(),
        };
        if self.wiring.ports.law[k].is_none() {
            return own;
        }
        let (low, most) = (gas.ambient_pressure, self.rig.highest_pressure());
        let flow = |above: f64| {
            let (from, to) = (low + above, low);
            self.altered_line_flow(k, self.lines[k].mass_flow(gas, from, to), from, to)
        };
        let grid = (0..LAW_POINTS).map(|j| {
            let above = (most - low) * 10.0_f64.powf(-f64::from(j) / LAW_PER_DECADE);
            (flow(above * 1.01) - flow(above)) / (0.01 * above)
        });
        grid.fold(own, f64::max)
    }

    /// Fastest rate of the supplies that move [1/s], of which openings draw so much per pressure
    /// [kg/(s Pa)].
    fn fastest_supply(&self, drawn: &mut [f64], moves: impl Fn(Node) -> bool) -> f64 {
        let (wiring, gas) = (&self.wiring, &self.rig.gas);
        let rt = gas.gas_constant * gas.temperature;
        for (k, slope) in drawn.iter_mut().enumerate() {
            *slope += self.steepest_flows(Node::Supply(k));
        }
        for (regulator, inlet) in wiring.inlets_of_regulators() {
            drawn[inlet] += drawn[regulator];
        }
        let answers = |inlet: usize| {
            moves(Node::Supply(inlet)) && !matches!(self.supplies[inlet], Supply::Constant)
        };
        let mut worst = 0.0;
        let supplies = self.supplies.iter().zip(drawn).enumerate();
        for (k, (supply, slope)) in supplies.filter(|(k, _)| moves(Node::Supply(*k))) {
            let mut rate = supply.fastest(*slope, rt);
            if wiring.supplies[k].inlet().is_some_and(answers) {
                rate += supply.fastest(0.0, rt); // what it is brought to answers
            }
            worst = f64::max(worst, rate);
        }
        worst
    }

    /// What waves take from gases and supplies per pressure [kg/(s Pa)]: a flow is no pressure, and
    /// with `A/c` as its measure both have the rates of the wave.
    fn steepest_waves(&self, gases: &mut [f64], supplies: &mut [f64]) {
        let lines = &self.wiring.lines;
        for (unit, wave) in self.wiring.waves.iter().zip(&self.waves) {
            for k in 0..unit.segments {
                for node in [unit.node(lines, k), unit.node(lines, k + 1)] {
                    match node {
                        Node::Gas(k) => gases[k] += wave.admittance(),
                        Node::Supply(k) => supplies[k] += wave.admittance(),
                        Node::Ambient => {}
                    }
                }
            }
        }
    }

    /// Fastest rate of a flow in a tube that carries waves [1/s], and the line.
    pub(super) fn fastest_wave(&self) -> Option<(f64, usize)> {
        let units = self.wiring.waves.iter().zip(&self.waves);
        let rates = units.map(|(unit, wave)| (wave.fastest(), unit.line));
        rates.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Largest change of what effects let in or out per pressure of a block [kg/(s Pa)].
    fn steepest_flows(&self, node: Node) -> f64 {
        let wiring = &self.wiring;
        let valves =
            wiring.valves.iter().filter(|v| v.from == node || Node::Gas(v.to) == node).count();
        let most = self.extremes(valves);
        let at = |flow: &Flow| matches!(flow, Flow::Leak(n) | Flow::Inflow(n) if *n == node);
        let flows = wiring.ports.flows.iter().filter(|(flow, _)| at(flow));
        flows.map(|(_, acting)| self.effect(acting).steepest(&self.rig.gas, &most)).sum()
    }

    /// Extremes of a block of the air.
    fn extremes(&self, valves: usize) -> Extremes {
        let (pressure, ambient) = (self.rig.highest_pressure(), self.rig.gas.ambient_pressure);
        Extremes { pressure, ambient, angles: (0.0, 0.0), contraction: 0.0, valves, load: 0.0 }
    }

    /// Rate at which a gas takes the temperature of its wall [1/s], with the least of it: at
    /// ambient pressure.
    fn wall_rate(&self, gas: usize, volume: f64, wall: f64) -> f64 {
        if let Some(coefficient) = self.walls[gas] {
            return wall_rate(&self.rig.gas, coefficient, volume, wall);
        }
        let balance = self.wiring.ports.balance[gas].as_ref();
        balance.map_or(0.0, |acting| self.effect(acting).wall_rate(&self.rig.gas, volume, wall))
    }

    /// Fastest rate of what effects move by themselves at some blocks [1/s].
    pub(super) fn fastest_effect(&self, here: impl Fn(Place) -> bool) -> f64 {
        let all = self.wiring.ports.integrated().filter(|(place, _)| here(*place));
        all.map(|(_, acting)| self.effect(&acting).fastest()).fold(0.0, f64::max)
    }

    /// Fastest rate on the way from commands to openings [1/s].
    pub(crate) fn fastest_command(&self) -> f64 {
        let all = self.wiring.ports.command.iter().flatten();
        all.map(|acting| self.effect(acting).fastest()).fold(0.0, f64::max)
    }

    /// Least volume of a gas over the range of its muscles [m3], with the largest wall [m2].
    fn least_volume(&self, gas: usize) -> (f64, f64) {
        let (mut volume, mut wall) = (self.fixed_volume[gas], 0.0);
        for group in self.wiring.groups.iter().filter(|g| g.chamber == gas) {
            let (low, high) = self.rig.range(group);
            let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
            for i in 0..=32 {
                let contraction = low + (high - low) * f64::from(i) / 32.0;
                let here = group.muscle.table.eval(contraction).volume.max(0.0);
                least = least.min(here);
                let length = (1.0 - contraction) * group.rest_length;
                most = most.max(cylinder_area(group.count, here, length));
            }
            volume += least * group.count;
            wall += most;
        }
        let volume = volume.max(f64::MIN_POSITIVE);
        (volume, if wall > 0.0 { wall } else { cube_area(volume) })
    }
}
