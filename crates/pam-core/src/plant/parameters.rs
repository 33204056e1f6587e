//! The scalar parameters of a rig as one table, so that any of them can carry a derivative.

use crate::dual::Dual;
use crate::error::check_range;
use crate::keys::{Bounds, Key};
use crate::scalar::{constant, Scalar};
use crate::{Error, Result};
use std::sync::Arc;

/// An error for a value outside its bounds.
fn check(name: &str, value: f64, (low, high, unit): Bounds) -> Result<()> {
    check_range(name, value, low, high, unit).map(|_| ())
}

/// Place of a scalar parameter in the table of its rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ParameterId(usize);

impl ParameterId {
    /// Its number in the table.
    #[must_use]
    pub fn index(self) -> usize {
        self.0
    }
}

/// Names, bounds and values of the scalar parameters of a rig.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    table: Arc<Table>,
    values: Vec<f64>,
}

/// What does not change with the values.
#[derive(Debug, Clone, Default)]
struct Table {
    names: Vec<String>,
    bounds: Vec<Bounds>,
    /// Other names of some of them.
    others: Vec<(String, ParameterId)>,
}

impl Parameters {
    /// Append a parameter of a block, under the name of the block in full and its own, for example
    /// `valve.flexor.null_voltage`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a value outside its bounds.
    pub(crate) fn add(&mut self, block: &str, key: &Key, value: f64) -> Result<ParameterId> {
        self.add_between(format!("{block}.{}", key.name), value, key.bounds())
    }

    /// The same for one that is no key of a block.
    pub(crate) fn add_between(
        &mut self,
        name: String,
        value: f64,
        bounds: Bounds,
    ) -> Result<ParameterId> {
        check(&name, value, bounds)?;
        let table = Arc::make_mut(&mut self.table);
        table.names.push(name);
        table.bounds.push(bounds);
        self.values.push(value);
        Ok(ParameterId(self.values.len() - 1))
    }

    /// Let a parameter be found by another name too.
    pub(crate) fn also(&mut self, name: String, id: ParameterId) {
        Arc::make_mut(&mut self.table).others.push((name, id));
    }

    /// The same parameters with other values, in their order.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of them, [`Error::Parameter`] for a value outside its
    /// bounds.
    pub fn with_values(&self, values: &[f64]) -> Result<Self> {
        let expected = self.values.len();
        if values.len() != expected {
            let (name, why) = ("values".into(), "one for each parameter".into());
            return Err(Error::Length { name, found: values.len(), expected, why });
        }
        for (k, value) in values.iter().enumerate().filter(|(k, value)| self.values[*k] != **value)
        {
            check(&self.table.names[k], *value, self.table.bounds[k])?;
        }
        Ok(Self { table: Arc::clone(&self.table), values: values.to_vec() })
    }

    /// The place of a dotted name.
    ///
    /// # Errors
    /// [`Error::Model`] that lists the names when there is none.
    pub fn find(&self, name: &str) -> Result<ParameterId> {
        let Table { names, others, .. } = &*self.table;
        let other = || others.iter().find(|(n, _)| n == name).map(|(_, id)| *id);
        names.iter().position(|n| n == name).map(ParameterId).or_else(other).ok_or_else(|| {
            let known = names.join(", ");
            Error::Model(format!("no scalar parameter '{name}' that can vary; there are: {known}"))
        })
    }

    /// All values, in the order of the names.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Dotted names, in the order of the table.
    pub fn names(&self) -> &[String] {
        &self.table.names
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

impl<const N: usize> Values<Dual<N>> {
    /// Give a parameter the unit derivative in one lane.
    pub fn seed(&mut self, id: ParameterId, lane: usize) {
        if let Some(value) = self.values.get_mut(id.0) {
            *value = value.along(lane);
        }
    }
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
    use crate::key;

    #[test]
    fn names_are_found_and_unknown_names_are_errors() {
        let mut table = Parameters::default();
        let (a, b) = (
            table.add("arm", key!("arm", "payload"), 2.0).unwrap(),
            table.add("valve.flexor", key!("valve", "null_voltage"), 5.0).unwrap(),
        );
        assert_eq!(table.find("valve.flexor.null_voltage").unwrap(), b);
        assert_eq!((table.value(a), table.lift::<f64>()[b]), (2.0, 5.0));
        assert!(table.find("arm.weight").unwrap_err().to_string().contains("arm.payload"));
    }
}
