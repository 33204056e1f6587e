//! `valve_area`: the flow area of a valve is another than its table says, where it fills and where
//! it vents.
//!
//! `two_areas`: `f (1 + a)` in the place of the share `f` of the largest area where the valve fills,
//! `f (1 - a)` where it vents: the edges of spool and sleeve are not cut alike, and ports and
//! silencer are not either. What both have in common is `valve.discharge_area_max`. `bend`:
//! `f (1 + a (1 - f))`, which leaves the ends where they are: windows that are round instead of
//! square, a spool that turns over its stroke. Both leave the shut valve shut. E. Richer & Y.
//! Hurmuzlu, "A high performance pneumatic force actuator system", ASME J. Dyn. Syst. Meas. Control
//! 122, 2000 (areas of radial holes over the stroke); ISO 6358 (2013), which has a conductance of
//! its own for every path.

use super::{Effect, EffectInfo, EffectParameter, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

const TWO_AREAS: Form = Form {
    name: "two_areas",
    parameters: &[EffectParameter::new("excess", "1", -0.9, 0.9, 0.1)
        .starts(&[-0.1, 0.1])
        .off(0.0)],
    states: &[],
    integrates: false,
    ports: &[Port::Area],
    make: made_by!(two_areas),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "valve_area",
    block: "valve",
    at: "valve",
    source: "Richer & Hurmuzlu (2000); ISO 6358",
    forms: &[TWO_AREAS, Form { name: "bend", make: made_by!(bend), ..TWO_AREAS }],
    ..EffectInfo::USUAL
};

/// An area for either way.
#[derive(Debug, Clone, Copy)]
struct TwoAreas<S> {
    excess: S,
}

fn two_areas<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(TwoAreas { excess: values[0] })
}

impl<S: Scalar> Effect<S> for TwoAreas<S> {
    fn area(&self, share: S, venting: bool) -> S {
        let more = if venting { -self.excess } else { self.excess };
        share * (more + 1.0)
    }
}

/// An area that bends over the stroke.
#[derive(Debug, Clone, Copy)]
struct Bend<S> {
    bend: S,
}

fn bend<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Bend { bend: values[0] })
}

impl<S: Scalar> Effect<S> for Bend<S> {
    fn area(&self, share: S, _venting: bool) -> S {
        share * (self.bend * (-share + 1.0) + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_way_has_its_area_and_both_have_their_mean() {
        let valve = TwoAreas { excess: 0.2 };
        assert!((valve.area(0.5, false) - 0.6_f64).abs() < 1e-15);
        assert!((valve.area(0.5, true) - 0.4_f64).abs() < 1e-15);
        assert_eq!(valve.area(0.0, true), 0.0);
    }

    #[test]
    fn a_bend_keeps_the_ends_and_the_order() {
        for b in [-0.9, -0.3, 0.4, 0.9] {
            let valve = Bend { bend: b };
            assert_eq!((valve.area(0.0, false), valve.area(1.0, true)), (0.0, 1.0));
            let at = |k: i32| valve.area(0.01 * f64::from(k), false);
            assert!((0..100).all(|k| at(k + 1) > at(k)));
            assert!((at(50) - 0.5 * (1.0 + 0.5 * b)).abs() < 1e-15);
        }
    }
}
