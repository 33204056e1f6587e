//! `exhaust_back_pressure`: a silencer, a filter or a collecting pipe behind a valve's exhaust, which
//! holds a pressure there while the valve vents.
//!
//! Opening and silencer are in series without volume between them: the pressure at the node is that
//! at which both pass the same mass, `m_v(p, p_e) = m_s(p_e, p_a)`, as at a hose
//! ([`super::tube_flow_restriction`]), here behind the valve and only where it vents. The silencer
//! has a sonic conductance and a critical ratio of 0.3 by ISO 6358-3 (2014). While the opening is
//! choked the node is not heard: the vent is short of flow where it is wide open and its pressure
//! has fallen. Beater, *Pneumatic Drives* (2007), ch. 4. A conductance of [`NONE`] or more restricts
//! nothing. At a valve with a hose that is an effect, one of both acts.

use super::tube_flow_restriction::{mass_flow, tube, Passage, NONE};
use super::{Effect, EffectInfo, EffectParameter, Form, Port, Use};
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
        parameters: &[EffectParameter::new("conductance", "m3/(s Pa)", 1e-15, 1.0, 1.2e-8)
            .starts(&[1.2e-8])
            .off(NONE)
            .role(Use::Size)
            .restricts()
            .like("valve.discharge_area_max")],
        states: &[],
        integrates: false,
        ports: &[Port::Exhaust],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// A silencer; None where it restricts nothing.
#[derive(Debug, Clone, Copy)]
struct Silencer<S>(Option<Passage<S>>);

fn make<S: Scalar>(values: &[S], gas: &Gas) -> Box<dyn Effect<S>> {
    let restricts = values[0].re() < NONE;
    Box::new(Silencer(restricts.then(|| tube(values[0], gas.temperature))))
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
        match &self.0 {
            Some(silencer) if venting => {
                mass_flow(gas, opening, silencer, upstream, downstream, false)
            }
            _ => opening.mass_flow(gas, upstream, downstream),
        }
    }
}

#[cfg(test)]
mod tests {
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
