//! `exhaust_back_pressure`: a silencer, a filter or a collecting pipe behind a valve's exhaust, which
//! holds a pressure there while the valve vents.
//!
//! Opening and silencer are in series without volume between them: the pressure at the node is that
//! at which both pass the same mass, `m_v(p, p_e) = m_s(p_e, p_a)`, as at a hose
//! ([`super::tube_flow_restriction`]), here behind the valve and only where it vents. The silencer
//! has a sonic conductance and a critical ratio of 0.3 by ISO 6358-3 (2014). While the opening is
//! choked the node is not heard, so that vents through small openings flow as they did. Beater,
//! *Pneumatic Drives* (2007), ch. 4. At a valve with a hose that is an effect, one of both acts.

use super::tube_flow_restriction::{tube, Hose, CONDUCTANCE};
use super::{Effect, EffectInfo, Form, Port};
use crate::blocks::gas::Gas;
use crate::blocks::valve::Opening;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "exhaust_back_pressure",
    block: "valve",
    at: "valve",
    acts_in: &["chamber", "flow"],
    source: "ISO 6358-3; Beater, Pneumatic Drives (2007), ch. 4",
    forms: &[Form {
        name: "silencer",
        parameters: &[CONDUCTANCE],
        states: &[],
        integrates: false,
        ports: &[Port::Exhaust],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// A silencer: behind the opening where the valve vents, as a hose is where it fills.
#[derive(Debug, Clone, Copy)]
struct Silencer<S>(Hose<S>);

fn make<S: Scalar>(values: &[S], gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Silencer(Hose::new(values[0], tube(values[0], gas.temperature), false)))
}

impl<S: Scalar> Effect<S> for Silencer<S> {
    fn through(
        &self,
        gas: &Gas,
        opening: &Opening<S>,
        upstream: S,
        downstream: S,
        venting: bool,
    ) -> S {
        if venting {
            self.0.through(gas, opening, upstream, downstream, false)
        } else {
            opening.mass_flow(gas, upstream, downstream)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tube_flow_restriction::NONE;
    use super::*;

    #[test]
    fn it_takes_from_wide_vents_at_low_pressures_and_nothing_from_fills() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let silencer = (INFO.form("").unwrap().make.plain)(&[3e-8], &gas);
        let flow = |area: f64, pressure: f64, venting: bool| {
            let opening = Opening::Area(area);
            let free = gas.mass_flow(area, pressure, 101_325.0);
            silencer.through(&gas, &opening, pressure, 101_325.0, venting) / free
        };
        assert_eq!(flow(8e-6, 5e5, false), 1.0);
        // choked at the opening: what is behind it is not heard
        assert!((flow(1e-6, 6e5, true) - 1.0).abs() < 1e-12);
        assert!(flow(8e-6, 1.5e5, true) < flow(4e-6, 1.5e5, true));
        assert!(flow(8e-6, 1.5e5, true) < 0.97 && flow(8e-6, 1.5e5, true) > 0.3);
        let off = (INFO.form("").unwrap().make.plain)(&[NONE], &gas);
        let opening = Opening::Area(8e-6);
        let through = off.through(&gas, &opening, 5e5, 101_325.0, true);
        assert_eq!(through, gas.mass_flow(8e-6, 5e5, 101_325.0));
    }
}
