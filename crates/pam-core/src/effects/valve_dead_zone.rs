//! `valve_dead_zone`: positive overlap of the spool.
//!
//! `symmetric`: `x_e = sgn(x) max(|x| - d, 0)/(1 - d)` in the place of the normalised spool
//! position `x`; one half width `d` for both edges, since a difference of the edges is a shift of
//! the null voltage. E. Richer & Y. Hurmuzlu, "A high performance pneumatic force actuator system",
//! ASME J. Dyn. Syst. Meas. Control 122, 2000; A. C. Valdiero, C. S. Ritter, C. F. Rios & M.
//! Rafikov, "Nonlinear mathematical modeling in pneumatic servo position applications", Math.
//! Probl. Eng. 2011, 472903.
//!
//! `two_widths`: `d` where the valve fills and `d_v` where it vents, with the null voltage where
//! the data sheet says. Valdiero et al. (2011), whose edges are two.

use super::{Effect, EffectInfo, EffectParameter, Form, Kink, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const WIDTH: EffectParameter =
    EffectParameter::new("half_width", "1", 0.0, 0.9, 0.03).starts(&[0.01, 0.05]).off(0.0);

const SYMMETRIC: Form = Form {
    name: "symmetric",
    parameters: &[WIDTH],
    states: &[],
    integrates: false,
    ports: &[Port::Command],
    make: made_by!(make),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "valve_dead_zone",
    block: "valve",
    at: "valve",
    order: 2,
    kink: Some(Kink {
        where_not_zero: &["half_width", "half_width_venting"],
        why: "at its centre no small command reaches the flow",
        of_supplies: false,
    }),
    source: "Valdiero, Ritter, Rios & Rafikov (2011); Richer & Hurmuzlu (2000)",
    forms: &[
        SYMMETRIC,
        Form {
            name: "two_widths",
            parameters: &[WIDTH, EffectParameter { name: "half_width_venting", ..WIDTH }],
            make: made_by!(two_widths),
            ..SYMMETRIC
        },
    ],
    ..EffectInfo::USUAL
};

/// The position that opens the valve, for a normalised spool position.
#[inline]
pub fn effective<S: Scalar>(x: S, half_width: S) -> S {
    let full = -half_width + 1.0;
    if x.re() > half_width.re() {
        (x - half_width) / full
    } else if x.re() < -half_width.re() {
        (x + half_width) / full
    } else {
        constant(0.0)
    }
}

/// Overlap of a spool.
#[derive(Debug, Clone, Copy)]
struct DeadZone<S> {
    half_width: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(DeadZone { half_width: values[0] })
}

impl<S: Scalar> Effect<S> for DeadZone<S> {
    fn position(&self, _own: &[S], input: S, _age: f64) -> S {
        effective(input, self.half_width)
    }
}

/// Overlap of a spool, another one at either edge.
#[derive(Debug, Clone, Copy)]
struct TwoWidths<S> {
    filling: S,
    venting: S,
}

fn two_widths<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(TwoWidths { filling: values[0], venting: values[1] })
}

impl<S: Scalar> Effect<S> for TwoWidths<S> {
    fn position(&self, _own: &[S], input: S, _age: f64) -> S {
        effective(input, if input.re() > 0.0 { self.filling } else { self.venting })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_shut_inside_and_wide_open_at_the_ends() {
        assert_eq!((effective(0.03, 0.04), effective(-0.04, 0.04)), (0.0, 0.0));
        assert_eq!((effective(1.0, 0.04), effective(-1.0, 0.04)), (1.0, -1.0));
        assert!((effective(0.52, 0.04) - 0.5_f64).abs() < 1e-15);
        for x in [-1.0, -0.3, 0.0, 0.3, 1.0] {
            assert_eq!(effective(x, 0.0), x);
        }
    }

    #[test]
    fn each_edge_has_its_width() {
        let zone = TwoWidths { filling: 0.04, venting: 0.1 };
        let at = |x: f64| zone.position(&[], x, 0.0);
        assert_eq!((at(0.03), at(-0.09), at(1.0), at(-1.0)), (0.0, 0.0, 1.0, -1.0));
        assert!((at(0.52) - 0.5).abs() < 1e-15 && (at(-0.55) + 0.5).abs() < 1e-15);
    }
}
