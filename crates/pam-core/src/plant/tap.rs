//! Where the transducer of a gas sits: at the gas, or in front of the tube through which a valve feeds it.

use super::rates::{Controls, Plant};
use crate::effects::tube_flow_restriction;
use crate::scalar::{constant, Scalar};

impl<S: Scalar> Plant<'_, S> {
    /// Place of what the sensor of a gas reads.
    pub fn reading(&self, gas: usize) -> usize {
        let unit = &self.rig.wiring.gases[gas];
        let tap = unit.tap.filter(|_| self.tapped().is_some()).map(|(_, place)| place);
        unit.lag.or(tap).map_or(self.layout.pressure(gas), |place| self.layout.extra(place))
    }

    /// Write the pressures between valves and tubes, where sensors sit there: those of a state, its commands held.
    pub fn read_taps(&self, state: &mut [S], controls: &Controls<S>) {
        if self.tapped().is_none() {
            return;
        }
        for (k, gas) in self.rig.wiring.gases.iter().enumerate() {
            if let Some((_, place)) = gas.tap {
                state[self.layout.extra(place)] = self.at_sensor(k, state, controls);
            }
        }
    }

    /// Absolute pressure where the sensor of a gas sits [Pa]: that of the gas while its valve is shut.
    pub fn at_sensor(&self, gas: usize, state: &[S], controls: &Controls<S>) -> S {
        let inside = state[self.layout.pressure(gas)];
        let (Some(tube), Some((valve, _))) = (self.tapped(), self.rig.wiring.gases[gas].tap) else {
            return inside;
        };
        let (area, filling) = self.opening(valve, controls.spool[valve]);
        let air = &self.rig.gas;
        if area.re() <= 0.0 {
            inside
        } else if filling {
            let outside = self.pressure_at(self.rig.wiring.valves[valve].from, state);
            tube_flow_restriction::node(air, area, tube, outside, inside, false)
        } else {
            tube_flow_restriction::node(air, area, tube, inside, constant(air.ambient_pressure), true)
        }
    }

    /// Absolute pressure of a gas [Pa] whose sensor sits where the pressure is `there`: the valve's flow is known from the
    /// pressures at its two sides, and the tube passes it to one pressure. At most the highest that the rig can have.
    pub fn behind_tube(&self, gas: usize, there: S, state: &[S], spool: S) -> S {
        let (Some(tube), Some((valve, _))) = (self.tapped(), self.rig.wiring.gases[gas].tap) else {
            return there;
        };
        let (area, filling) = self.opening(valve, spool);
        let air = &self.rig.gas;
        if area.re() <= 0.0 || there.re() <= 0.0 {
            return there;
        }
        let flow = if filling {
            air.mass_flow(area, self.pressure_at(self.rig.wiring.valves[valve].from, state), there)
        } else {
            -air.mass_flow(area, there, constant(air.ambient_pressure))
        };
        let inside = tube.other_end(there, flow);
        let highest = self.rig.highest_pressure().max(there.re());
        if inside.re() <= highest {
            inside
        } else {
            constant(highest)
        }
    }

    /// Discharge area of a valve [m2], and whether it opens to where it is fed from.
    fn opening(&self, valve: usize, spool: S) -> (S, bool) {
        let filling = spool.re() > 0.0;
        let table = &self.rig.wiring.valves[valve].table;
        if spool.re() == 0.0 {
            return (constant(0.0), filling);
        }
        (self.valves[valve].area * table.eval(if filling { spool } else { -spool }), filling)
    }
}
