//! Sensitivities where the rate of a volume jumps.
//!
//! A muscle's volume has a kink at its rest length and where its braid becomes taut. The pressure
//! follows the rate of the volume, so that a muscle which is a little longer meets the jump a little
//! sooner, and has worked under the new rate for that time: `-alpha P (V'_after - V'_before) de/V`.
//! No derivative on either side of the kink knows it: S. Galán, W. F. Feehery & P. I. Barton,
//! *Parametric sensitivity functions for hybrid discrete/continuous systems*, Applied Numerical
//! Mathematics 31 (1999).

use super::ports::Flow;
use super::rates::{Controls, Plant, Scratch, Simulated};
use super::units::Node;
use crate::blocks::chamber::{energy_rate, pressure_rate, ChamberState};
use crate::scalar::{constant, Scalar};

impl<S: Scalar> Plant<'_, S> {
    /// Whether a step has to ask: sensitivities are wanted of a gas that is integrated, and the
    /// volume of one of its muscles has a kink.
    pub fn asks_for_kinks(&self, simulated: &Simulated) -> bool {
        S::DERIVATIVES > 0
            && self.wiring.groups.iter().any(|group| {
                !group.muscle.table.volume_kinks().is_empty()
                    && simulated.moves(self.layout.pressure(group.chamber))
            })
    }

    /// Contraction ratios of the muscles, without their derivatives.
    pub fn where_muscles_are(&self, state: &[S], out: &mut Vec<f64>) {
        out.clear();
        out.extend((0..self.wiring.groups.len()).map(|k| self.contraction_now(k, state)));
    }

    /// What the sensitivities of the gases gain by the kinks between the contraction ratios at which
    /// a step found the muscles and those at which it leaves them.
    pub fn pass_kinks(
        &self,
        from: &[f64],
        simulated: &Simulated,
        controls: &Controls<S>,
        here: &Scratch<S>,
        state: &mut [S],
    ) {
        for (k, (was, group)) in from.iter().zip(&self.wiring.groups).enumerate() {
            let now = self.contraction_now(k, state);
            let jump: f64 = (group.muscle.table.volume_kinks().iter())
                .filter(|kink| (*was < kink.at) != (now < kink.at))
                .map(|kink| if *was < now { kink.jump } else { -kink.jump })
                .sum();
            let (gas, place) = (group.chamber, self.layout.pressure(group.chamber));
            if jump == 0.0 || !simulated.moves(place) {
                continue;
            }
            let change = (self.contraction(k, state) - now) * (jump * group.count);
            let (pressure, mass) = self.swollen(gas, change, state, controls, here);
            state[place] += pressure;
            if simulated.moves(self.layout.mass(gas)) {
                state[self.layout.mass(gas)] += mass;
            }
        }
    }

    /// Changes of a gas's pressure [Pa] and mass [kg] with a small change of its volume [m3].
    fn swollen(
        &self,
        gas: usize,
        change: S,
        state: &[S],
        controls: &Controls<S>,
        here: &Scratch<S>,
    ) -> (S, S) {
        let (zero, rest) = (constant(0.0), self.rig.gas.temperature);
        let [inflow, outflow] = self.drawn_by_volume(gas, change, state, controls, here);
        let chamber = ChamberState {
            pressure: state[self.layout.pressure(gas)],
            volume: self.volume(gas, state),
            volume_rate: change,
            inflow,
            outflow,
        };
        let mass = inflow - outflow;
        if self.walls[gas].is_some() {
            let temperature = self.temperature(gas, state);
            let carried = inflow * rest;
            return (energy_rate(&self.rig.gas, &chamber, carried, temperature, zero), mass);
        }
        let fixed = pressure_rate(&chamber, &self.alphas[gas], self.rig.gas.gas_constant * rest);
        match &self.wiring.ports.balance[gas] {
            Some(acting) if self.altered.balances => {
                let own = state[self.layout.mass(gas)];
                let effect = self.effect(acting);
                let (pressure, more) = effect.balance(&self.rig.gas, &chamber, zero, own, fixed);
                (pressure, mass + more)
            }
            _ => (fixed, mass),
        }
    }

    /// What flows of effects that follow the rate of the volume bring into a gas and take out of it
    /// [kg], with a small change of its volume [m3].
    fn drawn_by_volume(
        &self,
        gas: usize,
        change: S,
        state: &[S],
        controls: &Controls<S>,
        here: &Scratch<S>,
    ) -> [S; 2] {
        let mut drawn = [constant(0.0); 2];
        for (flow, acting) in &self.wiring.ports.flows {
            if !matches!(flow, Flow::Inflow(Node::Gas(k)) if *k == gas) {
                continue;
            }
            let rate = here.volume_rate[gas];
            let [now, then] = [rate, rate + change].map(|rate| {
                let at = self.at_chamber(gas, state, &controls.spool, rate);
                self.effect(acting).inflow(&at, self.own(acting, state))
            });
            let more = then - now;
            match now.re() < 0.0 {
                false => drawn[0] += more,
                true => drawn[1] -= more,
            }
        }
        drawn
    }
}
