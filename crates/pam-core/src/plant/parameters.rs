//! The scalar parameters of a rig as one table, so that any of them can carry a derivative.

use crate::scalar::{constant, Scalar};
use crate::{Error, Result};
use nalgebra::Const;
use num_dual::{Derivative, DualSVec64};

/// Place of a scalar parameter in the table of its rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ParameterId(usize);

/// Names and values of the scalar parameters of a rig.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    names: Vec<String>,
    values: Vec<f64>,
}

impl Parameters {
    /// Append a parameter by its dotted name, for example `valve.flexor.null_voltage`.
    pub(crate) fn add(&mut self, name: String, value: f64) -> ParameterId {
        self.names.push(name);
        self.values.push(value);
        ParameterId(self.values.len() - 1)
    }

    /// The place of a dotted name.
    ///
    /// # Errors
    /// [`Error::Model`] that lists the names when there is none.
    pub fn find(&self, name: &str) -> Result<ParameterId> {
        self.names.iter().position(|n| n == name).map(ParameterId).ok_or_else(|| {
            Error::Model(format!(
                "no scalar parameter '{name}' that can vary; there are: {}",
                self.names.join(", ")
            ))
        })
    }

    /// Dotted names, in the order of the table.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The value at a place (NaN where there is none).
    pub fn value(&self, id: ParameterId) -> f64 {
        self.values.get(id.0).copied().unwrap_or(f64::NAN)
    }

    /// All values in a scalar type.
    pub fn lift<S: Scalar>(&self) -> Values<S> {
        Values { values: self.values.iter().map(|v| constant(*v)).collect() }
    }
}

/// Values of all parameters in a scalar type.
#[derive(Debug, Clone)]
pub struct Values<S> {
    values: Vec<S>,
}

impl<const N: usize> Values<DualSVec64<N>> {
    /// Give a parameter the unit derivative in one lane.
    pub fn seed(&mut self, id: ParameterId, lane: usize) {
        if let Some(value) = self.values.get_mut(id.0) {
            value.eps = unit(lane);
        }
    }
}

/// Unit derivative in one lane (none when the lane does not exist).
pub fn unit<const N: usize>(lane: usize) -> Derivative<f64, Const<N>, Const<1>> {
    let mut gradient = nalgebra::SVector::<f64, N>::zeros();
    if let Some(entry) = gradient.get_mut(lane) {
        *entry = 1.0;
    }
    Derivative::some(gradient)
}

impl<S: Scalar> std::ops::Index<ParameterId> for Values<S> {
    type Output = S;

    #[inline(always)]
    fn index(&self, id: ParameterId) -> &S {
        &self.values[id.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_and_unknown_names_are_errors() {
        let mut table = Parameters::default();
        let (a, b) =
            (table.add("arm.payload".into(), 2.0), table.add("valve.flexor.null_voltage".into(), 5.0));
        assert_eq!(table.find("valve.flexor.null_voltage").unwrap(), b);
        assert_eq!((table.value(a), table.lift::<f64>()[b]), (2.0, 5.0));
        assert!(table.find("arm.weight").unwrap_err().to_string().contains("arm.payload"));
    }
}
