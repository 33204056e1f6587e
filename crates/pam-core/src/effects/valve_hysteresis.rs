//! `valve_hysteresis`: play of the spool by the friction of spool and solenoid.
//!
//! `play`: `y <- min(max(y, x - h), x + h)`: the spool `y` follows the commanded position `x` at a
//! distance `h`. It begins as moved from the null, where its springs hold it. Between steps the
//! recursion is exact; a data sheet's hysteresis is `2 h` of the stroke. M. Al Janaideh, S. Rakheja
//! & C.-Y. Su, "An analytical generalized Prandtl-Ishlinskii model inversion for hysteresis
//! compensation in micropositioning control", IEEE/ASME Trans. Mechatronics 16, 2011 (play
//! operator).
//!
//! `play_with_slope`: `x_e = y + g (x - y)`: a spool that gives by a share `g` before it breaks
//! away, so that no small command is lost. The play operator and a linear part of the same paper.

use super::{
    begun, Effect, EffectInfo, EffectParameter, EffectState, Form, Kink, Port, Role, BEGINNING,
    BEGUN,
};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const WIDTH: EffectParameter =
    EffectParameter::new("half_width", "1", 0.0, 0.9, 0.004).starts(&[0.003, 0.02]).off(0.0);

const PLAY: Form = Form {
    name: "play",
    parameters: &[WIDTH],
    states: &[BEGINNING, EffectState { name: "spool", role: Role::Keeps }],
    integrates: false,
    ports: &[Port::Command],
    make: made_by!(make),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "valve_hysteresis",
    block: "valve",
    at: "valve",
    order: 1,
    kink: Some(Kink {
        where_not_zero: &["half_width"],
        why: "inside its play no small command moves the spool",
        of_supplies: false,
    }),
    source: "Al Janaideh, Rakheja & Su (2011), play operator",
    forms: &[
        PLAY,
        Form {
            name: "play_with_slope",
            parameters: &[
                WIDTH,
                EffectParameter::new("slope", "1", 0.0, 1.0, 0.2).starts(&[0.2, 0.5]),
            ],
            make: made_by!(sloping),
            ..PLAY
        },
    ],
    ..EffectInfo::USUAL
};

/// Where the spool is once the commanded position has moved.
#[inline]
pub fn followed<S: Scalar>(spool: S, commanded: S, half_width: S) -> S {
    let (low, high) = (commanded - half_width, commanded + half_width);
    if spool.re() <= low.re() {
        low
    } else if spool.re() >= high.re() {
        high
    } else {
        spool
    }
}

/// Play of a spool; its states say that it has begun, and where the spool is.
#[derive(Debug, Clone, Copy)]
struct Play<S> {
    half_width: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Play { half_width: values[0] })
}

impl<S: Scalar> Effect<S> for Play<S> {
    fn position(&self, own: &[S], input: S, _age: f64) -> S {
        // springs centre a spool that has not been moved yet
        let spool = if begun(own) { own[1] } else { constant(0.0) };
        followed(spool, input, self.half_width)
    }

    fn follow(&self, own: &mut [S], input: S, step: f64) -> S {
        let spool = self.position(own, input, step);
        own.copy_from_slice(&[constant(BEGUN), spool]);
        spool
    }
}

/// Play of a spool that gives a little inside it.
#[derive(Debug, Clone, Copy)]
struct SlopingPlay<S> {
    play: Play<S>,
    slope: S,
}

fn sloping<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(SlopingPlay { play: Play { half_width: values[0] }, slope: values[1] })
}

impl<S: Scalar> SlopingPlay<S> {
    fn given(&self, spool: S, input: S) -> S {
        spool + self.slope * (input - spool)
    }
}

impl<S: Scalar> Effect<S> for SlopingPlay<S> {
    fn position(&self, own: &[S], input: S, age: f64) -> S {
        self.given(self.play.position(own, input, age), input)
    }

    fn follow(&self, own: &mut [S], input: S, step: f64) -> S {
        self.given(self.play.follow(own, input, step), input)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_follows_at_a_distance() {
        let h = 0.01;
        let up = followed(0.0, 0.5, h);
        assert_eq!(up, 0.49);
        assert_eq!(followed(up, 0.485, h), up, "a small return does not move it");
        assert!((followed(up, 0.3, h) - 0.31_f64).abs() < 1e-15);
        assert_eq!(followed(0.2, 0.7, 0.0), 0.7);
        let begins = |x: f64| Play { half_width: h }.position(&[0.0, 0.3], x, 0.0);
        assert_eq!((begins(0.5), begins(-0.5), begins(0.005)), (0.49, -0.49, 0.0));
    }

    #[test]
    fn inside_its_play_it_gives_by_a_share() {
        let play = SlopingPlay { play: Play { half_width: 0.01 }, slope: 0.25 };
        let at = |x: f64| play.position(&[BEGUN, 0.3], x, 0.0);
        assert!((at(0.304) - 0.301).abs() < 1e-15 && (at(0.296) - 0.299).abs() < 1e-15);
        // beyond it by three quarters of the distance
        assert!((at(0.5) - 0.4925).abs() < 1e-15);
    }
}
