//! `supply_regulator_slew`: a pressure regulator whose outlet rises and falls no faster than its
//! valves let it.
//!
//! `-v_f <= P' <= v_r`: a small step is answered with the regulator's lag, a large one as a ramp,
//! often slower down than up, since the small relief seat empties what the main seat filled. It
//! lowers the `rise_limit` and `fall_limit` of the rig ([`crate::blocks::supply`]); at [`FASTEST`]
//! it limits nothing. P. Beater, *Pneumatic Drives* (2007), ch. 8; K. J. Astrom & T. Hagglund,
//! *Advanced PID Control* (2006), ch. 3 (rate limits of actuators).

use super::{Effect, EffectInfo, EffectParameter, Form, Kink, Port};
use crate::blocks::gas::Gas;
use crate::blocks::supply::{Supply, FASTEST};
use crate::made_by;
use crate::scalar::Scalar;

const LIMIT: EffectParameter = EffectParameter::new("rise_limit", "Pa/s", 1e2, FASTEST, 2e6)
    .starts(&[3e5, 2e6, 1e7])
    .off(FASTEST);

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "supply_regulator_slew",
    block: "supply",
    at: "supply",
    supplies: &["regulator"],
    kink: Some(Kink {
        where_not_zero: &["rise_limit"],
        why: "beyond its limits it does not answer in proportion; hold supply_pressure",
        of_supplies: true,
    }),
    source: "Beater, Pneumatic Drives (2007), ch. 8; Astrom & Hagglund (2006), ch. 3",
    forms: &[Form {
        name: "up_and_down",
        parameters: &[LIMIT, EffectParameter { name: "fall_limit", ..LIMIT }],
        states: &[],
        integrates: false,
        ports: &[Port::Feed],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Limits of the rate of a regulator's outlet [Pa/s].
#[derive(Debug, Clone, Copy)]
struct Slew<S> {
    rise: S,
    fall: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Slew { rise: values[0], fall: values[1] })
}

impl<S: Scalar> Effect<S> for Slew<S> {
    fn answers(&self, supply: &mut Supply<S>) {
        let lower = |limit: &mut S, own: S| {
            if own.re() < limit.re() {
                *limit = own;
            }
        };
        if let Supply::Regulator { rise_limit, fall_limit, .. } = supply {
            lower(rise_limit, self.rise);
            lower(fall_limit, self.fall);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::Edge;

    #[test]
    fn it_rises_and_falls_no_faster() {
        let mut supply = Supply::<f64>::Regulator {
            time_constant: 0.01,
            droop: 0.0,
            rise_limit: 1e6,
            fall_limit: FASTEST,
            dead_time: 0.0,
            dead_band: 0.0,
        };
        Slew { rise: 7e6, fall: 2e6 }.answers(&mut supply);
        let rate =
            |pressure, set| supply.pressure_rate(pressure, 0.0, 8.4e4, &Edge::steady(set), None);
        assert_eq!((rate(1e5, 5e5), rate(5e5, 1e5)), (1e6, -2e6));
        assert!((rate(1e5, 1.01e5) - 1e5).abs() < 1e-6);
    }
}
