//! Errors and arrays.

use numpy::ndarray::Dimension;
use numpy::{PyArray1, PyReadonlyArray};
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

/// Numbers of an array that are copied at most: 2 GB. One with a stride of zero holds none of them.
const MOST_NUMBERS: usize = 250_000_000;

/// Copy an array (any stride) out of Python.
///
/// # Errors
/// `ValueError` for one of more than 2 GB, or than there is memory for.
pub fn values<D: Dimension>(array: &PyReadonlyArray<'_, f64, D>) -> PyResult<Vec<f64>> {
    let (array, mut copied) = (array.as_array(), Vec::new());
    if array.len() > MOST_NUMBERS || copied.try_reserve_exact(array.len()).is_err() {
        return Err(PyValueError::new_err(format!(
            "an array of {} numbers is not allowed: at most {MOST_NUMBERS} (2 GB)",
            array.len()
        )));
    }
    copied.extend(array.iter().copied());
    Ok(copied)
}

/// Hand a vector to Python.
pub fn array(py: Python<'_>, values: Vec<f64>) -> Bound<'_, PyArray1<f64>> {
    PyArray1::from_vec(py, values)
}
