//! `supply_regulator_delay`: a pressure regulator that answers its command late by a dead time.
//!
//! What it is set to at `t` is the command of `t - d`: a bus, the cycle of its controller, a pilot
//! valve that has to lift. A step of any size comes late by the same time. It adds to the
//! `dead_time` of the rig ([`crate::blocks::supply`]). P. Beater, *Pneumatic Drives* (2007), ch. 8;
//! O. J. M. Smith, "Closer control of loops with dead time", Chem. Eng. Progress 53, 1957.

use super::{Effect, EffectInfo, EffectParameter, Form, Kink, Port};
use crate::blocks::gas::Gas;
use crate::blocks::supply::Supply;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "supply_regulator_delay",
    block: "supply",
    at: "supply",
    supplies: &["regulator"],
    kink: Some(Kink {
        where_not_zero: &["delay"],
        why: "its delay is no state of the rig; take it out, and give it as the delay of the loop",
        of_supplies: true,
    }),
    source: "Beater, Pneumatic Drives (2007), ch. 8; Smith (1957)",
    forms: &[Form {
        name: "dead_time",
        // from one within a sample's reach of the true one a fit goes on; from a far one it ends
        // beside it
        parameters: &[EffectParameter::new("delay", "s", 0.0, 10.0, 0.02)
            .starts(&[0.02])
            .scan(0.002, 0.5, 13)
            .off(0.0)],
        states: &[],
        integrates: false,
        ports: &[Port::Feed],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// A dead time of a regulator [s].
#[derive(Debug, Clone, Copy)]
struct Late<S>(S);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Late(values[0]))
}

impl<S: Scalar> Effect<S> for Late<S> {
    fn answers(&self, supply: &mut Supply<S>) {
        if let Supply::Regulator { dead_time, .. } = supply {
            *dead_time += self.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::supply::FASTEST;

    #[test]
    fn it_adds_to_the_dead_time_of_a_regulator() {
        let mut supply = Supply::<f64>::Regulator {
            time_constant: 0.1,
            droop: 0.0,
            rise_limit: FASTEST,
            fall_limit: FASTEST,
            dead_time: 0.01,
            dead_band: 0.0,
        };
        Late(0.02).answers(&mut supply);
        assert!((supply.dead_time() - 0.03).abs() < 1e-15);
        let mut tank = Supply::Tank(0.01);
        Late(0.02).answers(&mut tank);
        assert_eq!(tank.dead_time(), 0.0);
    }
}
