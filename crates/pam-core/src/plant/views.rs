//! What effects see of the blocks that they act on, and the rates and beginnings of their states.

use super::ports::{Acting, Place};
use super::rates::{Controls, Plant, Scratch, Simulated};
use super::units::Node;
use crate::effects::{At, Port, BAR};
use crate::scalar::{constant, Scalar};

/// Steps to where what gives is at rest with its muscle: a secant needs a dozen, halves 50.
const APPROACHES: usize = 60;
/// Least difference of two stretches that tells how the pull falls with it [m].
const TELLING: f64 = 1e-9;
/// Times that effects start, where what they remember and what gives depend on each other.
const ROUNDS: usize = 4;

impl<S: Scalar> Plant<'_, S> {
    /// A supply or a gas.
    pub(super) fn at_node(
        &self,
        node: Node,
        state: &[S],
        controls: &Controls<S>,
        here: &Scratch<S>,
    ) -> At<S> {
        match node {
            Node::Supply(k) => self.at_supply(k, state, &controls.spool),
            Node::Gas(k) => self.at_chamber(k, state, &controls.spool, here.volume_rate[k]),
            Node::Ambient => At::Valve { fed: constant(self.rig.gas.ambient_pressure) },
        }
    }

    fn at_supply(&self, supply: usize, state: &[S], spool: &[S]) -> At<S> {
        let mut opening = constant::<S>(0.0);
        for (_, spool) in
            self.wiring.valves.iter().zip(spool).filter(|(v, _)| v.from == Node::Supply(supply))
        {
            if spool.re() > 0.0 {
                opening += *spool;
            }
        }
        At::Supply { pressure: state[self.layout.supply(supply)], opening }
    }

    pub(super) fn at_chamber(&self, gas: usize, state: &[S], spool: &[S], volume_rate: S) -> At<S> {
        let (layout, wiring) = (&self.layout, &self.wiring);
        let pressure = state[layout.pressure(gas)];
        let (mut opening, mut supply) = (constant::<S>(0.0), pressure);
        for (unit, spool) in wiring.valves.iter().zip(spool) {
            // Through the line that begins at the valve, if there is one.
            let end = unit.to.checked_sub(wiring.chambers).and_then(|k| wiring.inlets.get(k));
            if unit.to == gas || end.is_some_and(|(_, end)| *end == Node::Gas(gas)) {
                opening += *spool;
                supply = unit.from.place(layout).map_or(supply, |place| state[place]);
            }
        }
        At::Chamber { pressure, supply, opening, volume_rate }
    }

    /// A joint under a load [N m].
    pub(super) fn at_joint(&self, coordinate: usize, state: &[S], load: S) -> At<S> {
        let layout = &self.layout;
        let mut pressure = constant::<S>(0.0);
        let mut groups = 0.0;
        for group in self.wiring.groups.iter().filter(|g| g.coordinate == coordinate) {
            pressure +=
                (state[layout.pressure(group.chamber)] - self.rig.gas.ambient_pressure) / BAR;
            groups += 1.0;
        }
        At::Joint {
            pressure: if groups > 1.0 { pressure / groups } else { pressure },
            angle: state[layout.angle(coordinate)],
            rate: state[layout.rate(coordinate)],
            load,
        }
    }

    /// The block that an effect acts on, with the openings of the valves and what the equations wrote
    /// down on the way.
    fn at(
        &self,
        place: Place,
        acting: &Acting,
        state: &[S],
        spool: &[S],
        here: &Scratch<S>,
    ) -> At<S> {
        match place {
            Place::Supply(k) => self.at_supply(k, state, spool),
            Place::Valve(k) => {
                At::Valve { fed: state[self.layout.pressure(self.wiring.valves[k].to)] }
            }
            Place::Line(k) => At::Valve { fed: self.pressure_at(self.wiring.lines[k].to, state) },
            Place::Gas(k) => self.at_chamber(k, state, spool, here.volume_rate[k]),
            Place::Group(k) => At::Muscle(self.at_felt(k, acting, state, &here.felt)),
            Place::Joint(k) => self.at_joint(k, state, here.load[k]),
            Place::Whole => {
                let angles = &state[self.layout.angle(0)..self.layout.rate(0)];
                At::Arm { weight: self.body.weight(angles) }
            }
        }
    }

    /// Rates of the states of effects at the air, the muscles and the joints; of the rest, and of
    /// what is driven, zero.
    #[inline(never)]
    pub(super) fn effect_rates(
        &self,
        state: &[S],
        controls: &Controls<S>,
        simulated: &Simulated,
        here: &Scratch<S>,
        out: &mut [S],
    ) {
        let layout = &self.layout;
        out[layout.effect(0)..layout.states()].fill(constant(0.0));
        let moving =
            |acting: &Acting| acting.count > 0 && simulated.moves(layout.effect(acting.first));
        for (place, acting) in self.wiring.ports.integrated().filter(|(_, a)| moving(a)) {
            let at = self.at(place, &acting, state, &controls.spool, here);
            self.effect(&acting).rates(&at, self.own(&acting, state), self.own_mut(&acting, out));
        }
    }

    /// What effects remember, and the masses of the gases, where a recording begins: nothing has
    /// moved for long, valves are shut.
    pub fn start(&self, state: &mut [S]) {
        if self.altered.gives {
            // the gases have the volumes of muscles that gave
            (1..ROUNDS).for_each(|_| self.start_effects(state));
        }
        for gas in 0..self.layout.gases {
            state[self.layout.mass(gas)] = self.initial_mass(gas, state);
        }
        self.start_effects(state);
    }

    fn start_effects(&self, state: &mut [S]) {
        let wiring = &self.wiring;
        let shut = vec![constant(0.0); wiring.valves.len()];
        let mut here = self.scratch();
        for (place, acting) in wiring.ports.all.iter().filter(|(_, acting)| acting.count > 0) {
            if wiring.ports.effects[acting.effect].form.ports.contains(&Port::Give) {
                self.settle(*place, acting, state, &shut, &mut here);
                continue;
            }
            if matches!(place, Place::Group(_)) {
                self.mechanics_at_rest(state, &mut here); // with what acts before it
            }
            let at = self.at(*place, acting, state, &shut, &here);
            self.effect(acting).start(&self.rig.gas, &at, self.own_mut(acting, state));
        }
        for gas in 0..self.layout.gases {
            if let Some((reading, _)) = self.lagging(gas) {
                state[reading] = state[self.layout.pressure(gas)];
            }
            if let Some((reading, _)) = self.thermometer(gas) {
                state[reading] = self.temperature(gas, state);
            }
        }
    }

    /// Let what gives come to rest under a pull that falls with its stretch: a secant between
    /// bounds, its slope a plain number, which brings the derivatives to rest as well.
    fn settle(
        &self,
        place: Place,
        acting: &Acting,
        state: &mut [S],
        shut: &[S],
        here: &mut Scratch<S>,
    ) {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let (mut steepness, mut last) = (1.0, None);
        for _ in 0..APPROACHES {
            self.mechanics_at_rest(state, here);
            let at = self.at(place, acting, state, shut, here);
            let now = self.own(acting, state)[0];
            let mut rest = [now];
            self.effect(acting).start(&self.rig.gas, &at, &mut rest);
            let gap = rest[0] - now;
            let (s, g) = (now.re(), gap.re());
            (low, high) = if g < 0.0 { (low, s) } else { (s, high) };
            if let Some((s_last, g_last)) = last.replace((s, g)) {
                if f64::abs(s - s_last) > TELLING {
                    steepness = f64::max(1.0, (g_last - g) / (s - s_last));
                }
            }
            let next = now + gap / steepness;
            let inside = low <= next.re() && next.re() <= high;
            let middle = 0.5 * (low + high);
            self.own_mut(acting, state)[0] = if inside { next } else { now + (middle - s) };
        }
    }

    /// Terms of the first sum of terms that acts on a block, at an instant; empty where there is
    /// none.
    pub(crate) fn terms(
        &self,
        place: Place,
        state: &[S],
        controls: &Controls<S>,
        here: &Scratch<S>,
    ) -> Vec<S> {
        let ports = &self.wiring.ports;
        let unnamed = |effect: usize| !ports.effects[effect].info.named;
        match ports.all.iter().find(|(at, acting)| *at == place && unnamed(acting.effect)) {
            Some((_, acting)) => {
                let at = self.at(place, acting, state, &controls.spool, here);
                self.effect(acting).terms(&at, self.own(acting, state))
            }
            None => Vec::new(),
        }
    }
}
