//! `compressor_cut_in`: a compressor that starts at one pressure of the tank and stops at another.
//!
//! `m_c = s Q rho0`, `s` from 0 to 1 when the gauge pressure falls below the cut-in pressure and back when it rises above the cut-out
//! pressure; `Q` is the free air delivery (ISO 1217: volume at the reference state of ISO 6358). The relay turns between steps;
//! what it gives in the rest of the step in which the pressure crosses is added by the share of the step that is left, so that the
//! moment moves with the pressures and not by whole steps. Acts on tanks.

use super::{EffectInfo, EffectParameter};
use crate::blocks::tube::REFERENCE_DENSITY;
use crate::scalar::Scalar;

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "compressor_cut_in",
    block: "supply",
    at: "supply",
    parameters: &[
        EffectParameter::new("free_air_delivery", "m3/s"),
        EffectParameter::new("cut_in_pressure", "Pa"),
        EffectParameter::new("cut_out_pressure", "Pa"),
    ],
};

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
