//! `compressor_cut_in`: a compressor that starts at one pressure of the tank and stops at another.
//!
//! `m_c = s Q rho0`, `s` from 0 to 1 when the gauge pressure falls below the cut-in pressure and
//! back when it rises above the cut-out pressure; `Q` is the free air delivery (ISO 1217: volume at
//! the reference state of ISO 6358). The relay turns between steps; what it gives in the rest of
//! the step in which the pressure crosses is added by the share of the step that is left, so that
//! the moment moves with the pressures and not by whole steps. Acts on tanks.

use super::{At, Effect, EffectInfo, EffectParameter, EffectState, Form, Kink, Port, Role, Use};
use crate::blocks::gas::Gas;
use crate::blocks::tube::REFERENCE_DENSITY;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "compressor_cut_in",
    block: "supply",
    at: "supply",
    supplies: &["tank"],
    kink: Some(Kink {
        where_not_zero: &["free_air_delivery"],
        why: "it is a relay; hold supply_pressure",
        of_supplies: true,
    }),
    source: "Beater, Pneumatic Drives (2007); ISO 1217",
    forms: &[Form {
        name: "relay",
        parameters: &[
            EffectParameter::new("free_air_delivery", "m3/s", 0.0, 1.0, 0.002)
                .starts(&[0.002])
                .off(0.0),
            EffectParameter::new("cut_in_pressure", "Pa", 0.0, 1e8, 1.2e6)
                .starts(&[1e6, 1.3e6])
                .role(Use::Threshold)
                .on("supply_pressure"),
            EffectParameter::new("cut_out_pressure", "Pa", 0.0, 1e8, 1.4e6)
                .starts(&[1.2e6, 1.5e6])
                .role(Use::Threshold)
                .on("supply_pressure"),
        ],
        states: &[EffectState { name: "running", role: Role::Keeps }],
        integrates: false,
        ports: &[Port::Feed],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// State of a compressor that runs.
const RUNNING: f64 = 1.0;

/// Mass flow [kg/s] of a running compressor from its free air delivery [m3/s].
#[inline]
pub fn mass_flow<S: Scalar>(free_air_delivery: S) -> S {
    free_air_delivery * REFERENCE_DENSITY
}

/// Share of the step that is left when the relay turns, if it turns between two pressures [Pa].
#[inline]
pub fn turned<S: Scalar>(running: bool, from: S, to: S, cut_in: S, cut_out: S) -> Option<S> {
    let (limit, crossed) = if running {
        (cut_out, to.re() > cut_out.re() && to.re() > from.re())
    } else {
        (cut_in, to.re() < cut_in.re() && to.re() < from.re())
    };
    crossed.then(|| {
        let left = (to - limit) / (to - from);
        if left.re() > 1.0 {
            S::from(1.0)
        } else {
            left
        }
    })
}

/// A compressor at a tank; its state is 1 while it runs.
#[derive(Debug, Clone, Copy)]
struct Compressor<S> {
    free_air_delivery: S,
    cut_in: S,
    cut_out: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Compressor { free_air_delivery: values[0], cut_in: values[1], cut_out: values[2] })
}

impl<S: Scalar> Compressor<S> {
    /// Its limits, absolute [Pa].
    fn limits(&self, gas: &Gas) -> (S, S) {
        (self.cut_in + gas.ambient_pressure, self.cut_out + gas.ambient_pressure)
    }
}

impl<S: Scalar> Effect<S> for Compressor<S> {
    fn start(&self, gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Supply { pressure, .. } = at {
            let low = pressure.re() - gas.ambient_pressure < self.cut_in.re();
            own[0] = constant(if low { RUNNING } else { 0.0 });
        }
    }

    fn feed(&self, own: &[S], _pressure: S, drawn: &mut S, _set: &mut S) {
        if own[0].re() > 0.5 {
            *drawn -= mass_flow(self.free_air_delivery);
        }
    }

    fn switched(&self, gas: &Gas, own: &mut [S], from: S, to: S, step: f64) -> Option<(S, f64)> {
        let running = own[0].re() == RUNNING;
        let (cut_in, cut_out) = self.limits(gas);
        let left = turned(running, from, to, cut_in, cut_out)?;
        own[0] = constant(if running { 0.0 } else { RUNNING });
        Some((mass_flow(self.free_air_delivery) * left, if running { -step } else { step }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_relay_turns_where_the_pressure_crosses() {
        assert_eq!(turned(false, 10.0, 8.0, 8.5, 12.0), Some(0.25));
        assert_eq!(turned(false, 10.0, 9.0, 8.5, 12.0), None);
        assert_eq!(turned(true, 10.0, 11.0, 8.5, 12.0), None);
        assert_eq!(turned(true, 11.0, 13.0, 8.5, 12.0), Some(0.5));
        assert!((mass_flow(1e-3) - 1.185e-3_f64).abs() < 1e-15);
    }
}
