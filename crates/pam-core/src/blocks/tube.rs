//! Tube by its conductance and critical pressure ratio.
//!
//! `mdot = C rho0 p_up sqrt(T0/T) psi(r)`, `psi = sqrt(1 - ((r - b)/(1 - b))^2)` above `b` (ISO
//! 6358-1:2013, linear above [`LAMINAR_RATIO`]), with `C = 0.029 d^2/sqrt(L/d^1.25 + 510)` and
//! `b = 474 C/d^2` of a tube (ISO 6358-3 practice; P. Beater, *Pneumatic Drives*, 2007).

use super::gas::LAMINAR_RATIO;
use crate::scalar::{constant, Scalar};

/// Density at the reference state, 100 kPa and [`REFERENCE_TEMPERATURE`] [kg/m3].
pub const REFERENCE_DENSITY: f64 = 1.185;
/// Reference temperature [K].
pub const REFERENCE_TEMPERATURE: f64 = 293.15;
const HIGHEST_RATIO: f64 = 0.9;
/// Share of the choked flow up to which a flow tells the pressure that it goes to [1].
pub const MOST_TOLD: f64 = 0.99;

/// A tube at one gas temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tube<S> {
    /// Choked mass flow per upstream pressure [kg/(s Pa)].
    pub(super) flow_factor: S,
    /// Critical pressure ratio [1].
    pub(super) critical_ratio: S,
}

impl<S: Scalar> Tube<S> {
    /// A tube of a length and an inner diameter [m] with gas of a temperature [K].
    pub fn new(length: S, diameter: S, temperature: f64) -> Self {
        let square = diameter * diameter;
        let conductance = square * 0.029 / (length / diameter.powf(1.25) + 510.0).sqrt();
        let ratio = conductance * 474.0 / square;
        let critical_ratio =
            if ratio.re() > HIGHEST_RATIO { constant(HIGHEST_RATIO) } else { ratio };
        Self::of_conductance(conductance, critical_ratio, temperature)
    }

    /// A restriction of a sonic conductance [m3/(s Pa)] and a critical pressure ratio with gas of a
    /// temperature [K].
    pub fn of_conductance(conductance: S, critical_ratio: S, temperature: f64) -> Self {
        let factor = REFERENCE_DENSITY * (REFERENCE_TEMPERATURE / temperature).sqrt();
        Self { flow_factor: conductance * factor, critical_ratio }
    }

    /// One whose conductance is a share of this one's [1].
    #[inline]
    pub fn part(&self, share: S) -> Self {
        Self { flow_factor: self.flow_factor * share, critical_ratio: self.critical_ratio }
    }

    /// The same without derivatives.
    #[inline]
    pub fn re(&self) -> Tube<f64> {
        Tube { flow_factor: self.flow_factor.re(), critical_ratio: self.critical_ratio.re() }
    }

    /// Choked mass flow per upstream pressure [kg/(s Pa)].
    #[inline]
    pub fn flow_factor(&self) -> f64 {
        self.flow_factor.re()
    }

    /// Critical pressure ratio [1]: the flow is choked below.
    #[inline]
    pub fn critical_ratio(&self) -> f64 {
        self.critical_ratio.re()
    }

    #[inline]
    pub(super) fn psi(&self, ratio: S) -> S {
        let elliptic = |r: S| {
            let x = (r - self.critical_ratio) / (-self.critical_ratio + 1.0);
            (-x * x + 1.0).sqrt()
        };
        if ratio.re() <= self.critical_ratio.re() {
            constant(1.0)
        } else if ratio.re() <= LAMINAR_RATIO {
            elliptic(ratio)
        } else {
            elliptic(constant(LAMINAR_RATIO)) * (-ratio + 1.0) / (1.0 - LAMINAR_RATIO)
        }
    }

    /// Mass flow [kg/s] between two absolute pressures [Pa], negative against the arrow.
    #[inline]
    pub fn mass_flow(&self, upstream: S, downstream: S) -> S {
        if upstream.re() >= downstream.re() {
            self.flow_factor * upstream * self.psi(downstream / upstream)
        } else {
            -(self.flow_factor * downstream * self.psi(upstream / downstream))
        }
    }

    /// Absolute pressure [Pa] at the other end, from that at this one and the mass flow from here
    /// to there [kg/s]: the inverse of [`Self::mass_flow`] in closed form. A flow away from here
    /// says less and less of the other end the closer it is to choking: from [`MOST_TOLD`] of it
    /// on, the other end is held at the pressure that this share belongs to.
    pub fn other_end(&self, here: S, flow: S) -> S {
        let share = flow / (self.flow_factor * here);
        let (b, rest) = (self.critical_ratio, -self.critical_ratio + 1.0);
        let (edge, span) = (self.psi(constant(LAMINAR_RATIO)), 1.0 - LAMINAR_RATIO);
        if share.re() >= 0.0 {
            if share.re() <= edge.re() {
                return here * (-share * span / edge + 1.0);
            }
            let told = if share.re() < MOST_TOLD { share } else { constant(MOST_TOLD) };
            return here * (b + rest * (-told * told + 1.0).sqrt());
        }
        // psi(r)/r = g with the ratio r of the pressure here to the one there
        let g = -share;
        if g.re() * LAMINAR_RATIO <= edge.re() {
            here * (edge + g * span) / edge
        } else if g.re() * b.re() <= 1.0 {
            let wide = g * g * rest * rest + 1.0;
            here * wide / (b + (b * b + wide * (-b * 2.0 + 1.0)).sqrt())
        } else {
            here * g
        }
    }

    /// Largest change of mass flow per pressure [kg/(s Pa)]: next to equal pressures.
    pub fn steepest(&self) -> f64 {
        let psi = self.psi(constant(LAMINAR_RATIO)).re();
        self.flow_factor.re() * psi / (1.0 - LAMINAR_RATIO)
    }
}

impl Tube<f64> {
    /// The same in another scalar type.
    #[inline]
    pub fn lift<S: Scalar>(&self) -> Tube<S> {
        Tube {
            flow_factor: constant(self.flow_factor),
            critical_ratio: constant(self.critical_ratio),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Slope;

    #[test]
    fn a_metre_of_four_millimetres_has_the_tabulated_conductance() {
        let tube = Tube::<f64>::new(1.0, 0.004, 293.15);
        assert!((tube.flow_factor / REFERENCE_DENSITY - 1.2e-8).abs() < 0.02e-8);
        assert!((tube.critical_ratio() - 0.354).abs() < 0.002);
        assert!((tube.mass_flow(6e5, 1e5) / (1.2e-8 * 1.185 * 6e5) - 1.0).abs() < 0.01, "choked");
    }

    #[test]
    fn a_flow_tells_the_other_end() {
        let tube = Tube::<f64>::of_conductance(1.2e-8, 0.3, 293.15);
        let here = 4e5;
        for there in [1e3, 1e5, 1.3e5, 2e5, 3.9e5, 3.9999e5, 4e5, 4.001e5, 5e5, 1.3e6, 1.4e6, 9e6] {
            let found = tube.other_end(here, tube.mass_flow(here, there));
            let told = here * (0.3 + 0.7 * (1.0 - MOST_TOLD * MOST_TOLD).sqrt());
            assert!((found / f64::max(there, told) - 1.0).abs() < 1e-10, "{there}: {found}");
        }
        assert_eq!(tube.other_end(here, 0.0), here);
        for flow in [-1.0, -1e-3, -1e-5, 1e-5, 1e-3, 2e-3, 1.0] {
            let exact = tube.lift::<Slope>().other_end(here.into(), Slope::new(flow, 1.0));
            let h = 1e-6 * flow;
            let difference =
                (tube.other_end(here, flow + h) - tube.other_end(here, flow - h)) / (2.0 * h);
            assert!(
                (exact.slope() - difference).abs() <= 1e-6 * difference.abs(),
                "{flow}: {} {difference}",
                exact.slope()
            );
        }
    }

    #[test]
    fn flow_is_continuous_and_turns_with_the_pressures() {
        let tube = Tube::<f64>::new(2.0, 0.004, 293.15);
        for r in [tube.critical_ratio(), LAMINAR_RATIO] {
            let (a, b) =
                (tube.mass_flow(5e5, 5e5 * (r - 1e-12)), tube.mass_flow(5e5, 5e5 * (r + 1e-12)));
            assert!((a - b).abs() < 1e-8 * a, "jump at {r}");
        }
        assert_eq!(tube.mass_flow(3e5, 2e5), -tube.mass_flow(2e5, 3e5));
        assert_eq!(tube.mass_flow(3e5, 3e5), 0.0);
        let slope = tube.mass_flow(4e5, 4e5 - 1.0);
        assert!((slope / tube.steepest() - 1.0).abs() < 1e-6);
    }
}
