//! `supply_regulator_deadband`: a pressure regulator that does nothing about a small error.
//!
//! `P' = (e_a - k m)/tau` with `e_a = sgn(e) max(|e| - b, 0)` of the error `e = P_set - P`: within
//! the dead band `b` only the flow that is drawn moves the pressure. A step below the band is not
//! answered, a larger one ends short of its aim by the band. C. Robinson, *Modeling and control of
//! pneumatic artificial muscles* (2014), ch. 3; P. Beater, *Pneumatic Drives* (2007), ch. 8. Acts
//! on regulators.

use super::{Effect, EffectInfo, EffectParameter, Form, Kink, Port};
use crate::blocks::gas::Gas;
use crate::blocks::supply::answered;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "supply_regulator_deadband",
    block: "supply",
    at: "supply",
    supplies: &["regulator"],
    kink: Some(Kink {
        where_not_zero: &["dead_band"],
        why: "inside its band it does not answer; hold supply_pressure",
        of_supplies: true,
    }),
    source: "Robinson (2014), ch. 3; Beater, Pneumatic Drives (2007)",
    forms: &[Form {
        name: "symmetric",
        parameters: &[EffectParameter::new("dead_band", "Pa", 0.0, 1e7, 20000.0)
            .starts(&[5000.0, 50000.0])
            .off(0.0)],
        states: &[],
        integrates: false,
        ports: &[Port::Feed],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Dead band of a regulator.
#[derive(Debug, Clone, Copy)]
struct DeadBand<S> {
    dead_band: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(DeadBand { dead_band: values[0] })
}

impl<S: Scalar> Effect<S> for DeadBand<S> {
    fn feed(&self, _own: &[S], pressure: S, _drawn: &mut S, set: &mut S) {
        let error = *set - pressure;
        let ignored = error - answered(error, self.dead_band);
        *set -= ignored;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_error_is_not_answered() {
        assert_eq!(answered(5e3, 7e3), 0.0);
        assert_eq!((answered(1e4, 7e3), answered(-1e4, 7e3)), (3e3, -3e3));
        assert_eq!((answered(1e4, 0.0), answered(-1e4, 0.0), answered(0.0, 0.0)), (1e4, -1e4, 0.0));
    }
}
