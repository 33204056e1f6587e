//! A force model with the elastic parameters of a muscle.

use super::elbow_linear::{Factors, CONTRACTION};
use super::model::{Coefficients, ForceModel};
use super::spec::MuscleSpec;
use crate::braid::{Braid, Shape};
use crate::error::Result;
use crate::scalar::Scalar;

/// A force model with its elastic parameters, for one direction of motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Elasticity {
    model: ForceModel,
    slope: Vec<f64>,
    offset: Vec<f64>,
    factors: Factors,
}

impl Elasticity {
    /// The model and parameters of a muscle while it contracts.
    ///
    /// # Errors
    /// [`Error::Choice`] for an unknown model.
    pub fn contracting(spec: &MuscleSpec) -> Result<Self> {
        let model = spec.force_model()?;
        let (slope, offset) = match model {
            ForceModel::Gaylord | ForceModel::ChouHannaford | ForceModel::Map => {
                (Vec::new(), Vec::new())
            }
            ForceModel::MooneyRivlin => (vec![0.0; 2], vec![spec.c10, spec.c01]),
            ForceModel::ElbowLinear => (vec![0.0], vec![spec.bladder_modulus]),
            _ => (spec.modulus_slope.clone(), spec.modulus_offset.clone()),
        };
        Ok(Self { model, slope, offset, factors: CONTRACTION })
    }

    /// The same while it lengthens, if the model has a branch of its own for that.
    #[must_use]
    pub fn lengthening(&self, spec: &MuscleSpec) -> Option<Self> {
        let apart = self.model == ForceModel::ElbowLinear && spec.extension_factors != CONTRACTION;
        apart.then(|| Self { factors: spec.extension_factors, ..self.clone() })
    }

    /// Number of elastic parameters that act on one pressure.
    #[must_use]
    pub fn order(&self) -> usize {
        self.offset.len()
    }

    /// The coefficients at a solved shape.
    pub fn coefficients<S: Scalar>(&self, braid: &Braid, shape: &Shape<S>) -> Coefficients<S> {
        Coefficients {
            a_gas: self.model.gas(braid, shape, self.factors),
            a_elastic: self.model.elastic(&self.slope, braid, shape, self.factors),
            b_elastic: self.model.elastic(&self.offset, braid, shape, self.factors),
        }
    }

    /// Force per unit of each elastic parameter [m2].
    pub fn basis(&self, braid: &Braid, shape: &Shape) -> Vec<f64> {
        let mut unit = vec![0.0; self.order()];
        (0..self.order())
            .map(|j| {
                unit[j] = 1.0;
                let force = self.model.elastic(&unit, braid, shape, self.factors);
                unit[j] = 0.0;
                force
            })
            .collect()
    }
}
