//! Where the transducer of a gas sits: at the gas, or in front of the tube through which a valve
//! feeds it.

use super::ports::Acting;
use super::rates::{Controls, Plant};
use crate::blocks::valve::Opening;
use crate::scalar::{constant, Scalar};

impl<S: Scalar> Plant<'_, S> {
    /// Gases whose transducers sit at the valve's end of what it feeds them through, with the
    /// valves there.
    pub fn taps(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..self.layout.gases).filter_map(|gas| self.tap(gas).map(|(valve, _)| (gas, valve)))
    }

    /// The valve in front of a gas at which its transducer sits, and what is between them.
    fn tap(&self, gas: usize) -> Option<(usize, &Acting)> {
        let (valve, acting) = self.wiring.ports.tap[gas].as_ref()?;
        self.effect(acting).taps().then_some((*valve, acting))
    }

    /// Place of what the sensor of a gas reads.
    pub fn reading(&self, gas: usize) -> usize {
        let lag = self.wiring.ports.reading[gas].as_ref();
        let acting = lag.or(self.tap(gas).map(|(_, acting)| acting));
        acting.map_or(self.layout.pressure(gas), |acting| self.layout.effect(acting.first))
    }

    /// Place of the reading of a sensor that lags, and how far it does [s]; None for one that does
    /// not.
    pub fn lagging(&self, gas: usize) -> Option<(usize, S)> {
        self.lag_of(self.wiring.ports.reading[gas].as_ref())
    }

    /// Place of the reading of a thermometer that lags, and how far it does [s]; None for one that
    /// does not.
    pub fn thermometer(&self, gas: usize) -> Option<(usize, S)> {
        self.lag_of(self.wiring.ports.thermometer[gas].as_ref())
    }

    fn lag_of(&self, sensor: Option<&Acting>) -> Option<(usize, S)> {
        let acting = sensor?;
        Some((self.layout.effect(acting.first), self.effect(acting).lag()))
    }

    /// What the gauge of a gas reads too much at a time [Pa]; None where it always reads the same.
    #[inline]
    pub fn gauge_drift(&self, gas: usize, time: f64) -> Option<S> {
        self.wiring.ports.gauge_zero[gas].as_ref().map(|acting| self.effect(acting).drift(time))
    }

    /// What a load cell reads of a pull at a time [N], or the sensor of a joint's torque [N m].
    #[inline]
    pub fn at_cell(&self, pull: S, time: f64) -> S {
        let read = self.at_gain(pull);
        let drift = self.wiring.ports.cell_zero.as_ref();
        drift.map_or(read, |acting| read + self.effect(acting).drift(time))
    }

    /// The same of a muscle among others on a load: their cell drifts once.
    #[inline]
    pub fn at_gain(&self, pull: S) -> S {
        self.wiring.force_gain.map_or(pull, |id| self.values[id] * pull)
    }

    /// Write the pressures between valves and tubes, where sensors sit there: those of a state, its
    /// commands held.
    pub fn read_taps(&self, state: &mut [S], controls: &Controls<S>) {
        for gas in 0..self.layout.gases {
            if let Some((_, acting)) = self.tap(gas) {
                state[self.layout.effect(acting.first)] = self.at_sensor(gas, state, controls);
            }
        }
    }

    /// Absolute pressure where the sensor of a gas sits [Pa]: that of the gas while its valve is
    /// shut.
    pub fn at_sensor(&self, gas: usize, state: &[S], controls: &Controls<S>) -> S {
        let inside = state[self.layout.pressure(gas)];
        let Some((valve, acting)) = self.tap(gas) else { return inside };
        let (opening, filling) = self.opening(valve, controls.spool[valve]);
        let (air, effect) = (&self.rig.gas, self.effect(acting));
        if opening.shut() {
            inside
        } else if filling {
            let outside = self.pressure_at(self.wiring.valves[valve].from, state);
            effect.between(air, &opening, outside, inside, false)
        } else {
            effect.between(air, &opening, inside, constant(air.ambient_pressure), true)
        }
    }

    /// Absolute pressure of a gas [Pa] whose sensor sits where the pressure is `there`: the valve's
    /// flow is known from the pressures at its two sides, and the tube passes it to one pressure.
    /// At most the highest that the rig can have.
    pub fn behind_tube(&self, gas: usize, there: S, state: &[S], spool: S) -> S {
        let Some((valve, acting)) = self.tap(gas) else { return there };
        let (opening, filling) = self.opening(valve, spool);
        let air = &self.rig.gas;
        if opening.shut() || there.re() <= 0.0 {
            return there;
        }
        let flow = if filling {
            opening.mass_flow(air, self.pressure_at(self.wiring.valves[valve].from, state), there)
        } else {
            -opening.mass_flow(air, there, constant(air.ambient_pressure))
        };
        let inside = self.effect(acting).behind(there, flow);
        let highest = self.rig.highest_pressure().max(there.re());
        if inside.re() <= highest {
            inside
        } else {
            constant(highest)
        }
    }

    /// Opening of a valve, and whether it opens to where it is fed from.
    fn opening(&self, valve: usize, spool: S) -> (Opening<S>, bool) {
        let filling = spool.re() > 0.0;
        let path = &self.valves[valve].paths[usize::from(!filling)];
        if spool.re() == 0.0 {
            return (path.part(constant(0.0)), filling);
        }
        let share = self.wiring.valves[valve].table.eval(if filling { spool } else { -spool });
        (path.part(self.share(valve, share, !filling)), filling)
    }
}
