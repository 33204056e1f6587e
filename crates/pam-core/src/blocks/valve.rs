//! Valve from a supply to a chamber and from there to the ambient: command to opening.
//!
//! `x = clip((u - u0)/half_range, -1, 1)`; `A = A_max a(|x|)` with a piecewise linear area table;
//! `x > 0` fills the chamber from the supply, `x < 0` vents it. In the place of one area it may have
//! a sonic conductance `C` and a critical pressure ratio `b` for either path (ISO 6358-1:2013, which
//! gives every path of a component its own): `C a(|x|)`, the same `b` at every opening.

use super::gas::Gas;
use super::tube::Tube;
use crate::error::{Error, Result};
use crate::scalar::{constant, Scalar};

/// What air passes through between two pressures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Opening<S> {
    /// Discharge area `Cd A` [m2] of an orifice.
    Area(S),
    /// Sonic conductance and critical pressure ratio.
    Conductance(Tube<S>),
}

impl<S: Scalar> Opening<S> {
    /// A share of it [1].
    #[inline(always)]
    pub fn part(&self, share: S) -> Self {
        match self {
            Self::Area(area) => Self::Area(*area * share),
            Self::Conductance(tube) => Self::Conductance(tube.part(share)),
        }
    }

    /// Mass flow [kg/s] between two absolute pressures [Pa], negative against the arrow.
    #[inline(always)]
    pub fn mass_flow(&self, gas: &Gas, upstream: S, downstream: S) -> S {
        match self {
            Self::Area(area) => gas.mass_flow(*area, upstream, downstream),
            Self::Conductance(tube) => tube.mass_flow(upstream, downstream),
        }
    }

    /// Choked mass flow per upstream pressure [kg/(s Pa)].
    #[inline]
    pub fn choked(&self, gas: &Gas) -> f64 {
        match self {
            Self::Area(area) => gas.choked_flow(area.re(), 1.0),
            Self::Conductance(tube) => tube.flow_factor(),
        }
    }

    /// Whether nothing passes.
    #[inline]
    pub fn shut(&self) -> bool {
        match self {
            Self::Area(area) => area.re() <= 0.0,
            Self::Conductance(tube) => tube.flow_factor() <= 0.0,
        }
    }

    /// The same without derivatives.
    #[inline]
    pub fn re(&self) -> Opening<f64> {
        match self {
            Self::Area(area) => Opening::Area(area.re()),
            Self::Conductance(tube) => Opening::Conductance(tube.re()),
        }
    }

    /// Largest change of mass flow per pressure [kg/(s Pa)].
    pub fn steepest(&self, gas: &Gas) -> f64 {
        match self {
            Self::Area(area) => gas.steepest(area.re()),
            Self::Conductance(tube) => tube.steepest(),
        }
    }

    /// Pressure ratio below which the flow is choked [1].
    pub fn critical_ratio(&self, gas: &Gas) -> f64 {
        match self {
            Self::Area(_) => gas.critical_ratio(),
            Self::Conductance(tube) => tube.critical_ratio(),
        }
    }
}

impl Opening<f64> {
    /// The same in another scalar type.
    #[inline]
    pub fn lift<S: Scalar>(&self) -> Opening<S> {
        match self {
            Self::Area(area) => Opening::Area(constant(*area)),
            Self::Conductance(tube) => Opening::Conductance(tube.lift()),
        }
    }
}

/// Normalised area table `a(|x|)` of a valve.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaTable {
    opening: Vec<f64>,
    fraction: Vec<f64>,
}

impl AreaTable {
    /// A table from openings (0 to 1, strictly rising) and area fractions (not falling, from 0).
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::Parameter`] when the table is not of that form.
    pub fn new(opening: &[f64], fraction: &[f64]) -> Result<Self> {
        if opening.len() != fraction.len() || opening.len() < 2 {
            return Err(Error::Length {
                name: "valve.area_fraction.fraction".into(),
                found: fraction.len(),
                expected: opening.len().max(2),
                why: "one area fraction per opening, at least two".into(),
            });
        }
        let finite = opening.iter().chain(fraction).all(|v| v.is_finite());
        let last = opening[opening.len() - 1];
        if !finite || opening[0] != 0.0 || last != 1.0 || opening.windows(2).any(|w| w[1] <= w[0]) {
            return Err(Error::parameter(
                "valve.area_fraction.opening",
                last,
                "openings rising strictly from 0 to 1",
            ));
        }
        if fraction[0] < 0.0 || fraction.windows(2).any(|w| w[1] < w[0]) {
            return Err(Error::parameter(
                "valve.area_fraction.fraction",
                fraction[0],
                "area fractions >= 0 that do not fall",
            ));
        }
        Ok(Self { opening: opening.to_vec(), fraction: fraction.to_vec() })
    }

    /// Area fraction at an opening `|x|` in `[0, 1]` [1].
    #[inline]
    pub fn eval<S: Scalar>(&self, opening: S) -> S {
        let x = opening.re();
        let last = self.opening.len() - 1;
        let mut cell = 0;
        while cell + 1 < last && x > self.opening[cell + 1] {
            cell += 1;
        }
        let slope = (self.fraction[cell + 1] - self.fraction[cell])
            / (self.opening[cell + 1] - self.opening[cell]);
        (opening - self.opening[cell]) * slope + self.fraction[cell]
    }
}

/// Normalised spool position `x` in `[-1, 1]` for a command [V].
#[inline]
pub fn spool_position<S: Scalar>(command: f64, null_voltage: S, half_range: f64) -> S {
    let x = (-null_voltage + command) / half_range;
    if x.re() > 1.0 {
        constant(1.0)
    } else if x.re() < -1.0 {
        constant(-1.0)
    } else {
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_passes_its_points_and_rejects_nonsense() {
        let (x, a) = ([0.0, 0.25, 0.5, 0.75, 1.0], [0.0, 0.2, 0.5, 0.8, 1.0]);
        let table = AreaTable::new(&x, &a).unwrap();
        for (x, a) in x.iter().zip(a) {
            assert!((table.eval::<f64>(*x) - a).abs() < 1e-15);
        }
        assert!((table.eval::<f64>(0.125) - 0.1).abs() < 1e-15);
        assert!(AreaTable::new(&[0.0, 0.5], &[0.0, 1.0]).is_err());
        assert!(AreaTable::new(&[0.0, 1.0], &[0.5, 0.1]).is_err());
        assert!(AreaTable::new(&[0.0, f64::NAN, 1.0], &[0.0, 0.5, 1.0]).is_err());
        assert!(AreaTable::new(&[0.0], &[0.0]).is_err());
    }

    #[test]
    fn an_iso_valve_with_the_orifice_s_numbers_passes_about_as_much() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let area = 8.4e-6;
        let conductance = area / gas.area_of_conductance(1.0);
        let tube = Tube::<f64>::of_conductance(conductance, gas.critical_ratio(), 293.15);
        let (orifice, iso) = (Opening::Area(area), Opening::Conductance(tube));
        for (up, down) in [(7e5, 1e5), (7e5, 3.9e5), (7e5, 5e5), (7e5, 6.9e5), (2e5, 7e5)] {
            let ratio = iso.mass_flow(&gas, up, down) / orifice.mass_flow(&gas, up, down);
            assert!((ratio - 1.0).abs() < 0.008, "{up} {down}: {ratio}");
        }
        assert_eq!(iso.part(0.0).mass_flow(&gas, 7e5, 1e5), 0.0);
        assert!(iso.part(0.0).shut() && !iso.shut());
        let half = iso.part(0.5).mass_flow(&gas, 7e5, 5e5) / iso.mass_flow(&gas, 7e5, 5e5);
        assert!((half - 0.5).abs() < 1e-15);
        assert_eq!(iso.critical_ratio(&gas), orifice.critical_ratio(&gas));
    }

    #[test]
    fn spool_saturates() {
        assert_eq!(spool_position(11.0, 5.0, 5.0), 1.0);
        assert_eq!(spool_position(-3.0, 5.0, 5.0), -1.0);
        assert_eq!(spool_position(6.0, 5.0, 5.0), 0.2);
    }
}
