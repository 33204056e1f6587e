//! Linear model of a rig about a state in which its valves hold their null and its regulators the
//! pressure that they have, by dual numbers through its equations.
//!
//! `x' = A x + B u, y = C x`. States are the pressures, angles and rates that an initial value can
//! be given for and, behind them, what effects move. What follows a small motion of a joint
//! ([`Role::Follows`]) is no state: it moves by its joint's angle. What a muscle remembers of its
//! way stays as it is, and its force changes with the stretch since then.
//!
//! Some things have a slope to each side. A valve fills on one side of its null and vents on the
//! other: its position is taken next to the null, where [`Side`] says. Air that rests may flow
//! either way, with other coefficients while it comes in than while it goes out, and a muscle at
//! ambient pressure may not feel a lower one: there the slope is the mean of both.

use super::memory::Memory;
use super::ports::Acting;
use super::rates::{Controls, Plant, Simulated};
use super::{Rig, StateRole};
use crate::blocks::valve::spool_position;
use crate::clock::Edge;
use crate::description::dotted;
use crate::dual::{Dual, LANES};
use crate::effects::{Role, BEGUN};
use crate::scalar::{constant, Scalar};
use crate::{Error, Result};

/// How far next to its null a valve is [1]: so near that no slope changes by more than 1e-7 of
/// itself, so far that what flows shows in the last digits of the pressure behind a hose.
const BESIDE: f64 = 1e-9;
/// How far on either side of their values pressures are [1], where the slope is the mean of both.
const ASIDE: f64 = 1e-9;

/// On which side of what has two slopes: position of the valves beside their null [1], shift of the
/// pressures of gases [1], and whether a flow that is none goes against its arrow.
#[derive(Clone, Copy)]
struct Beside {
    position: f64,
    shift: f64,
    backwards: bool,
}

/// Both sides of what rests.
const SHUT: [Beside; 2] = [
    Beside { position: 0.0, shift: ASIDE, backwards: false },
    Beside { position: 0.0, shift: -ASIDE, backwards: true },
];

/// The side of its null on which a valve opens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Above, where it fills.
    Fill,
    /// Below, where it vents.
    Vent,
    /// The mean of both.
    Mean,
}

impl Side {
    /// The side of a name.
    ///
    /// # Errors
    /// [`Error::Choice`] for another name.
    pub fn from_name(name: &str) -> Result<Self> {
        match name {
            "fill" => Ok(Self::Fill),
            "vent" => Ok(Self::Vent),
            "mean" => Ok(Self::Mean),
            _ => Err(Error::Choice {
                name: "side".into(),
                value: format!("\"{name}\""),
                allowed: "one of \"mean\", \"fill\", \"vent\"".into(),
            }),
        }
    }

    /// Where the slopes are taken whose mean is the slope by an opening.
    fn open(self) -> Vec<Beside> {
        let at = |position| Beside { position, shift: 0.0, backwards: false };
        match self {
            Self::Fill => vec![at(BESIDE)],
            Self::Vent => vec![at(-BESIDE)],
            Self::Mean => vec![at(BESIDE), at(-BESIDE)],
        }
    }
}

/// `x' = A x + B u, y = C x`, in SI; matrices row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel {
    /// States: first those that an initial value can be given for, then masses of gases with an
    /// energy balance, then what effects move, in the order in which the effects were given.
    pub states: Vec<String>,
    /// Commands of the valves, then of the regulators.
    pub inputs: Vec<String>,
    /// Readings of the states that an initial value can be given for.
    pub outputs: Vec<String>,
    /// `states x states`.
    pub a: Vec<f64>,
    /// `states x inputs`.
    pub b: Vec<f64>,
    /// `outputs x states`.
    pub c: Vec<f64>,
}

/// A state of the model.
struct Moving {
    name: String,
    place: usize,
    /// -1 where it is counted the other way round among the states of the rig.
    sign: f64,
    /// It moves an opening.
    opens: bool,
}

/// What a derivative is taken by.
#[derive(Clone, Copy)]
enum By {
    State(usize),
    Command(usize),
    /// What a supply is set to.
    Set(usize),
}

impl Rig {
    /// The linear model about a state, its valves at their null. For effects with a
    /// [`crate::effects::Kink`] it is not meaningful; what [`crate::effects::AtRest`] asks for must
    /// have been done.
    ///
    /// # Errors
    /// [`Error::Model`] where a derivative is not finite, or a valve switches.
    pub(crate) fn linearised(
        &self,
        state: &[f64],
        memory: &[Memory<f64>],
        side: Side,
    ) -> Result<LinearModel> {
        let switching = |valve: &usize| self.wiring.ports.switching[*valve].is_some();
        if let Some(valve) = (0..self.wiring.valves.len()).find(switching) {
            let name = dotted("valve", &self.spec().valves[valve].name);
            return Err(Error::Model(format!(
                "{name} switches, and what switches has no linear model"
            )));
        }
        let (moving, point) = (self.moving(), Point::new(self, state, memory));
        let commands = 0..self.wiring.valves.len();
        let opening = moving.iter().filter(|m| m.opens).map(|m| By::State(m.place));
        let opening: Vec<By> = opening.chain(commands.map(By::Command)).collect();
        let regulators = self.spec().supplies.iter().enumerate();
        let set = regulators.filter(|(_, s)| s.kind == "regulator").map(|(k, _)| By::Set(k));
        let shut = moving.iter().filter(|m| !m.opens).map(|m| By::State(m.place));
        let shut: Vec<By> = shut.chain(set).collect();
        let mut opened = point.mean_slopes(&opening, &side.open())?.into_iter();
        let mut others = point.mean_slopes(&shut, &SHUT)?.into_iter();
        let mut columns: Vec<Vec<f64>> = moving
            .iter()
            .filter_map(|m| if m.opens { opened.next() } else { others.next() })
            .collect();
        self.let_follow(&point, &moving, &mut columns)?;
        let (mut a, mut b) = (Vec::new(), Vec::new());
        let inputs: Vec<Vec<f64>> = opened.chain(others).collect();
        for row in &moving {
            // (a sum with zero has no negative one)
            a.extend(
                moving
                    .iter()
                    .zip(&columns)
                    .map(|(by, column)| row.sign * by.sign * column[row.place] + 0.0),
            );
            b.extend(inputs.iter().map(|column| row.sign * column[row.place] + 0.0));
            if a.iter().chain(&b).any(|slope| !slope.is_finite()) {
                let name = &row.name;
                return Err(Error::Model(format!(
                    "the rate of {name} has no finite slope: no linear model"
                )));
            }
        }
        let named = self.names.initial.len();
        let plant = Plant::new(self, self.parameters().lift::<f64>(), false)?;
        let c = (0..named).flat_map(|k| plant.reading_of(k, &moving, state)).collect();
        let inputs = self.names.inputs.clone();
        let outputs = self.names.initial.iter().map(|(name, _)| name.clone()).collect();
        Ok(LinearModel {
            states: moving.into_iter().map(|m| m.name).collect(),
            inputs,
            outputs,
            a,
            b,
            c,
        })
    }

    /// The states of the model.
    fn moving(&self) -> Vec<Moving> {
        let (layout, ports) = (&self.layout, &self.wiring.ports);
        let load = self.spec().load.is_some();
        let named = self.names.initial.iter().map(|(name, place)| Moving {
            name: name.clone(),
            place: *place,
            sign: if load && *place >= layout.angle(0) { -1.0 } else { 1.0 },
            opens: false,
        });
        let mut extra: Vec<(Option<usize>, Moving)> = Vec::new();
        for (place, state) in self.state_map().into_iter().enumerate() {
            let opens = state.role == StateRole::Effect(Role::Opens);
            let found = match state.role {
                StateRole::FreeMass => {
                    let gas = place - layout.mass(0);
                    let block = state.name.split_once('.').map_or("", |(_, block)| block);
                    Some(match ports.balance[gas] {
                        Some(acting) => {
                            let id = ports.effects[acting.effect].info.id;
                            (Some(acting.effect), dotted(&format!("{id}.air_mass"), block))
                        }
                        // of an energy balance of its own
                        None => (None, dotted("air_mass", block)),
                    })
                }
                StateRole::Effect(Role::Moves | Role::Opens) => {
                    let own = place - layout.effect(0);
                    let here = |acting: &Acting| {
                        (acting.first..acting.first + acting.count).contains(&own)
                    };
                    let acting =
                        ports.all.iter().map(|(_, acting)| acting).find(|acting| here(acting));
                    acting.map(|acting| (Some(acting.effect), state.name))
                }
                _ => None,
            };
            extra.extend(
                found.map(|(effect, name)| (effect, Moving { name, place, sign: 1.0, opens })),
            );
        }
        extra.sort_by_key(|(effect, _)| *effect);
        named.chain(extra.into_iter().map(|(_, moving)| moving)).collect()
    }

    /// Let what follows a joint move by its angle: its rate is a slope times the rate of the joint,
    /// and nothing else.
    fn let_follow(
        &self,
        point: &Point<'_>,
        moving: &[Moving],
        columns: &mut [Vec<f64>],
    ) -> Result<()> {
        let places = self.state_map().into_iter().enumerate();
        let following: Vec<usize> = places
            .filter(|(_, state)| state.role == StateRole::Effect(Role::Follows))
            .map(|(place, _)| place)
            .collect();
        let by: Vec<By> = following.iter().map(|place| By::State(*place)).collect();
        let slopes = point.mean_slopes(&by, &SHUT)?;
        let at = |place: usize| moving.iter().position(|m| m.place == place);
        for k in 0..self.layout.coordinates {
            let (Some(angle), Some(rate)) = (at(self.layout.angle(k)), at(self.layout.rate(k)))
            else {
                continue;
            };
            for (place, slope) in following.iter().zip(&slopes) {
                let follows = columns[rate][*place];
                for (entry, slope) in columns[angle].iter_mut().zip(slope) {
                    *entry += slope * follows;
                }
            }
        }
        Ok(())
    }
}

impl Plant<'_, f64> {
    /// What the sensor of a named state reads, by all states of the model, about a state of rest.
    fn reading_of(&self, named: usize, moving: &[Moving], state: &[f64]) -> Vec<f64> {
        let (layout, place) = (&self.layout, self.rig.names.initial[named].1);
        let gas = place.checked_sub(layout.pressure(0)).filter(|gas| *gas < layout.gases);
        let lagging = gas.and_then(|gas| self.wiring.ports.reading[gas]);
        let read = lagging.map_or(place, |acting| layout.effect(acting.first));
        let moves = place.checked_sub(layout.angle(0)).map(|k| k % layout.coordinates);
        let gain = moves.map_or(1.0, |k| self.encoder_gain(k, state[layout.angle(k)]));
        moving.iter().map(|m| if m.place == read { gain } else { 0.0 }).collect()
    }
}

/// What slopes are taken about.
struct Point<'a> {
    rig: &'a Rig,
    state: Vec<f64>,
    memory: Vec<Memory<Dual<LANES>>>,
}

impl<'a> Point<'a> {
    /// A state, the valves' paths having begun.
    fn new(rig: &'a Rig, state: &[f64], memory: &[Memory<f64>]) -> Self {
        let mut state = state[..rig.layout.states()].to_vec();
        for (value, place) in state.iter_mut().zip(rig.state_map()) {
            if place.role == StateRole::Effect(Role::Begun) {
                *value = BEGUN;
            }
        }
        Self { rig, state, memory: memory.iter().map(Memory::lift).collect() }
    }

    /// Slopes of the rates of all states, the mean over some sides.
    fn mean_slopes(&self, by: &[By], sides: &[Beside]) -> Result<Vec<Vec<f64>>> {
        let mut sums = vec![vec![0.0; self.state.len()]; by.len()];
        for beside in sides {
            for (chunk, sums) in by.chunks(LANES).zip(sums.chunks_mut(LANES)) {
                let rates = self.rates(chunk, *beside)?;
                for (k, rate) in rates.into_iter().enumerate() {
                    for ((by, sum), slope) in chunk.iter().zip(sums.iter_mut()).zip(rate.eps) {
                        // A command counts from the null: more of the one is less of the other.
                        let sign = if matches!(by, By::Command(_)) { -1.0 } else { 1.0 };
                        sum[k] += sign * slope / sides.len() as f64;
                    }
                }
            }
        }
        Ok(sums)
    }

    /// Rates of all states, each lane with the derivative by one thing.
    fn rates(&self, by: &[By], beside: Beside) -> Result<Vec<Dual<LANES>>> {
        let mut values = self.rig.parameters().lift::<Dual<LANES>>();
        let layout = &self.rig.layout;
        let gases = layout.pressure(0)..layout.mass(0);
        let shifted = |(place, x): (usize, &f64)| {
            constant(if gases.contains(&place) { x * (1.0 + beside.shift) } else { *x })
        };
        let mut state: Vec<Dual<LANES>> = self.state.iter().enumerate().map(shifted).collect();
        let mut set: Vec<Dual<LANES>> = (0..self.rig.spec().supplies.len())
            .map(|k| constant(state[layout.supply(k)].re()))
            .collect();
        for (lane, by) in by.iter().enumerate() {
            match *by {
                By::State(place) => state[place] = state[place].along(lane),
                By::Command(valve) => values.seed(self.rig.wiring.valves[valve].null, lane),
                By::Set(supply) => set[supply] = set[supply].along(lane),
            }
        }
        let plant = Plant::new(self.rig, values, false)?;
        // What a muscle remembers does not move with the state.
        let still: Vec<Dual<LANES>> = self.state.iter().map(|x| constant(*x)).collect();
        let mut start = vec![constant(0.0); self.memory.len()];
        plant.contractions(&still, &mut start);
        Ok(plant.rates_beside(&state, &self.memory, &start, beside, &set))
    }
}

impl<S: Scalar> Plant<'_, S> {
    /// Rates of all states at the start of a recording, with what effects move in closed form.
    fn rates_beside(
        &self,
        state: &[S],
        memory: &[Memory<S>],
        start: &[S],
        beside: Beside,
        set: &[S],
    ) -> Vec<S> {
        let (wiring, layout) = (&self.rig.wiring, &self.layout);
        let mut closed: Vec<(&Acting, S)> = Vec::new();
        let mut controls = self.held(set);
        for (k, path) in wiring.ports.command.iter().enumerate() {
            let null = self.valves[k].null;
            let mut spool =
                spool_position(null.re(), null, wiring.valves[k].half_range) + beside.position;
            for acting in path {
                closed.push((acting, spool));
                spool = self.effect(acting).position(self.own(acting, state), spool, 0.0)
                    + beside.position;
            }
            controls.spool[k] = spool;
        }
        for (gas, acting) in wiring.ports.reading.iter().enumerate() {
            closed.extend(acting.as_ref().map(|acting| (acting, state[layout.pressure(gas)])));
        }
        for (gas, acting) in wiring.ports.thermometer.iter().enumerate() {
            closed.extend(acting.as_ref().map(|acting| (acting, self.temperature(gas, state))));
        }
        let mut rates = vec![constant(0.0); layout.states()];
        let mut here = self.scratch();
        here.backwards = beside.backwards;
        let all = Simulated::all_but(self.rig, &[]);
        self.rates(state, &controls, memory, start, &all, &mut here, &mut rates);
        for (acting, input) in closed {
            self.effect(acting).linear_rates(
                self.own(acting, state),
                input,
                self.own_mut(acting, &mut rates),
            );
        }
        rates
    }

    /// Controls with every valve shut and every supply set to a pressure, at the start of a
    /// recording.
    fn held(&self, set: &[S]) -> Controls<S> {
        Controls {
            spool: vec![constant(0.0); self.valves.len()],
            edges: Vec::new(),
            set_pressure: set.iter().map(|pressure| Edge::steady(*pressure)).collect(),
            time: 0.0,
        }
    }
}
