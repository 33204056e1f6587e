//! `line_flow_law`: an outlet, or another line without a tube, that does not flow like an orifice.
//!
//! `laminar`: a capillary, a needle valve, a filter or a sintered silencer passes `m_l = k (p_1^2 -
//! p_2^2)` where its flow is laminar. `power`: where entrance and friction both count, a power
//! between that and an orifice, `m = m_o (m_l/m_o)^a`, `m_o` the orifice of the line. So `a = 0` is
//! the orifice, `a = 1` laminar, and of small pressure differences the flow goes with the power
//! `n = (1 + a)/2`, the free exponent of throttles. `k` is told by `r`, the laminar flow from 1 bar
//! above the ambient in parts of the orifice's: `m_l = r m_o(1 bar) (p_1^2 - p_2^2)/(p_b^2 -
//! p_a^2)`. Next to equal pressures, below a millionth of that flow, it is the orifice again. H.
//! Blasius and G. Hagen in L. Prandtl & O. Tietjens, *Applied Hydro- and Aeromechanics* (1934), ch.
//! 2 (laminar flow of a gas in a capillary); Beater, *Pneumatic Drives* (2007), ch. 4 (throttles).

use super::{Effect, EffectInfo, EffectParameter, Form, Port, BAR};
use crate::blocks::gas::Gas;
use crate::effects::Use;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "line_flow_law",
    block: "line",
    at: "line",
    source: "Prandtl & Tietjens (1934), ch. 2; Beater, Pneumatic Drives (2007), ch. 4",
    forms: &[
        LAMINAR,
        Form {
            name: "power",
            parameters: &[
                EffectParameter::new("laminar_part", "1", 0.0, 3.0, 1.0).starts(&[1.0]).off(0.0),
                FLOW,
            ],
            ..LAMINAR
        },
    ],
    ..EffectInfo::USUAL
};

const FLOW: EffectParameter =
    EffectParameter::new("laminar_flow", "1", 1e-4, 1e4, 1.0).starts(&[1.0, 10.0]);

const LAMINAR: Form = Form {
    name: "laminar",
    parameters: &[
        EffectParameter::new("laminar_part", "1", 0.0, 1.0, 1.0)
            .starts(&[1.0])
            .off(0.0)
            .role(Use::Choice),
        FLOW,
    ],
    states: &[],
    integrates: false,
    ports: &[Port::Law],
    make: made_by!(make),
};

/// Flow next to which the law is that of the orifice, in parts of that from 1 bar [1].
const ROUNDED: f64 = 1e-6;

/// Another law than an orifice's.
#[derive(Debug, Clone, Copy)]
struct Law<S> {
    part: S,
    flow: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Law { part: values[0], flow: values[1] })
}

impl<S: Scalar> Effect<S> for Law<S> {
    fn along(&self, gas: &Gas, own: S, unit: S, from: S, to: S) -> S {
        let ambient = gas.ambient_pressure;
        let squares = (ambient + BAR).powi(2) - ambient * ambient;
        let laminar = self.flow * (from * from - to * to) / squares;
        // both in parts of the orifice's flow from 1 bar
        let orifice = own / unit;
        let least = ROUNDED * ROUNDED;
        let ratio = (laminar * laminar + least) / (orifice * orifice + least);
        own * (ratio.ln() * self.part * 0.5).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_from_an_orifice_to_laminar_flow() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let area = 1e-6;
        let unit = gas.mass_flow(area, 201_325.0, 101_325.0);
        let flow = |part: f64, above: f64| {
            let law = (INFO.form("").unwrap().make.plain)(&[part, 2.0], &gas);
            let own = gas.mass_flow(area, 101_325.0 + above, 101_325.0);
            law.along(&gas, own, unit, 101_325.0 + above, 101_325.0)
        };
        assert_eq!(flow(0.0, 3e4), gas.mass_flow(area, 131_325.0, 101_325.0));
        assert!((flow(1.0, 1e5) / (2.0 * unit) - 1.0_f64).abs() < 1e-9);
        let squares = |above: f64| above * (above + 2.0 * 101_325.0);
        for above in [1e3, 1e4, 4e5] {
            let laminar = 2.0 * unit * squares(above) / squares(1e5);
            assert!((flow(1.0, above) / laminar - 1.0).abs() < 1e-6);
            assert!((flow(1.0, -above / 10.0) < 0.0) && flow(1.0, 0.0) == 0.0);
        }
        // of small differences a power between 0.5 and 1
        let power = (flow(0.5, 2e3) / flow(0.5, 1e3)).log2();
        assert!((power - 0.75).abs() < 0.01, "{power}");
    }
}
