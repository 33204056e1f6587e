//! The force models, by name, and what all of them have in common.
//!
//! Every model of the physics reference's section 2 is linear in gauge pressure and in its elastic
//! parameters:
//!
//! ```text
//! F = P gas(L) + scale sum_j (slope_j P + offset_j) basis_j(L)
//! ```
//!
//! so a muscle at one length comes down to three [`Coefficients`], whichever its model, and one
//! linear least squares finds its elastic parameters.

use super::elbow_linear::Factors;
use super::{chou_hannaford, elbow_linear, ferraresi, gaylord, kothera, mooney_rivlin, robinson};
use crate::braid::{Braid, Profile, Shape};
use crate::error::{named, Result};
use crate::scalar::{constant, Scalar};

/// Coefficients of the force of one muscle at one length:
/// `F = P a_gas + scale (P a_elastic + b_elastic)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients<S = f64> {
    /// Force per gauge pressure of the gas [m2].
    pub a_gas: S,
    /// Force per gauge pressure of the pressure-dependent moduli [m2].
    pub a_elastic: S,
    /// Force of the constant moduli [N].
    pub b_elastic: S,
}

impl<S: Scalar> Coefficients<S> {
    /// Force [N] at gauge pressure `pressure` [Pa].
    pub fn force(&self, pressure: S, modulus_scale: S) -> S {
        pressure * self.a_gas + modulus_scale * (pressure * self.a_elastic + self.b_elastic)
    }
}

/// A quasi-static force model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceModel {
    /// See [`gaylord`].
    Gaylord,
    /// See [`chou_hannaford`].
    ChouHannaford,
    /// See [`mooney_rivlin`].
    MooneyRivlin,
    /// See [`ferraresi`].
    Ferraresi,
    /// See [`kothera`].
    Kothera,
    /// See [`robinson`].
    Robinson,
    /// See [`elbow_linear`].
    ElbowLinear,
    /// See [`super::map`]: the force is not linear in pressure, and stands beside the coefficients.
    Map,
}

impl ForceModel {
    /// Names, in the order of the physics reference.
    pub const NAMES: [(&'static str, Self); 8] = [
        ("gaylord", Self::Gaylord),
        ("chou_hannaford", Self::ChouHannaford),
        ("mooney_rivlin", Self::MooneyRivlin),
        ("ferraresi", Self::Ferraresi),
        ("kothera", Self::Kothera),
        ("robinson", Self::Robinson),
        ("elbow_linear", Self::ElbowLinear),
        ("map", Self::Map),
    ];

    /// The model of a name.
    ///
    /// # Errors
    /// [`Error::Choice`] that lists the names.
    pub fn from_name(name: &str) -> Result<Self> {
        named("muscle.model", name, &Self::NAMES)
    }

    /// Whether its elasticity is a polynomial stress with moduli linear in pressure.
    #[must_use]
    pub fn is_polynomial(self) -> bool {
        matches!(self, Self::Ferraresi | Self::Kothera | Self::Robinson)
    }

    /// The outer profile that its source has.
    #[must_use]
    pub fn profile(self) -> Profile {
        if self == Self::Robinson {
            Profile::Elliptic
        } else {
            Profile::Cylinder
        }
    }

    /// Force per gauge pressure of the gas [m2].
    pub fn gas<S: Scalar>(self, braid: &Braid, shape: &Shape<S>, factors: Factors) -> S {
        match self {
            Self::Gaylord | Self::MooneyRivlin | Self::Ferraresi => gaylord::gas(braid, shape),
            Self::ChouHannaford => chou_hannaford::gas(braid, shape),
            Self::Kothera => kothera::gas(braid, shape),
            Self::Robinson => robinson::gas(braid, shape),
            Self::ElbowLinear => elbow_linear::gas(braid, shape, factors),
            Self::Map => constant(0.0),
        }
    }

    /// Force [N] of elastic parameters [Pa]; linear in them.
    pub fn elastic<S: Scalar>(
        self,
        moduli: &[f64],
        braid: &Braid,
        shape: &Shape<S>,
        factors: Factors,
    ) -> S {
        match self {
            Self::Gaylord | Self::ChouHannaford | Self::Map => constant(0.0),
            Self::MooneyRivlin => mooney_rivlin::elastic(moduli, braid, shape),
            Self::Ferraresi => ferraresi::elastic(moduli, braid, shape),
            Self::Kothera => kothera::elastic(moduli, braid, shape),
            Self::Robinson => robinson::elastic(moduli, braid, shape),
            Self::ElbowLinear => elbow_linear::elastic(moduli, braid, shape, factors),
        }
    }
}
