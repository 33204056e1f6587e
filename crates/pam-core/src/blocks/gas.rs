//! Isentropic orifice flow, choked, subsonic and (next to equal pressures) laminar.
//!
//! `mdot = Cd A pu sqrt(2/(R T)) psi(pd/pu)`, dissertation (3.13)-(3.16) with the choked and
//! subsonic branches in their right order and the exponent `(gamma+1)/gamma`.

use crate::scalar::{constant, Scalar};

/// Pressure ratio above which the flow is taken as laminar, linear in `1 - r`; it removes the
/// infinite slope of the subsonic branch at `r = 1`.
pub const LAMINAR_RATIO: f64 = 0.999;

/// Constants of the gas and of the orifice equation that follow from them.
#[derive(Debug, Clone, Copy)]
pub struct Gas {
    /// Ambient pressure [Pa, absolute].
    pub ambient_pressure: f64,
    /// Gas temperature [K].
    pub temperature: f64,
    /// Specific gas constant [J/(kg K)].
    pub gas_constant: f64,
    /// Heat capacity ratio [1].
    pub gamma: f64,
    flow_factor: f64,
    critical_ratio: f64,
    psi_choked: f64,
    psi_laminar: f64,
}

impl Gas {
    /// The derived constants of a gas.
    pub fn new(ambient_pressure: f64, temperature: f64, gas_constant: f64, gamma: f64) -> Self {
        let psi_choked =
            (2.0 / (gamma + 1.0)).powf(1.0 / (gamma - 1.0)) * (gamma / (gamma + 1.0)).sqrt();
        let mut gas = Self {
            ambient_pressure,
            temperature,
            gas_constant,
            gamma,
            flow_factor: (2.0 / (gas_constant * temperature)).sqrt(),
            critical_ratio: (2.0 / (gamma + 1.0)).powf(gamma / (gamma - 1.0)),
            psi_choked,
            psi_laminar: 0.0,
        };
        gas.psi_laminar = gas.subsonic(LAMINAR_RATIO);
        gas
    }

    fn subsonic<S: Scalar>(&self, ratio: S) -> S {
        // r^(2/g) - r^((g+1)/g) = s (s - r) with s = r^(1/g)
        let s = ratio.powf(1.0 / self.gamma);
        (s * (s - ratio) * (self.gamma / (self.gamma - 1.0))).sqrt()
    }

    /// Flow function `psi(r)` of the ratio of downstream to upstream absolute pressure,
    /// `0 <= r <= 1` [1].
    #[inline]
    pub fn psi<S: Scalar>(&self, ratio: S) -> S {
        let r = ratio.re();
        if r <= self.critical_ratio {
            constant(self.psi_choked)
        } else if r <= LAMINAR_RATIO {
            self.subsonic(ratio)
        } else {
            (-ratio + 1.0) * (self.psi_laminar / (1.0 - LAMINAR_RATIO))
        }
    }

    /// Mass flow [kg/s] from `upstream` to `downstream` (absolute pressures [Pa]) through a
    /// discharge area `Cd A` [m2]; negative when the downstream pressure is the higher one.
    #[inline]
    pub fn mass_flow<S: Scalar>(&self, area: S, upstream: S, downstream: S) -> S {
        if upstream.re() >= downstream.re() {
            area * upstream * self.psi(downstream / upstream) * self.flow_factor
        } else {
            -(area * downstream * self.psi(upstream / downstream) * self.flow_factor)
        }
    }

    /// Pressure ratio below which the flow is choked [1].
    #[inline]
    pub fn critical_ratio(&self) -> f64 {
        self.critical_ratio
    }

    /// Largest change of mass flow per pressure [kg/(s Pa)] of a discharge area [m2]: next to equal
    /// pressures.
    pub fn steepest(&self, area: f64) -> f64 {
        area * self.flow_factor * self.psi_laminar / (1.0 - LAMINAR_RATIO)
    }

    /// Choked mass flow [kg/s] through a discharge area [m2] from an upstream absolute pressure
    /// [Pa].
    #[inline]
    pub fn choked_flow<S: Scalar>(&self, area: S, upstream: S) -> S {
        area * upstream * (self.psi_choked * self.flow_factor)
    }

    /// Discharge area [m2] that passes the choked flow of a sonic conductance [m3/(s Pa)] (ISO
    /// 6358: `mdot = C rho0 p`, `rho0` at 100 kPa and 293.15 K).
    pub fn area_of_conductance<S: Scalar>(&self, conductance: S) -> S {
        const ISO_DENSITY: f64 = 1.185;
        conductance
            * (ISO_DENSITY * (293.15 / self.temperature).sqrt()
                / (self.psi_choked * self.flow_factor))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn air() -> Gas {
        Gas::new(101_325.0, 293.15, 287.05, 1.4)
    }

    #[test]
    fn flow_function_is_continuous_and_falls() {
        let gas = air();
        for r in [gas.critical_ratio, LAMINAR_RATIO] {
            assert!((gas.psi(r - 1e-12) - gas.psi(r + 1e-12)).abs() < 1e-8, "jump at r = {r}");
        }
        let values: Vec<f64> = (0..=1000).map(|i| gas.psi(f64::from(i) / 1000.0)).collect();
        assert!(values.windows(2).all(|w| w[1] <= w[0] + 1e-15));
        assert_eq!(gas.psi(1.0), 0.0);
        assert!((gas.critical_ratio - 0.528_281_787_717).abs() < 1e-10);
    }

    #[test]
    fn flow_reverses_with_the_pressures() {
        let gas = air();
        assert_eq!(gas.mass_flow(1e-6, 5e5, 2e5), -gas.mass_flow(1e-6, 2e5, 5e5));
        assert!(gas.mass_flow(1e-6, 5e5, 2e5) > 0.0);
    }

    #[test]
    fn conductance_matches_iso_6358() {
        let gas = air();
        let area = gas.area_of_conductance(2.75e-8);
        let flow = gas.mass_flow(area, 7e5, 1e5);
        assert!((flow / (2.75e-8 * 1.185 * 7e5) - 1.0_f64).abs() < 1e-12);
    }
}
