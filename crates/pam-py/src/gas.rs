//! `_core.Gas`: the orifice law, and that of a sonic conductance.

use crate::convert::{array, error, values};
use numpy::{PyArray1, PyReadonlyArray1};
use pam_core::blocks::gas::Gas as CoreGas;
use pam_core::blocks::tube::Tube;
use pam_core::error::check_range;
use pam_core::key;
use pyo3::prelude::*;

/// A gas with its orifice law (SI units, absolute pressures).
#[pyclass(frozen, module = "pamrs._core")]
pub struct Gas {
    inner: CoreGas,
    temperature: f64,
}

#[pymethods]
impl Gas {
    #[new]
    fn new(
        py: Python<'_>,
        ambient_pressure: f64,
        temperature: f64,
        gas_constant: f64,
        heat_capacity_ratio: f64,
    ) -> PyResult<Self> {
        let checked = [
            (key!("gas", "ambient_pressure"), ambient_pressure),
            (key!("gas", "temperature"), temperature),
            (key!("gas", "gas_constant"), gas_constant),
            (key!("gas", "heat_capacity_ratio"), heat_capacity_ratio),
        ];
        for (key, value) in checked {
            key.check(key.name, value).map_err(|e| error(py, &e))?;
        }
        Ok(Self {
            inner: CoreGas::new(ambient_pressure, temperature, gas_constant, heat_capacity_ratio),
            temperature,
        })
    }

    /// Mass flow [kg/s] through a discharge area [m2] from an upstream pressure [Pa] to downstream
    /// pressures [Pa].
    fn mass_flow<'py>(
        &self,
        py: Python<'py>,
        area: f64,
        upstream: f64,
        downstream: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let flow = |p: f64| {
            check_range("downstream", p, 0.0, 1e9, "Pa (absolute)")?;
            Ok(self.inner.mass_flow(area, upstream, p))
        };
        check_range("area", area, 0.0, 1.0, "m2").map_err(|e| error(py, &e))?;
        check_range("upstream", upstream, 1.0, 1e9, "Pa (absolute)").map_err(|e| error(py, &e))?;
        let flows: pam_core::Result<Vec<f64>> =
            values(&downstream)?.into_iter().map(flow).collect();
        flows.map(|v| array(py, v)).map_err(|e| error(py, &e))
    }

    /// Mass flow [kg/s] through a sonic conductance [m3/(s Pa)] with a critical pressure ratio [1]
    /// (ISO 6358) from an upstream pressure [Pa] to downstream pressures [Pa].
    fn conductance_flow<'py>(
        &self,
        py: Python<'py>,
        conductance: f64,
        critical_ratio: f64,
        upstream: f64,
        downstream: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let checked = [
            ("conductance", conductance, 0.0, 1.0, "m3/(s Pa)"),
            ("critical_ratio", critical_ratio, 0.0, 0.99, "(1)"),
            ("upstream", upstream, 1.0, 1e9, "Pa (absolute)"),
        ];
        for (name, value, low, high, unit) in checked {
            check_range(name, value, low, high, unit).map_err(|e| error(py, &e))?;
        }
        let tube = Tube::<f64>::of_conductance(conductance, critical_ratio, self.temperature);
        let flow = |p: f64| {
            check_range("downstream", p, 0.0, 1e9, "Pa (absolute)")?;
            Ok(tube.mass_flow(upstream, p))
        };
        let flows: pam_core::Result<Vec<f64>> =
            values(&downstream)?.into_iter().map(flow).collect();
        flows.map(|v| array(py, v)).map_err(|e| error(py, &e))
    }

    /// Discharge area [m2] of a sonic conductance [m3/(s Pa)] (ISO 6358).
    fn area_of_conductance(&self, py: Python<'_>, conductance: f64) -> PyResult<f64> {
        let conductance = check_range("conductance", conductance, 0.0, 1.0, "m3/(s Pa)");
        conductance.map(|c| self.inner.area_of_conductance(c)).map_err(|e| error(py, &e))
    }
}
