//! The state equation of several plants side by side: that of [`crate::plant::rates`] for rigs
//! without effects.

use super::blocks::{Body, Supply, Tube};
use super::num::{side_by_side, Mask, Num, MOST_LANES};
use super::Plan;
use crate::blocks::supply::Supply as OneSupply;
use crate::plant::{Layout, Line, Node, OneBody, Plant, Rig};
use pulp::Simd;

#[derive(Clone, Copy)]
struct Valve<S: Simd, const R: usize> {
    from: Node,
    to: usize,
    /// Discharge area of the opening that is open [m2].
    area: Num<S, R>,
    /// Lanes in which the chamber is filled.
    fills: Mask<S, R>,
    /// In no lane anything is open.
    shut: bool,
}

enum Passage<S: Simd, const R: usize> {
    Orifice(Num<S, R>),
    Tube(Tube<S, R>),
}

/// Values of the parameters of each lane, and room for what the equations write down.
pub(super) struct Lanes<'a, S: Simd, const R: usize> {
    simd: S,
    rig: &'a Rig,
    plan: &'a Plan,
    layout: Layout,
    supplies: Vec<Supply<S, R>>,
    /// Set pressure of each supply [Pa, absolute].
    pub set_pressure: Vec<Num<S, R>>,
    fixed_volume: Vec<Num<S, R>>,
    alphas: Vec<[Num<S, R>; 3]>,
    valves: Vec<Valve<S, R>>,
    lines: Vec<Passage<S, R>>,
    scales: Vec<Num<S, R>>,
    body: Body<S, R>,
    /// Masses and sums of the balance are wanted.
    sums: bool,
    volume: Vec<Num<S, R>>,
    volume_rate: Vec<Num<S, R>>,
    inflow: Vec<Num<S, R>>,
    outflow: Vec<Num<S, R>>,
    drawn: Vec<Num<S, R>>,
    torque: Vec<Num<S, R>>,
    vented: Num<S, R>,
    muscle_work: Num<S, R>,
}

impl<'a, S: Simd, const R: usize> Lanes<'a, S, R> {
    /// One lane for each plant of a rig that the plan is for, one at least; the lanes that are left
    /// over are as the last of them.
    pub fn new(simd: S, plan: &'a Plan, plants: &[&Plant<'a, f64>], sums: bool) -> Self {
        let first = plants[0];
        let rig = first.rig();
        let zero = Num::splat(simd, 0.0);
        let each = |of: &dyn Fn(&Plant<'a, f64>) -> f64| {
            let mut values = [0.0; MOST_LANES];
            for (lane, value) in values.iter_mut().enumerate() {
                *value = of(plants[lane.min(plants.len() - 1)]);
            }
            Num::load(simd, &values[..side_by_side::<S, R>()])
        };
        let supplies = (0..first.supplies.len()).map(|k| supply(k, first, &each)).collect();
        let lines = (0..first.lines.len()).map(|k| passage(k, first, &each)).collect();
        let wiring = &rig.wiring;
        let valves = wiring.valves.iter().map(|valve| Valve {
            from: valve.from,
            to: valve.to,
            area: zero,
            fills: zero.less(zero),
            shut: true,
        });
        let alphas = (0..first.alphas.len()).map(|k| {
            [
                each(&|p| p.alphas[k].inflow),
                each(&|p| p.alphas[k].outflow),
                each(&|p| p.alphas[k].volume),
            ]
        });
        let layout = rig.layout;
        let zeros = |n: usize| vec![zero; n];
        Self {
            supplies,
            set_pressure: zeros(layout.supplies),
            fixed_volume: (0..layout.gases).map(|k| each(&|p| p.fixed_volume[k])).collect(),
            alphas: alphas.collect(),
            valves: valves.collect(),
            lines,
            scales: (0..wiring.groups.len()).map(|k| each(&|p| p.scales[k])).collect(),
            body: body(first, &each),
            sums,
            volume: zeros(layout.gases),
            volume_rate: zeros(layout.gases),
            inflow: zeros(layout.gases),
            outflow: zeros(layout.gases),
            drawn: zeros(layout.supplies),
            torque: zeros(layout.coordinates),
            vented: zero,
            muscle_work: zero,
            simd,
            rig,
            plan,
            layout,
        }
    }

    /// Openings of a valve over the sample that comes [m2], above zero where the chamber is filled,
    /// below where it is vented.
    pub fn open(&mut self, valve: usize, areas: &[f64]) {
        let signed = Num::load(self.simd, areas);
        let valve = &mut self.valves[valve];
        valve.fills = signed.constant(0.0).less(signed);
        valve.area = signed.abs();
        valve.shut = areas.iter().all(|a| *a == 0.0);
    }

    #[inline(always)]
    fn pressure_at(&self, node: Node, state: &[Num<S, R>]) -> Num<S, R> {
        match node {
            Node::Ambient => Num::splat(self.simd, self.rig.gas.ambient_pressure),
            Node::Supply(k) => state[self.layout.supply(k)],
            Node::Gas(k) => state[self.layout.pressure(k)],
        }
    }

    /// Time derivative of the state; what each plant has columns of is worked out in registers of
    /// some width.
    #[inline(always)]
    pub fn rates<W: Simd>(&mut self, wide: W, state: &[Num<S, R>], out: &mut [Num<S, R>]) {
        self.mechanics(wide, state);
        self.flows(state);
        self.gas_rates(state, out);
        let layout = self.layout;
        let (angle, rate) = (state[layout.angle(0)], state[layout.rate(0)]);
        out[layout.angle(0)] = rate;
        out[layout.rate(0)] = self.body.acceleration(angle, rate, self.torque[0]);
        if self.sums {
            self.balances(state, out);
        }
    }

    #[inline(always)]
    fn mechanics<W: Simd>(&mut self, wide: W, state: &[Num<S, R>]) {
        let zero = Num::splat(self.simd, 0.0);
        self.volume.copy_from_slice(&self.fixed_volume);
        self.volume_rate.fill(zero);
        self.torque.fill(zero);
        self.muscle_work = zero;
        let ambient = self.rig.gas.ambient_pressure;
        for (k, (group, curves)) in self.rig.wiring.groups.iter().zip(&self.plan.curves).enumerate()
        {
            let angle = state[self.layout.angle(group.coordinate)];
            let rate = state[self.layout.rate(group.coordinate)];
            let gauge = state[self.layout.pressure(group.chamber)] - ambient;
            let scale = self.scales[k];
            let [gas, elastic, offset, volume, slope, gas_work, elastic_work, offset_work] =
                curves.eval(wide, angle, self.sums);
            self.torque[group.coordinate] += gauge * gas + scale * (gauge * elastic + offset);
            self.volume[group.chamber] += volume;
            self.volume_rate[group.chamber] += slope * rate;
            if self.sums {
                let pull = gauge * gas_work + scale * (gauge * elastic_work + offset_work);
                self.muscle_work += pull * rate;
            }
        }
    }

    #[inline(always)]
    fn flows(&mut self, state: &[Num<S, R>]) {
        let zero = Num::splat(self.simd, 0.0);
        self.inflow.fill(zero);
        self.outflow.fill(zero);
        self.drawn.fill(zero);
        self.vented = zero;
        let ambient = Num::splat(self.simd, self.rig.gas.ambient_pressure);
        for k in 0..self.valves.len() {
            let Valve { from, to, area, fills, shut } = self.valves[k];
            if shut {
                continue;
            }
            let chamber = state[self.layout.pressure(to)];
            let upstream = fills.select(self.pressure_at(from, state), chamber);
            let downstream = fills.select(chamber, ambient);
            let flow = self.plan.orifice.mass_flow(area, upstream, downstream);
            let (filling, venting) = (fills.select(flow, zero), fills.select(zero, flow));
            self.pass(from, Node::Gas(to), filling);
            self.pass(Node::Gas(to), Node::Ambient, venting);
        }
        for k in 0..self.lines.len() {
            let unit = &self.rig.wiring.lines[k];
            let (from, to) = (self.pressure_at(unit.from, state), self.pressure_at(unit.to, state));
            let flow = match &self.lines[k] {
                Passage::Orifice(area) => self.plan.orifice.mass_flow(*area, from, to),
                Passage::Tube(tube) => tube.mass_flow(from, to),
            };
            self.pass(unit.from, unit.to, flow);
        }
    }

    /// A mass flow along the arrow; what goes against it goes out of its end.
    #[inline(always)]
    fn pass(&mut self, from: Node, to: Node, flow: Num<S, R>) {
        let zero = flow.constant(0.0);
        let (along, against) = (flow.or_above(zero), (-flow).or_above(zero));
        self.exchange(from, along, against, flow);
        self.exchange(to, against, along, -flow);
    }

    /// What leaves a node, what comes to it, and the difference.
    #[inline(always)]
    fn exchange(&mut self, node: Node, leaves: Num<S, R>, comes: Num<S, R>, net: Num<S, R>) {
        match node {
            Node::Ambient => self.vented = self.vented - net,
            Node::Supply(k) => self.drawn[k] += net,
            Node::Gas(k) => {
                self.outflow[k] += leaves;
                self.inflow[k] += comes;
            }
        }
    }

    #[inline(always)]
    fn gas_rates(&self, state: &[Num<S, R>], out: &mut [Num<S, R>]) {
        let (gas, layout) = (&self.rig.gas, &self.layout);
        let rt = gas.gas_constant * gas.temperature;
        for (k, supply) in self.supplies.iter().enumerate() {
            let pressure = state[layout.supply(k)];
            out[layout.supply(k)] =
                supply.pressure_rate(pressure, self.drawn[k], self.set_pressure[k]);
        }
        for k in 0..layout.gases {
            let [inflow, outflow, volume] = self.alphas[k];
            let pressure = state[layout.pressure(k)];
            out[layout.mass(k)] = self.inflow[k] - self.outflow[k];
            out[layout.pressure(k)] = ((inflow * self.inflow[k] - outflow * self.outflow[k]) * rt
                - volume * pressure * self.volume_rate[k])
                / self.volume[k];
        }
    }

    /// Rates of the sums of [`crate::plant::BALANCE`].
    #[inline(always)]
    fn balances(&self, state: &[Num<S, R>], out: &mut [Num<S, R>]) {
        let (gas, layout) = (&self.rig.gas, &self.layout);
        let rt = gas.gas_constant * gas.temperature;
        let zero = Num::splat(self.simd, 0.0);
        let (mut drawn, mut exergy, mut vented) = (zero, zero, self.vented);
        for (k, flow) in self.drawn.iter().enumerate() {
            if zero.less(flow.abs()).nowhere() {
                continue; // the logarithm is dear
            }
            let mut taken = *flow;
            if matches!(self.supplies[k], Supply::Regulator { .. }) {
                // A regulator relieves to the ambient what it takes back.
                let back = flow.less(zero);
                vented = vented - back.select(*flow, zero);
                taken = back.select(zero, *flow);
            }
            drawn += taken;
            let raised = state[layout.supply(k)] / gas.ambient_pressure;
            exergy += raised.ln() * taken * rt;
        }
        let power = self.torque[0] * state[layout.rate(0)];
        let sums = [drawn, vented, drawn * rt, exergy, self.muscle_work, power.or_above(zero)];
        out[layout.states()..].copy_from_slice(&sums);
    }
}

type Each<'e, 'a, S, const R: usize> = &'e dyn Fn(&dyn Fn(&Plant<'a, f64>) -> f64) -> Num<S, R>;

fn supply<'a, S: Simd, const R: usize>(k: usize, first: &Plant<'a, f64>, each: Each<'_, 'a, S, R>) -> Supply<S, R> {
    let of = |number: fn(&OneSupply<f64>) -> f64| each(&|p| number(&p.supplies[k]));
    match first.supplies[k] {
        OneSupply::Constant => Supply::Constant,
        OneSupply::Tank(_) => Supply::Tank(
            of(|s| match s {
                OneSupply::Tank(volume) => 1.0 / *volume,
                _ => f64::NAN,
            }) * (first.rig().gas.gas_constant * first.rig().gas.temperature),
        ),
        OneSupply::Regulator { .. } => Supply::Regulator {
            time_constant: of(|s| match s {
                OneSupply::Regulator { time_constant, .. } => *time_constant,
                _ => f64::NAN,
            }),
            droop: of(|s| match s {
                OneSupply::Regulator { droop, .. } => *droop,
                _ => f64::NAN,
            }),
        },
    }
}

fn passage<'a, S: Simd, const R: usize>(k: usize, first: &Plant<'a, f64>, each: Each<'_, 'a, S, R>) -> Passage<S, R> {
    let of = |number: fn(&Line<f64>) -> f64| each(&|p| number(&p.lines[k]));
    match first.lines[k] {
        Line::Orifice(_) => Passage::Orifice(of(|line| match line {
            Line::Orifice(area) => *area,
            Line::Tube(_) => f64::NAN,
        })),
        Line::Tube(_) => Passage::Tube(Tube {
            flow_factor: of(|line| match line {
                Line::Tube(tube) => tube.flow_factor(),
                Line::Orifice(_) => f64::NAN,
            }),
            critical_ratio: of(|line| match line {
                Line::Tube(tube) => tube.critical_ratio(),
                Line::Orifice(_) => f64::NAN,
            }),
        }),
    }
}

/// One coordinate. A plan is for no other bodies: in their place stands what is no number.
fn body<'a, S: Simd, const R: usize>(first: &Plant<'a, f64>, each: Each<'_, 'a, S, R>) -> Body<S, R> {
    let (turns, coulomb_speed, stops) = match &first.body {
        OneBody::OneLink(arm, stops) => (true, arm.coulomb_speed, *stops),
        OneBody::Mass(load, stops) => (false, load.coulomb_speed, *stops),
        _ => (false, f64::NAN, None),
    };
    let of = |number: fn(&OneBody<f64>) -> [f64; 4], k: usize| each(&|p| number(&p.body)[k]);
    let numbers = |body: &OneBody<f64>| match body {
        OneBody::OneLink(arm, _) => {
            let weight = (arm.first_moment + arm.payload * arm.length) * arm.gravity;
            [1.0 / arm.total_inertia(), weight, arm.viscous, arm.coulomb]
        }
        OneBody::Mass(load, _) => [load.mass, load.mass * load.gravity, load.viscous, load.coulomb],
        _ => [f64::NAN; 4],
    };
    let coulomb = of(numbers, 3);
    Body {
        mobility: of(numbers, 0),
        weight: of(numbers, 1),
        turns,
        viscous: of(numbers, 2),
        coulomb,
        rubs: coulomb.numbers().iter().any(|c| *c != 0.0),
        coulomb_slope: 1.0 / coulomb_speed,
        stops,
    }
}
