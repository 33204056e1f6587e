//! `mullins_softening`: a bladder that is softer wherever it has been stretched before.
//!
//! `F_b -> F_b (1 - D tanh((e_m - e)/w))` of the bladder's part of the force, `e_m` the largest
//! contraction since the start: a first stretch is as stiff as the model says, the way back and all
//! later cycles up to `e_m` are softer. R. W. Ogden & D. G. Roxburgh, "A pseudo-elastic model for
//! the Mullins effect in filled rubber", Proc. R. Soc. A 455, 1999, with contraction in the place
//! of energy; J. Diani, B. Fayolle & P. Gilormini, "A review on the Mullins effect", European
//! Polymer Journal 45, 2009.

use super::{At, Effect, EffectInfo, EffectParameter, EffectState, Form, Kink, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "mullins_softening",
    block: "muscle",
    at: "muscle",
    kink: Some(Kink {
        where_not_zero: &["softening"],
        why: "its memory moves with contraction only",
        of_supplies: false,
    }),
    source: "Ogden & Roxburgh (1999); Diani, Fayolle & Gilormini (2009)",
    forms: &[Form {
        name: "tanh",
        parameters: &[
            EffectParameter::new("softening", "1", 0.0, 1.0, 0.2).starts(&[0.1, 0.3]).off(0.0),
            EffectParameter::new("contraction_width", "1", 0.0001, 10.0, 0.03).starts(&[0.03]),
        ],
        states: &[EffectState { name: "largest", role: Role::Keeps }],
        integrates: false,
        ports: &[Port::Bladder],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// What the softening adds to the force [N] of a bladder's force [N] at a contraction ratio, after
/// a largest one.
#[inline]
pub fn change<S: Scalar>(softening: S, width: S, bladder: S, contraction: S, largest: S) -> S {
    if contraction.re() >= largest.re() {
        return bladder * 0.0;
    }
    -(softening * ((largest - contraction) / width).tanh() * bladder)
}

/// Softening of a bladder; its state is the largest contraction ratio so far.
#[derive(Debug, Clone, Copy)]
struct Softening<S> {
    softening: S,
    width: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Softening { softening: values[0], width: values[1] })
}

impl<S: Scalar> Effect<S> for Softening<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Muscle(muscle) = at {
            own[0] = muscle.contraction;
        }
    }

    fn bladder(&self, own: &[S], bladder: S, contraction: S) -> S {
        change(self.softening, self.width, bladder, contraction, own[0])
    }

    fn moved(&self, own: &mut [S], _from: S, to: S, _rest_length: f64) {
        if to.re() > own[0].re() {
            own[0] = to;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_stretched_is_softer() {
        assert_eq!(change(0.3, 0.03, -80.0, 0.2, 0.2), 0.0);
        assert!((change(0.3, 0.03, -80.0, 0.0, 0.2) - 24.0_f64).abs() < 1e-3);
        assert_eq!(change(0.0, 0.03, -80.0, 0.0, 0.2), 0.0);
    }
}
