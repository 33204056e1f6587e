//! `heat_transfer`: gas temperature from an energy balance with heat exchange at the wall.
//!
//! The balance of [`crate::blocks::chamber`], all that comes in at rest temperature, in place of the
//! constant polytropic coefficients. The gas mass is the state, so that the temperature cannot drift. Wall area: the cylinder of each muscle's volume and length;
//! the cube of the chamber's volume when it is rigid. Only a `share` of the gas may follow the
//! balance, while the rest keeps the coefficients: a nominal model whose coefficients are nearly
//! right is left by a little, not by all. The mass then is the one that the gas temperature stands
//! for, and not what flowed. A recording may begin just after a fill: the gas is then warmer than
//! the wall by an initial rise. Carneiro & de Almeida (2006); Al-Ibrahim & Otis (1992).

use super::{AtRest, Effect, EffectInfo, EffectParameter, Form, Port, Use};
use crate::blocks::chamber::{energy_rate, gas_temperature, wall_heat, wall_rate, ChamberState};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "heat_transfer",
    block: "chamber",
    at: "chamber",
    frees_mass: true,
    at_rest: &[AtRest::Set("initial_temperature_rise", 0.0)],
    source: "Carneiro & de Almeida (2006); Al-Ibrahim & Otis (1992)",
    forms: &[Form {
        name: "energy_balance",
        parameters: &[
            EffectParameter::new("heat_transfer_coefficient", "W/(m2 K)", 1.0, 10000.0, 50.0)
                .starts(&[20.0, 80.0]),
            EffectParameter::new("initial_temperature_rise", "K", 0.0, 200.0, 0.0)
                .starts(&[5.0])
                .role(Use::Held)
                .sealed(Use::Size),
            EffectParameter::new("share", "1", 0.0, 1.0, 1.0)
                .starts(&[0.2])
                .role(Use::Size)
                .sealed(Use::Held),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Balance],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Rate of the absolute pressure [Pa/s].
#[inline]
pub fn pressure_rate<S: Scalar>(
    gas: &Gas,
    c: &ChamberState<S>,
    temperature: S,
    area: S,
    coefficient: S,
) -> S {
    let heat = wall_heat(gas, c.pressure, temperature, area, coefficient);
    energy_rate(gas, c, c.inflow * gas.temperature, temperature, heat)
}

/// Heat exchange of a chamber with its wall.
#[derive(Debug, Clone, Copy)]
struct Heat<S> {
    coefficient: S,
    rise: S,
    share: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Heat { coefficient: values[0], rise: values[1], share: values[2] })
}

impl<S: Scalar> Effect<S> for Heat<S> {
    fn balance(&self, gas: &Gas, chamber: &ChamberState<S>, wall: S, mass: S, fixed: S) -> (S, S) {
        let temperature = gas_temperature(gas, chamber.pressure, chamber.volume, mass);
        let balance = pressure_rate(gas, chamber, temperature, wall, self.coefficient);
        let rest = (-self.share + 1.0) * (fixed - balance);
        // The temperature follows the balance, whatever the pressure does.
        (balance + rest, mass * rest / chamber.pressure)
    }

    fn initial_mass(&self, gas: &Gas, rest: S) -> S {
        let temperature = gas.temperature;
        rest * temperature / (self.rise + temperature)
    }

    fn wall_rate(&self, gas: &Gas, volume: f64, wall: f64) -> f64 {
        wall_rate(gas, self.coefficient.re(), volume, wall)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_adiabatic_and_isothermal() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let state = ChamberState {
            pressure: 4e5,
            volume: 1e-3,
            volume_rate: 1e-4,
            inflow: 0.0,
            outflow: 0.0,
        };
        let adiabatic = pressure_rate(&gas, &state, 293.15, 0.05, 0.0);
        assert!((adiabatic + 1.4 * 4e5 * 0.1_f64).abs() < 1e-9);
        let mass = 4e5 * 1e-3 / (287.05 * 293.15);
        assert!((gas_temperature(&gas, 4e5, 1e-3, mass) - 293.15_f64).abs() < 1e-10);
        assert!(
            pressure_rate(&gas, &state, 330.0, 0.05, 50.0) < adiabatic,
            "hot gas cools at the wall"
        );
    }
}
