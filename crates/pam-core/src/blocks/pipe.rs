//! Long pipe by the squares of its pressures.
//!
//! Isothermal flow whose friction is laminar at small and turbulent at large flows:
//! `p_1^2 - p_2^2 = p_x^2 + p_l p_x` with `p_x = mdot/(C rho0 sqrt(T0/T))`, the pressure that would
//! drive the flow into a vacuum without laminar friction. `C` is the sonic conductance of a
//! restriction that passes as much there (ISO 6358); `p_l` is `p_x` where both frictions are alike.
//! A. H. Shapiro, *The Dynamics and Thermodynamics of Compressible Fluid Flow*, 1953, chapter 6
//! (isothermal flow in long ducts, with one friction factor); a laminar and a turbulent part beside
//! each other are used commonly.

use super::tube::{MOST_TOLD, REFERENCE_DENSITY, REFERENCE_TEMPERATURE};
use crate::scalar::{constant, Scalar};

/// A pipe at one gas temperature.
#[derive(Debug, Clone, Copy)]
pub struct Pipe<S> {
    /// Turbulent mass flow into a vacuum per upstream pressure [kg/(s Pa)].
    flow_factor: S,
    /// Where laminar friction is as large as turbulent [Pa].
    laminar: S,
}

impl<S: Scalar> Pipe<S> {
    /// A pipe of a sonic conductance [m3/(s Pa)] and a laminar pressure [Pa] with gas of a
    /// temperature [K].
    pub fn new(conductance: S, laminar: S, temperature: f64) -> Self {
        let factor = REFERENCE_DENSITY * (REFERENCE_TEMPERATURE / temperature).sqrt();
        Self { flow_factor: conductance * factor, laminar }
    }

    /// The same without derivatives.
    #[inline]
    pub fn re(&self) -> Pipe<f64> {
        Pipe { flow_factor: self.flow_factor.re(), laminar: self.laminar.re() }
    }

    /// Mass flow into a vacuum per upstream pressure, were there no laminar friction [kg/(s Pa)].
    #[inline]
    pub fn flow_factor(&self) -> f64 {
        self.flow_factor.re()
    }

    /// Mass flow [kg/s] between two absolute pressures [Pa], negative against the arrow.
    #[inline]
    pub fn mass_flow(&self, upstream: S, downstream: S) -> S {
        if upstream.re() < downstream.re() {
            return -self.mass_flow(downstream, upstream);
        }
        let squares = (upstream - downstream) * (upstream + downstream);
        let laminar = self.laminar;
        let driving = squares * 2.0 / (laminar + (laminar * laminar + squares * 4.0).sqrt());
        self.flow_factor * driving
    }

    /// Absolute pressure [Pa] at the other end, from that at this one and the mass flow from here
    /// to there [kg/s]: the inverse of [`Self::mass_flow`]. A flow that takes nearly all of the
    /// pressure here says little of the other end, which is then held at a small share of it.
    pub fn other_end(&self, here: S, flow: S) -> S {
        let driving = flow / self.flow_factor;
        let lost = driving * (driving.abs() + self.laminar);
        let square = here * here;
        let least = square * (1.0 - MOST_TOLD * MOST_TOLD);
        let there = square - lost;
        if there.re() > least.re() {
            there.sqrt()
        } else {
            least.sqrt()
        }
    }
}

impl Pipe<f64> {
    /// The same in another scalar type.
    #[inline]
    pub fn lift<S: Scalar>(&self) -> Pipe<S> {
        Pipe { flow_factor: constant(self.flow_factor), laminar: constant(self.laminar) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_flows_are_laminar_and_large_ones_turbulent() {
        let pipe = Pipe::new(1.2e-8, 1e3, 293.15);
        let small = |d: f64| pipe.mass_flow(2e5 + d, 2e5);
        assert!((small(0.002) / small(0.001) - 2.0).abs() < 1e-3);
        let large = |p: f64| pipe.mass_flow(p, 1.0);
        assert!((large(2e6) / large(1e6) - 2.0).abs() < 1e-2);
        assert!((large(2e6) / (1.2e-8 * REFERENCE_DENSITY * 2e6) - 1.0).abs() < 1e-3);
        assert_eq!(pipe.mass_flow(3e5, 3e5), 0.0);
        assert_eq!(pipe.mass_flow(2e5, 3e5), -pipe.mass_flow(3e5, 2e5));
    }

    #[test]
    fn a_flow_tells_the_other_end() {
        let pipe = Pipe::new(1.2e-8, 2e4, 293.15);
        for there in [1e5_f64, 2.9e5, 3e5, 3.1e5, 9e5] {
            let found: f64 = pipe.other_end(3e5, pipe.mass_flow(3e5, there));
            assert!((found / there - 1.0).abs() < 1e-12, "{there}: {found}");
        }
        let most = pipe.mass_flow(3e5, 1.0);
        assert!(pipe.other_end(3e5, 2.0 * most) > 0.0);
    }
}
