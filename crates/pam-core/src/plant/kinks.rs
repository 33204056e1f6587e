//! Sensitivities where the rate of a volume jumps.
//!
//! A muscle's volume has a kink at its rest length and where its braid becomes taut. The pressure
//! follows the rate of the volume, so that a muscle which is a little longer meets the jump a little
//! sooner, and has worked under the new rate for that time: `-alpha P (V'_after - V'_before) de/V`.
//! No derivative on either side of the kink knows it: S. Galán, W. F. Feehery & P. I. Barton,
//! *Parametric sensitivity functions for hybrid discrete/continuous systems*, Applied Numerical
//! Mathematics 31 (1999).

use super::rates::{Plant, Simulated};
use crate::blocks::chamber::{pressure_rate, ChamberState};
use crate::scalar::{constant, Scalar};

impl<S: Scalar> Plant<'_, S> {
    /// Whether a step has to ask: sensitivities are wanted of a gas, and the volume of some muscle
    /// has a kink.
    pub fn asks_for_kinks(&self, simulated: &Simulated) -> bool {
        S::DERIVATIVES > 0
            && simulated.volumes()
            && self.wiring.groups.iter().any(|g| !g.muscle.table.volume_kinks().is_empty())
    }

    /// Contraction ratios of the muscles, without their derivatives.
    pub fn where_muscles_are(&self, state: &[S], out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.wiring.groups.iter().map(|group| {
            let angle = state[self.layout.angle(group.coordinate)].re();
            group.joint.eval(angle).shortening / group.rest_length
        }));
    }

    /// What the sensitivities of the gases gain by the kinks between the contraction ratios at which
    /// a step found the muscles and those at which it leaves them.
    pub fn pass_kinks(&self, from: &[f64], simulated: &Simulated, state: &mut [S]) {
        for (was, group) in from.iter().zip(&self.wiring.groups) {
            let angle = state[self.layout.angle(group.coordinate)];
            let now = group.joint.eval(angle.re()).shortening / group.rest_length;
            let jump: f64 = (group.muscle.table.volume_kinks().iter())
                .filter(|kink| (*was < kink.at) != (now < kink.at))
                .map(|kink| if *was < now { kink.jump } else { -kink.jump })
                .sum();
            let (gas, place) = (group.chamber, self.layout.pressure(group.chamber));
            if jump == 0.0 || !simulated.moves(place) {
                continue;
            }
            let later = group.joint.eval(angle).shortening / group.rest_length - now;
            let (pressure, mass) = self.swollen(gas, later * (jump * group.count), state);
            state[place] += pressure;
            if simulated.moves(self.layout.mass(gas)) {
                state[self.layout.mass(gas)] += mass;
            }
        }
    }

    /// Changes of a gas's pressure [Pa] and mass [kg] with a small change of its volume [m3].
    fn swollen(&self, gas: usize, change: S, state: &[S]) -> (S, S) {
        let zero = constant(0.0);
        let pressure = state[self.layout.pressure(gas)];
        let chamber = ChamberState {
            pressure,
            volume: self.volume(gas, state),
            volume_rate: change,
            inflow: zero,
            outflow: zero,
        };
        if self.walls[gas].is_some() {
            return (pressure * change * -self.rig.gas.gamma / chamber.volume, zero);
        }
        let fixed = pressure_rate(&chamber, &self.alphas[gas], 0.0);
        match &self.wiring.ports.balance[gas] {
            Some(acting) if self.altered.balances => {
                let mass = state[self.layout.mass(gas)];
                self.effect(acting).balance(&self.rig.gas, &chamber, zero, mass, fixed)
            }
            _ => (fixed, zero),
        }
    }
}
