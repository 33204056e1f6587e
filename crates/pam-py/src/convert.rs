//! Errors and arrays.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::{PyArithmeticError, PyValueError};
use pyo3::prelude::*;

/// A core error as a Python exception of the package.
pub fn error(py: Python<'_>, e: &pam_core::Error) -> PyErr {
    let class = match e {
        pam_core::Error::Integration { .. } => "SimulationError",
        pam_core::Error::Model(_) => "RigError",
        _ => "ParameterError",
    };
    match py
        .import("pamrs.errors")
        .and_then(|m| m.getattr(class))
        .and_then(|c| c.call1((e.to_string(),)))
    {
        Ok(instance) => PyErr::from_value(instance),
        Err(_) if class == "SimulationError" => PyArithmeticError::new_err(e.to_string()),
        Err(_) => PyValueError::new_err(e.to_string()),
    }
}

/// Copy a one-dimensional array (any stride) out of Python.
pub fn values(array: &PyReadonlyArray1<'_, f64>) -> Vec<f64> {
    array.as_array().iter().copied().collect()
}

/// Hand a vector to Python.
pub fn array(py: Python<'_>, values: Vec<f64>) -> Bound<'_, PyArray1<f64>> {
    PyArray1::from_vec(py, values)
}
