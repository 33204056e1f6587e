//! `thermometer_lag`: the recorded temperature of a gas lags behind the true one, by the mass of
//! the thermometer.
//!
//! `T y' = temperature - y`, the law of [`super::pressure_lag`]: over a step the true temperature
//! is taken as straight. A thermocouple of 0.1 mm in still air takes some tenths of a second, one
//! of 1 mm in a sheath some seconds. The gas does not feel its thermometer. E. O. Doebelin,
//! *Measurement Systems*, ch. 8.

use super::pressure_lag::{make, SHORTEST};
use super::{AtRest, EffectInfo, EffectParameter, EffectState, Form, Port, Role};
use crate::made_by;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "thermometer_lag",
    block: "sensors",
    at: "chamber",
    at_rest: &[AtRest::OutBelow("time_constant", SHORTEST)],
    acts_in: &["temperature"],
    source: "Doebelin, Measurement Systems, ch. 8",
    forms: &[Form {
        name: "first_order",
        parameters: &[EffectParameter::new("time_constant", "s", 0.0, 100.0, 0.3)
            .starts(&[0.1, 1.0, 5.0])
            .usually(0.01, 20.0)
            .off(0.0)],
        states: &[EffectState { name: "", role: Role::Moves }],
        integrates: false,
        ports: &[Port::Thermometer],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::gas::Gas;

    #[test]
    fn a_plunge_is_followed_by_two_thirds_in_a_time_constant() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let thermometer = make(&[0.4_f64], &gas);
        let mut reading = 293.15;
        for _ in 0..40 {
            reading = thermometer.read(reading, 253.15, 253.15, 0.01);
        }
        assert!((reading - (253.15 + 40.0 * (-1.0_f64).exp())).abs() < 1e-9);
        let mut rate = [0.0];
        thermometer.linear_rates(&[293.15], 253.15, &mut rate);
        assert!((rate[0] + 100.0).abs() < 1e-9);
    }
}
