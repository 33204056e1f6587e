//! `_core.Muscle`: one muscle, exact or from its table.

use std::sync::OnceLock;

use crate::convert::{array, error, values};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pam_core::description::muscle_from_json;
use pam_core::muscle::{CompiledMuscle, MapSurface, Muscle as CoreMuscle};
use pam_core::Result;
use pyo3::prelude::*;

/// A table of forces over gauge pressure and contraction ratio, as a muscle with the model `map`
/// has it.
#[pyclass(frozen, module = "pamrs._core")]
pub struct ForceTable {
    inner: MapSurface,
}

#[pymethods]
impl ForceTable {
    #[new]
    fn new(
        py: Python<'_>,
        pressure: PyReadonlyArray1<'_, f64>,
        contraction: PyReadonlyArray1<'_, f64>,
        force: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        MapSurface::of(&values(&pressure)?, &values(&contraction)?, &values(&force)?)
            .map(|inner| Self { inner })
            .map_err(|e| error(py, &e))
    }

    /// Force [N] at gauge pressures [Pa] and contraction ratios, as many as there are of both.
    fn force<'py>(
        &self,
        py: Python<'py>,
        pressure: PyReadonlyArray1<'py, f64>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (p, e) = (values(&pressure)?, values(&contraction)?);
        let force = p.iter().zip(&e).map(|(p, e)| self.inner.force(*p, *e));
        Ok(array(py, force.collect()))
    }
}

/// A muscle made from a JSON description (SI, radians); its table is compiled when it is first
/// needed.
#[pyclass(frozen, module = "pamrs._core")]
pub struct Muscle {
    inner: CoreMuscle,
    compiled: OnceLock<CompiledMuscle>,
}

impl Muscle {
    /// One number for each contraction ratio, worked out without the interpreter.
    fn map<'py>(
        &self,
        py: Python<'py>,
        contraction: &PyReadonlyArray1<'py, f64>,
        f: impl Fn(&CoreMuscle, f64) -> Result<f64> + Send + Sync,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let e = values(contraction)?;
        let inner = &self.inner;
        let result: Result<Vec<f64>> = py.detach(|| e.iter().map(|e| f(inner, *e)).collect());
        result.map(|v| array(py, v)).map_err(|e| error(py, &e))
    }

    /// One number for each row of pressure, contraction ratio and direction; a missing value is
    /// NaN, which no force takes.
    fn rows<'py>(
        py: Python<'py>,
        pressure: &PyReadonlyArray1<'py, f64>,
        contraction: &PyReadonlyArray1<'py, f64>,
        direction: Option<&PyReadonlyArray1<'py, f64>>,
        f: impl Fn(f64, f64, Option<f64>) -> Result<f64> + Send + Sync,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (p, e, d) =
            (values(pressure)?, values(contraction)?, direction.map(values).transpose()?);
        let at = |list: &[f64], k: usize| list.get(k).copied().unwrap_or(f64::NAN);
        let result: Result<Vec<f64>> = py.detach(|| {
            (0..e.len()).map(|k| f(at(&p, k), e[k], d.as_ref().map(|d| at(d, k)))).collect()
        });
        result.map(|v| array(py, v)).map_err(|e| error(py, &e))
    }

    fn compiled(&self, py: Python<'_>) -> PyResult<&CompiledMuscle> {
        if let Some(compiled) = self.compiled.get() {
            return Ok(compiled);
        }
        let made =
            py.detach(|| CompiledMuscle::new(self.inner.clone())).map_err(|e| error(py, &e))?;
        Ok(self.compiled.get_or_init(|| made))
    }
}

#[pymethods]
impl Muscle {
    #[new]
    fn new(py: Python<'_>, json: &str) -> PyResult<Self> {
        let made = muscle_from_json(json).and_then(|spec| CoreMuscle::new(&spec));
        Ok(Self { inner: made.map_err(|e| error(py, &e))?, compiled: OnceLock::new() })
    }

    /// Outer radius [m] at contraction ratios.
    fn radius<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, e| Ok(m.shape(e)?.radius))
    }

    /// Wall thickness [m] at contraction ratios.
    fn thickness<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, e| Ok(m.shape(e)?.thickness))
    }

    /// Air volume [m3] of one muscle at contraction ratios.
    fn air_volume<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, e| Ok(m.shape(e)?.air_volume))
    }

    /// Hoop strain of the wall's mid-line [1] at contraction ratios.
    fn circumferential_strain<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, e| Ok(m.shape(e)?.eps_c))
    }

    /// 1 where the braid is taut, else 0, at contraction ratios.
    fn braid_taut<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, e| Ok(f64::from(u8::from(m.shape(e)?.braid_taut))))
    }

    /// Force per gauge pressure of the gas [m2] at contraction ratios, while contracting.
    fn gas_area<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &contraction, |m, e| Ok(m.coefficients(e)?.a_gas))
    }

    /// Force per unit of each elastic parameter [m2], one row for each contraction ratio.
    fn elastic_basis<'py>(
        &self,
        py: Python<'py>,
        contraction: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let e = values(&contraction)?;
        let (inner, shape) = (&self.inner, [e.len(), self.inner.order()]);
        let rows: Result<Vec<Vec<f64>>> =
            py.detach(|| e.iter().map(|e| inner.elastic_basis(*e)).collect());
        let rows = rows.map_err(|e| error(py, &e))?;
        PyArray1::from_vec(py, rows.concat()).reshape(shape)
    }

    /// Force [N] of one muscle, exact solve, at gauge pressures [Pa] and contraction ratios of
    /// equal length; with directions of motion (-1 to 1) also friction and the lengthening branch.
    #[pyo3(signature = (pressure, contraction, direction=None))]
    fn force<'py>(
        &self,
        py: Python<'py>,
        pressure: PyReadonlyArray1<'py, f64>,
        contraction: PyReadonlyArray1<'py, f64>,
        direction: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let muscle = &self.inner;
        Self::rows(py, &pressure, &contraction, direction.as_ref(), |p, e, d| match d {
            Some(d) => muscle.force_moving(p, e, d),
            None => muscle.force(p, e),
        })
    }

    /// Forces [N] that one muscle has in a rig, of those that it has where it is held straight.
    fn buckled<'py>(
        &self,
        py: Python<'py>,
        force: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(array(py, values(&force)?.iter().map(|f| self.inner.buckled(*f)).collect()))
    }

    /// Force [N] of one muscle from the compiled table; otherwise as `force`.
    #[pyo3(signature = (pressure, contraction, direction=None))]
    fn force_table<'py>(
        &self,
        py: Python<'py>,
        pressure: PyReadonlyArray1<'py, f64>,
        contraction: PyReadonlyArray1<'py, f64>,
        direction: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let muscle = self.compiled(py)?;
        Self::rows(py, &pressure, &contraction, direction.as_ref(), |p, e, d| muscle.force(p, e, d))
    }

    /// Contraction ratios of the geometry: from the fibre's length down to 0.58 of it.
    #[getter]
    fn contraction_limits(&self) -> (f64, f64) {
        self.inner.geometry.range()
    }

    /// Fibre length [m], turns of a fibre [1], rubber volume [m3].
    #[getter]
    fn braid(&self) -> (f64, f64, f64) {
        let braid = self.inner.geometry.braid();
        (braid.fibre_length, braid.turns, braid.bladder_volume)
    }

    /// Contraction ratios that the table covers.
    #[getter]
    fn contraction_range(&self, py: Python<'_>) -> PyResult<(f64, f64)> {
        let table = &self.compiled(py)?.table;
        Ok((table.e_min, table.e_max))
    }

    /// Largest relative error of the table against the exact solve.
    #[getter]
    fn table_error(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.compiled(py)?.table.error_bound())
    }
}
