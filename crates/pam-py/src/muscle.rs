//! `_core.Muscle`: one muscle, exact or from its table.

use crate::convert::{array, error, values};
use numpy::{PyArray1, PyReadonlyArray1};
use pam_core::error::check_range;
use pam_core::muscle::Muscle as CoreMuscle;
use pam_core::rig::spec::muscle_from_json;
use pyo3::prelude::*;

/// A muscle compiled from a JSON description (SI, radians).
#[pyclass(frozen, module = "pamrs._core")]
pub struct Muscle {
    inner: CoreMuscle,
}

impl Muscle {
    fn map<'py>(
        &self,
        py: Python<'py>,
        contraction: &PyReadonlyArray1<'py, f64>,
        f: impl Fn(&CoreMuscle, usize, f64) -> pam_core::Result<f64> + Send + Sync,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let e = values(contraction);
        let inner = &self.inner;
        let result: pam_core::Result<Vec<f64>> =
            py.detach(|| e.iter().enumerate().map(|(k, e)| f(inner, k, *e)).collect());
        result.map(|v| array(py, v)).map_err(|e| error(py, &e))
    }
}

#[pymethods]
impl Muscle {
    #[new]
    fn new(py: Python<'_>, json: &str) -> PyResult<Self> {
        let made = py.detach(|| {
            let spec = muscle_from_json(json)?;
            CoreMuscle::new(&spec)
        });
        Ok(Self { inner: made.map_err(|e| error(py, &e))? })
    }

    /// Outer radius [m] at contraction ratios.
    fn radius<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, _, e| m.radius(e))
    }

    /// Wall thickness [m] at contraction ratios.
    fn thickness<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, _, e| m.thickness(e))
    }

    /// Air volume [m3] of one muscle at contraction ratios.
    fn air_volume<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, _, e| m.air_volume(e))
    }

    /// Force [N] of one muscle, exact solve, at gauge pressures [Pa] and contraction ratios of equal length.
    fn force<'py>(
        &self,
        py: Python<'py>,
        pressure: PyReadonlyArray1<'py, f64>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let p = values(&pressure);
        self.map(py, &contraction, |m, k, e| m.force(p.get(k).copied().unwrap_or(f64::NAN), e))
    }

    /// Force [N] of one muscle from the compiled table.
    fn force_table<'py>(
        &self,
        py: Python<'py>,
        pressure: PyReadonlyArray1<'py, f64>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let p = values(&pressure);
        self.map(py, &contraction, |m, k, e| {
            let pressure = check_range(
                "pressure",
                p.get(k).copied().unwrap_or(f64::NAN),
                -101_325.0,
                1e9,
                "Pa (gauge)",
            )?;
            let e = check_range("contraction", e, m.table.e_min, m.table.e_max, "(the table's range)")?;
            Ok(m.table.eval(e).force(pressure, m.spec.modulus_scale))
        })
    }

    /// Contraction ratios that the table covers.
    #[getter]
    fn contraction_range(&self) -> (f64, f64) {
        (self.inner.table.e_min, self.inner.table.e_max)
    }

    /// Largest relative error of the table against the exact solve.
    #[getter]
    fn table_error(&self) -> f64 {
        self.inner.table.error_bound()
    }
}
