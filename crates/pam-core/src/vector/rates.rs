//! The state equation of several plants side by side: that of [`crate::plant::rates`] for rigs
//! without effects.

use super::blocks::{Body, Supply, Tube, Turns};
use super::curves::Sign;
use super::num::{side_by_side, Mask, Num, Registers, MOST_LANES};
use super::plan::Plan;
use super::slopes::Slopes;
use crate::blocks::arm::one_link::Spring;
use crate::blocks::supply::Supply as OneSupply;
use crate::blocks::valve::Opening;
use crate::plant::{Layout, Line, Node, OneBody, Plant, Rig, BALANCE};
use pulp::Simd;

#[derive(Clone, Copy)]
struct Valve<S: Simd, R: Registers> {
    from: Node,
    to: usize,
    /// Of the opening that is open, see [`super::blocks::Orifice::conductance`].
    conductance: Num<S, R>,
    /// Lanes in which the chamber is filled.
    fills: Mask<S, R>,
    /// In some lane the chamber is filled.
    some_fill: bool,
    /// In some lane it is vented.
    some_vent: bool,
}

enum Passage<S: Simd, R: Registers> {
    Orifice(Num<S, R>),
    Tube(Tube<S, R>),
}

/// Length of the state of [`Shape::small`] at most.
pub(crate) const SMALL: usize = 5 + BALANCE.len();

/// How many blocks the equations are for, and whether masses and sums of the balance are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shape {
    layout: Layout,
    sums: bool,
    /// It is as [`Self::small`], and the compiler is to know it.
    small: bool,
}

impl Shape {
    /// One supply and one gas. Where the compiler knows it, every place of the state is known too:
    /// a plant alone would spend more on finding them than on its equations.
    #[inline(always)]
    pub fn small(sums: bool) -> Self {
        Self {
            layout: Layout {
                supplies: 1,
                gases: 1,
                flows: 0,
                coordinates: 1,
                chambers: 1,
                effects: 0,
                sums: BALANCE.len(),
            },
            sums,
            small: true,
        }
    }

    /// Whether there are as many blocks as in [`Self::small`].
    pub fn is_small(self) -> bool {
        self.layout == Self::small(true).layout
    }

    /// Whether masses and sums of the balance are wanted.
    #[inline(always)]
    pub fn sums(self) -> bool {
        self.sums
    }

    /// Whether the compiler knows every place of the state.
    #[inline(always)]
    pub fn is_known(self) -> bool {
        self.small
    }

    /// The same where the compiler is to know nothing.
    #[inline(always)]
    pub fn of_any_size(self) -> Self {
        Self { small: false, ..self }
    }

    /// Length of the state.
    #[inline(always)]
    pub fn states(self) -> usize {
        if self.sums {
            self.layout.balance(BALANCE.len())
        } else {
            self.layout.states()
        }
    }

    #[inline(always)]
    fn gas(self, k: usize) -> usize {
        if self.small {
            0
        } else {
            k
        }
    }

    #[inline(always)]
    fn supply(self, k: usize) -> usize {
        if self.small {
            0
        } else {
            k
        }
    }
}

/// Values of the parameters of each lane.
struct Plants<'a, S: Simd, R: Registers> {
    simd: S,
    rig: &'a Rig,
    plan: &'a Plan,
    supplies: Vec<Supply<S, R>>,
    set_pressure: Vec<Num<S, R>>,
    fixed_volume: Vec<Num<S, R>>,
    /// Those of inflow and outflow times the gas constant and the temperature, that of the volume.
    alphas: Vec<[Num<S, R>; 3]>,
    valves: Vec<Valve<S, R>>,
    lines: Vec<Passage<S, R>>,
    /// Something may flow out of a supply in some lane.
    feeding: bool,
    scales: Vec<Num<S, R>>,
    /// Groups that come before all others of their chamber.
    first: Vec<bool>,
    body: Body<S, R>,
}

/// Room for what the equations write down: of each gas its volume, the rate of it, what flows in
/// and out; of each supply what is drawn, and the same while it is asked for.
struct Room<T> {
    volume: T,
    volume_rate: T,
    inflow: T,
    outflow: T,
    drawn: T,
    given: T,
}

/// Plants side by side and room for their equations.
pub(crate) struct Lanes<'a, S: Simd, R: Registers> {
    pub shape: Shape,
    plants: Plants<'a, S, R>,
    room: Room<Vec<Num<S, R>>>,
    /// Pressure of each supply where the step began, and the logarithm of it over the ambient one.
    logs: Vec<[Num<S, R>; 2]>,
}

impl<'a, S: Simd, R: Registers> Lanes<'a, S, R> {
    /// One lane for each plant of a rig that the plan is for, one at least; the lanes that are left
    /// over are as the last of them.
    pub fn new(simd: S, plan: &'a Plan, plants: &[&Plant<'a, f64>], sums: bool) -> Self {
        let first_plant = plants[0];
        let rig = first_plant.rig();
        let zero = Num::splat(simd, 0.0);
        let each = |of: &dyn Fn(&Plant<'a, f64>) -> f64| {
            let mut values = [0.0; MOST_LANES];
            for (lane, value) in values.iter_mut().enumerate() {
                *value = of(plants[lane.min(plants.len() - 1)]);
            }
            Num::load(simd, &values[..side_by_side::<S, R>()])
        };
        let supplies =
            (0..first_plant.supplies.len()).map(|k| supply(k, first_plant, &each)).collect();
        let lines: Vec<_> =
            (0..first_plant.lines.len()).map(|k| passage(k, plan, first_plant, &each)).collect();
        let wiring = &rig.wiring;
        let valves = wiring.valves.iter().map(|valve| Valve {
            from: valve.from,
            to: valve.to,
            conductance: zero,
            fills: zero.less(zero),
            some_fill: false,
            some_vent: false,
        });
        let rt = rig.gas.gas_constant * rig.gas.temperature;
        let alphas = (0..first_plant.alphas.len()).map(|k| {
            [
                each(&|p| p.alphas[k].inflow * rt),
                each(&|p| p.alphas[k].outflow * rt),
                each(&|p| p.alphas[k].volume),
            ]
        });
        let layout = rig.layout;
        let zeros = |n: usize| vec![zero; n];
        let fixed_volume: Vec<Num<S, R>> =
            (0..layout.gases).map(|k| each(&|p| p.fixed_volume[k])).collect();
        let room = Room {
            volume: fixed_volume.clone(),
            volume_rate: zeros(layout.gases),
            inflow: zeros(layout.gases),
            outflow: zeros(layout.gases),
            drawn: zeros(layout.supplies),
            given: zeros(layout.supplies),
        };
        let groups = wiring.groups.iter().enumerate();
        let first =
            groups.map(|(k, group)| wiring.groups[..k].iter().all(|g| g.chamber != group.chamber));
        let plants = Plants {
            supplies,
            set_pressure: zeros(layout.supplies),
            fixed_volume,
            alphas: alphas.collect(),
            valves: valves.collect(),
            feeding: !lines.is_empty(),
            lines,
            scales: (0..wiring.groups.len()).map(|k| each(&|p| p.scales[k])).collect(),
            first: first.collect(),
            body: body(plan, first_plant, &each),
            simd,
            rig,
            plan,
        };
        let logs = vec![[zero; 2]; layout.supplies];
        Self { shape: Shape { layout, sums, small: false }, plants, room, logs }
    }

    /// Openings of a valve over the sample that comes [m2], above zero where the chamber is filled,
    /// below where it is vented.
    pub fn open(&mut self, valve: usize, areas: &[f64]) {
        let (signed, plan) = (Num::load(self.plants.simd, areas), self.plants.plan);
        let valve = &mut self.plants.valves[valve];
        valve.fills = signed.constant(0.0).less(signed);
        valve.conductance = plan.orifice.conductance(signed.abs());
        valve.some_fill = areas.iter().any(|a| *a > 0.0);
        valve.some_vent = areas.iter().any(|a| *a < 0.0);
        let lines = !self.plants.lines.is_empty();
        self.plants.feeding = lines || self.plants.valves.iter().any(|valve| valve.some_fill);
    }

    /// Set pressure of a supply over the sample that comes [Pa, absolute].
    pub fn set(&mut self, supply: usize, pressures: &[f64]) {
        self.plants.set_pressure[supply] = Num::load(self.plants.simd, pressures);
    }

    /// Time derivative of the state of plants of a shape, given to `out` place by place; what each
    /// plant has columns of is worked out in registers of some width.
    #[inline(always)]
    pub fn rates<W: Simd>(
        &mut self,
        wide: W,
        shape: Shape,
        state: &[Num<S, R>],
        out: Slopes<'_, S, R>,
    ) {
        let Self { plants, room, logs, .. } = self;
        if shape.small {
            let zero = Num::splat(plants.simd, 0.0);
            let [mut volume, mut volume_rate, mut inflow] =
                [[plants.fixed_volume[0]], [zero], [zero]];
            let [mut outflow, mut drawn, mut given] = [[zero], [zero], [zero]];
            let room = Room {
                volume: &mut volume[..],
                volume_rate: &mut volume_rate[..],
                inflow: &mut inflow[..],
                outflow: &mut outflow[..],
                drawn: &mut drawn[..],
                given: &mut given[..],
            };
            plants.rates(wide, shape, state, room, &mut logs[..1], out);
            return;
        }
        let room = Room {
            volume: &mut room.volume[..],
            volume_rate: &mut room.volume_rate[..],
            inflow: &mut room.inflow[..],
            outflow: &mut room.outflow[..],
            drawn: &mut room.drawn[..],
            given: &mut room.given[..],
        };
        plants.rates(wide, shape, state, room, logs, out);
    }
}

type Here<'r, S, R> = Room<&'r mut [Num<S, R>]>;

impl<S: Simd, R: Registers> Plants<'_, S, R> {
    #[inline(always)]
    fn pressure_at(&self, shape: Shape, node: Node, state: &[Num<S, R>]) -> Num<S, R> {
        match node {
            Node::Ambient => Num::splat(self.simd, self.rig.gas.ambient_pressure),
            Node::Supply(k) => state[shape.layout.supply(shape.supply(k))],
            Node::Gas(k) => state[shape.layout.pressure(shape.gas(k))],
        }
    }

    #[inline(always)]
    fn rates<W: Simd>(
        &self,
        wide: W,
        shape: Shape,
        state: &[Num<S, R>],
        mut here: Here<'_, S, R>,
        logs: &mut [[Num<S, R>; 2]],
        mut out: Slopes<'_, S, R>,
    ) {
        let layout = shape.layout;
        let (torque, muscle_work) = self.mechanics(wide, shape, state, &mut here);
        let vented = self.flows(shape, state, &mut here);
        self.gas_rates(shape, state, &mut here, &mut out);
        let (angle, rate) = (state[layout.angle(0)], state[layout.rate(0)]);
        out.set(layout.angle(0), rate);
        out.set(layout.rate(0), self.body.acceleration(angle, rate, torque));
        if shape.sums {
            let work = (torque * rate).or_above(rate.constant(0.0));
            let summed = [vented, muscle_work, work];
            self.balances(layout, state, here.given, summed, logs, out);
        }
    }

    /// Volumes and their rates; torque, and power of the muscles.
    #[inline(always)]
    fn mechanics<W: Simd>(
        &self,
        wide: W,
        shape: Shape,
        state: &[Num<S, R>],
        here: &mut Here<'_, S, R>,
    ) -> (Num<S, R>, Num<S, R>) {
        let zero = Num::splat(self.simd, 0.0);
        let (mut torque, mut work) = (zero, zero);
        let ambient = self.rig.gas.ambient_pressure;
        // A plan has one coordinate.
        let (angle, rate) = (state[shape.layout.angle(0)], state[shape.layout.rate(0)]);
        let groups = self.rig.wiring.groups.iter().zip(&self.plan.curves);
        for ((group, curves), (scale, first)) in groups.zip(self.scales.iter().zip(&self.first)) {
            let (gas, scale) = (shape.gas(group.chamber), *scale);
            let gauge = state[shape.layout.pressure(gas)] - ambient;
            let [pull, elastic, offset, volume, slope, pull_work, elastic_work, offset_work] =
                curves.eval(wide, self.simd, angle);
            let wall = gauge.times_plus(elastic, offset);
            let slack = curves.pulls.map(|pulls| {
                let own = scale.times_plus(wall, gauge * pull);
                match pulls {
                    Sign::Raises => own.less(zero),
                    Sign::Lowers => zero.less(own),
                }
            });
            let before = torque;
            torque = scale.times_plus(wall, gauge.times_plus(pull, torque));
            if let Some(slack) = &slack {
                torque = slack.select(before, torque);
            }
            if shape.sums {
                let wall = gauge.times_plus(elastic_work, offset_work);
                let before = work;
                work = scale.times_plus(wall, gauge * pull_work).times_plus(rate, work);
                if let Some(slack) = &slack {
                    work = slack.select(before, work);
                }
            }
            let (before, moved) = match first {
                true => (self.fixed_volume[gas], zero),
                false => (here.volume[gas], here.volume_rate[gas]),
            };
            here.volume[gas] = before + volume;
            here.volume_rate[gas] = slope.times_plus(rate, moved);
        }
        (torque, work)
    }

    /// What flows into and out of each gas and out of each supply, which were at zero; what is
    /// vented.
    #[inline(always)]
    fn flows(&self, shape: Shape, state: &[Num<S, R>], here: &mut Here<'_, S, R>) -> Num<S, R> {
        let zero = Num::splat(self.simd, 0.0);
        let mut vented = zero;
        let ambient = Num::splat(self.simd, self.rig.gas.ambient_pressure);
        for Valve { from, to, conductance, fills, some_fill, some_vent } in &self.valves {
            if !(*some_fill || *some_vent) {
                continue;
            }
            let chamber = state[shape.layout.pressure(shape.gas(*to))];
            // A lane that is closed passes nothing, whatever it lies between.
            let feed = self.pressure_at(shape, *from, state);
            let (upstream, downstream) = match (*some_fill, *some_vent) {
                (true, true) => (fills.select(feed, chamber), fills.select(chamber, ambient)),
                (true, false) => (feed, chamber),
                (false, _) => (chamber, ambient),
            };
            let flow = self.plan.orifice.mass_flow(*conductance, upstream, downstream);
            let (filling, venting) = match (*some_fill, *some_vent) {
                (true, true) => (fills.select(flow, zero), fills.select(zero, flow)),
                _ => (flow, flow),
            };
            if *some_fill {
                here.pass(shape, *from, Node::Gas(*to), filling, &mut vented);
            }
            if *some_vent {
                here.pass(shape, Node::Gas(*to), Node::Ambient, venting, &mut vented);
            }
        }
        for (unit, line) in self.rig.wiring.lines.iter().zip(&self.lines) {
            let from = self.pressure_at(shape, unit.from, state);
            let to = self.pressure_at(shape, unit.to, state);
            let flow = match line {
                Passage::Orifice(conductance) => {
                    self.plan.orifice.mass_flow(*conductance, from, to)
                }
                Passage::Tube(tube) => tube.mass_flow(from, to),
            };
            here.pass(shape, unit.from, unit.to, flow, &mut vented);
        }
        vented
    }

    /// Rates of pressures and masses; the flows go back to zero.
    #[inline(always)]
    fn gas_rates(
        &self,
        shape: Shape,
        state: &[Num<S, R>],
        here: &mut Here<'_, S, R>,
        out: &mut Slopes<'_, S, R>,
    ) {
        let layout = shape.layout;
        let zero = Num::splat(self.simd, 0.0);
        for k in 0..layout.supplies {
            let pressure = state[layout.supply(k)];
            here.given[k] = std::mem::replace(&mut here.drawn[k], zero);
            let set = self.set_pressure[k];
            let rate = self.supplies[k].pressure_rate(pressure, here.given[k], set);
            out.set(layout.supply(k), rate);
        }
        for k in 0..layout.gases {
            let [alpha_in, alpha_out, alpha] = self.alphas[k];
            let pressure = state[layout.pressure(k)];
            let inflow = std::mem::replace(&mut here.inflow[k], zero);
            let outflow = std::mem::replace(&mut here.outflow[k], zero);
            if shape.sums {
                out.gather(layout.mass(k), inflow - outflow);
            }
            // The volume is known before the flows.
            let per_volume = here.volume[k].constant(1.0) / here.volume[k];
            let squeezed = (alpha * pressure) * here.volume_rate[k];
            let filled = alpha_in.times_plus(inflow, -squeezed);
            out.set(layout.pressure(k), alpha_out.times_from(outflow, filled) * per_volume);
        }
    }

    /// Rates of the sums of [`crate::plant::BALANCE`].
    #[inline(always)]
    fn balances(
        &self,
        layout: Layout,
        state: &[Num<S, R>],
        given: &[Num<S, R>],
        [mut vented, muscle_work, work]: [Num<S, R>; 3],
        logs: &mut [[Num<S, R>; 2]],
        mut out: Slopes<'_, S, R>,
    ) {
        let gas = &self.rig.gas;
        let rt = gas.gas_constant * gas.temperature;
        let zero = Num::splat(self.simd, 0.0);
        let (mut drawn, mut exergy) = (zero, zero);
        for (k, (flow, known)) in given.iter().zip(logs).enumerate() {
            if !self.feeding {
                break; // the logarithm is dear
            }
            let mut taken = *flow;
            if matches!(self.supplies[k], Supply::Regulator { .. }) {
                // A regulator relieves to the ambient what it takes back.
                let back = flow.less(zero);
                vented = vented - back.select(*flow, zero);
                taken = back.select(zero, *flow);
            }
            drawn += taken;
            let pressure = state[layout.supply(k)];
            if out.first {
                *known = [pressure, (pressure / gas.ambient_pressure).ln()];
            }
            let [before, log] = *known;
            let log = match out.first {
                true => log,
                false => pressure.ln_near(before, log, gas.ambient_pressure),
            };
            exergy = (log * taken).times_plus(rt, exergy);
        }
        let sums = [drawn, vented, drawn * rt, exergy, muscle_work, work];
        for (k, sum) in sums.into_iter().enumerate() {
            out.gather(layout.balance(k), sum);
        }
    }
}

impl<S: Simd, R: Registers> Here<'_, S, R> {
    /// A mass flow along the arrow; what goes against it goes out of its end.
    #[inline(always)]
    fn pass(
        &mut self,
        shape: Shape,
        from: Node,
        to: Node,
        flow: Num<S, R>,
        vented: &mut Num<S, R>,
    ) {
        let zero = flow.constant(0.0);
        let (along, against) = (flow.or_above(zero), (-flow).or_above(zero));
        self.exchange(shape, from, [along, against, flow], vented);
        self.exchange(shape, to, [against, along, -flow], vented);
    }

    /// What leaves a node, what comes to it, and the difference.
    #[inline(always)]
    fn exchange(
        &mut self,
        shape: Shape,
        node: Node,
        [leaves, comes, net]: [Num<S, R>; 3],
        vented: &mut Num<S, R>,
    ) {
        match node {
            Node::Ambient => *vented = *vented - net,
            Node::Supply(k) => self.drawn[shape.supply(k)] += net,
            Node::Gas(k) => {
                self.outflow[shape.gas(k)] += leaves;
                self.inflow[shape.gas(k)] += comes;
            }
        }
    }
}

type Each<'e, 'a, S, R> = &'e dyn Fn(&dyn Fn(&Plant<'a, f64>) -> f64) -> Num<S, R>;

fn supply<'a, S: Simd, R: Registers>(
    k: usize,
    first: &Plant<'a, f64>,
    each: Each<'_, 'a, S, R>,
) -> Supply<S, R> {
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

fn passage<'a, S: Simd, R: Registers>(
    k: usize,
    plan: &Plan,
    first: &Plant<'a, f64>,
    each: Each<'_, 'a, S, R>,
) -> Passage<S, R> {
    let of = |number: fn(&Line<f64>) -> f64| each(&|p| number(&p.lines[k]));
    match first.lines[k] {
        Line::Orifice(_) => Passage::Orifice(plan.orifice.conductance(of(|line| match line {
            Line::Orifice(area) => *area,
            Line::Tube(_) => f64::NAN,
        }))),
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
fn body<'a, S: Simd, R: Registers>(
    plan: &Plan,
    first: &Plant<'a, f64>,
    each: Each<'_, 'a, S, R>,
) -> Body<S, R> {
    let (turns, coulomb_speed, stops) = match &first.body {
        OneBody::OneLink(arm, stops) => (plan.turns(), arm.coulomb_speed, *stops),
        OneBody::Mass(load, stops) => (Turns::Not, load.coulomb_speed, *stops),
        _ => (Turns::Not, f64::NAN, None),
    };
    let of = |number: fn(&OneBody<f64>) -> [f64; 7], k: usize| each(&|p| number(&p.body)[k]);
    let numbers = |body: &OneBody<f64>| match body {
        OneBody::OneLink(arm, _) => {
            let (weight, tilt) = match arm.weights() {
                [level, 0.0] => (level, 0.0),
                [level, side] => (level.hypot(side), side.atan2(level)),
            };
            let Spring { stiffness, angle } = arm.spring;
            [1.0 / arm.total_inertia(), weight, arm.viscous, arm.coulomb, stiffness, angle, tilt]
        }
        OneBody::Mass(load, _) => {
            let weight = load.mass * load.gravity;
            [1.0 / load.mass, weight, load.viscous, load.coulomb, 0.0, 0.0, 0.0]
        }
        _ => [f64::NAN; 7],
    };
    let (coulomb, stiffness, tilt) = (of(numbers, 3), of(numbers, 4), of(numbers, 6));
    let some = |numbers: &Num<S, R>| numbers.numbers().iter().any(|number| *number != 0.0);
    Body {
        mobility: of(numbers, 0),
        weight: of(numbers, 1),
        turns,
        tilted: some(&tilt),
        tilt,
        viscous: of(numbers, 2),
        coulomb,
        rubs: some(&coulomb),
        coulomb_slope: 1.0 / coulomb_speed,
        stops,
        spring: [stiffness, of(numbers, 5)],
        springs: some(&stiffness),
    }
}

/// Opening of a valve at a spool position [m2], below zero where it vents.
#[inline(always)]
pub(crate) fn opening(plant: &Plant<'_, f64>, valve: usize, spool: f64) -> f64 {
    if spool == 0.0 {
        return 0.0; // neither, whatever its table begins with
    }
    let table = &plant.rig().wiring.valves[valve].table;
    match plant.valves[valve].paths[0] {
        Opening::Area(area) => area * table.eval(spool.abs()) * spool.signum(),
        Opening::Conductance(_) => 0.0, // no such rig is planned in lanes
    }
}
