//! `_core.Rig`: simulation and cut-chain prediction.

use std::sync::Arc;

use crate::convert::{array, error, values};
use crate::simulator::{channels, initial, run};
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray1};
use pam_core::residual::{predict, Block, Measured, Signal};
use pam_core::rig::{ParameterId, RigSpec};
use pam_core::simulate::{Prescribed, Progress, Timing, Trajectory};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A rig compiled from a JSON description (SI, radians, gauge pressures).
#[pyclass(frozen, module = "pamrs._core")]
pub struct Rig {
    inner: Arc<pam_core::Rig>,
}

impl Rig {
    /// The compiled rig, shared.
    pub fn shared(&self) -> Arc<pam_core::Rig> {
        Arc::clone(&self.inner)
    }
}

type Pair<'py> = (PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);

#[pymethods]
impl Rig {
    #[new]
    fn new(py: Python<'_>, json: &str) -> PyResult<Self> {
        let made = py.detach(|| RigSpec::from_json(json).and_then(pam_core::Rig::new));
        Ok(Self { inner: Arc::new(made.map_err(|e| error(py, &e))?) })
    }

    /// The same rig from another description; the compiled muscle is kept where it can be.
    fn respecified(&self, py: Python<'_>, json: &str) -> PyResult<Self> {
        let made = py.detach(|| RigSpec::from_json(json).and_then(|spec| self.inner.respecified(spec)));
        Ok(Self { inner: Arc::new(made.map_err(|e| error(py, &e))?) })
    }

    /// Simulate a held command; returns channels by name.
    #[pyo3(signature = (valve_command, sample_time, step, *, muscle_pressure=None, supply_pressure=None, joint_angle=None, joint_rate=None, length=None, lengths=None, pressures=None))]
    #[allow(clippy::too_many_arguments)]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        valve_command: PyReadonlyArray1<'py, f64>,
        sample_time: f64,
        step: f64,
        muscle_pressure: Option<f64>,
        supply_pressure: Option<f64>,
        joint_angle: Option<f64>,
        joint_rate: Option<f64>,
        length: Option<f64>,
        lengths: Option<PyReadonlyArray1<'py, f64>>,
        pressures: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let command = values(&valve_command);
        let start = initial(&self.inner, muscle_pressure, supply_pressure, joint_angle, joint_rate, length);
        let (lengths, pressures) = (lengths.as_ref().map(values), pressures.as_ref().map(values));
        let prescribed = Prescribed { length: lengths.as_deref(), pressure: pressures.as_deref() };
        let begun = Timing::new(sample_time, step)
            .and_then(|timing| Ok((timing, Progress::start(&self.inner, start)?)))
            .map_err(|e| error(py, &e))?;
        let (timing, mut progress) = begun;
        let mut out = Trajectory::with_capacity(command.len());
        progress.observe(&self.inner, timing, &mut out).map_err(|e| error(py, &e))?;
        let held = command.split_last().map_or(&[][..], |(_, held)| held);
        run(py, &self.inner, timing, &mut progress, held, prescribed, &mut out)?;
        channels(py, &self.inner, out)
    }

    /// Predict a block's output from its measured neighbours, with the jacobian (None without parameters).
    #[pyo3(signature = (block, valve_command, sample_time, step, starts, parameters, *, supply_pressure=None, muscle_pressure=None, joint_angle=None))]
    #[allow(clippy::too_many_arguments, clippy::type_complexity)]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        block: &str,
        valve_command: PyReadonlyArray1<'py, f64>,
        sample_time: f64,
        step: f64,
        starts: Vec<usize>,
        parameters: Vec<String>,
        supply_pressure: Option<Pair<'py>>,
        muscle_pressure: Option<Pair<'py>>,
        joint_angle: Option<Pair<'py>>,
    ) -> PyResult<(Bound<'py, numpy::PyArray1<f64>>, Option<Bound<'py, PyArray2<f64>>>)> {
        let u = values(&valve_command);
        let own = |pair: Option<Pair<'py>>| pair.map(|(value, slope)| (values(&value), values(&slope)));
        let (supply, pressure, angle) = (own(supply_pressure), own(muscle_pressure), own(joint_angle));
        let inner = &*self.inner;
        let found = py.detach(|| {
            let measured = Measured {
                valve_command: &u,
                supply_pressure: supply.as_ref().map(|(value, slope)| Signal { value, slope }),
                muscle_pressure: pressure.as_ref().map(|(value, slope)| Signal { value, slope }),
                joint_angle: angle.as_ref().map(|(value, slope)| Signal { value, slope }),
            };
            let ids = parameters
                .iter()
                .map(|name| ParameterId::from_name(name))
                .collect::<pam_core::Result<Vec<_>>>()?;
            predict(
                inner,
                Block::from_name(block)?,
                &measured,
                Timing::new(sample_time, step)?,
                &starts,
                &ids,
            )
        });
        let p = found.map_err(|e| error(py, &e))?;
        let rows = p.value.len();
        let jacobian =
            if p.columns > 0 { Some(array(py, p.jacobian).reshape([rows, p.columns])?) } else { None };
        Ok((array(py, p.value), jacobian))
    }
}

/// Dotted names of the scalar parameters that predictions can be differentiated with respect to.
#[pyfunction]
pub fn parameter_names() -> Vec<&'static str> {
    ParameterId::ALL.iter().map(|p| p.name()).collect()
}

type EffectRow = (&'static str, &'static str, Vec<(&'static str, &'static str)>);

/// Effects of the core: (id, block, [(parameter, SI unit), ...]).
#[pyfunction]
pub fn effects() -> Vec<EffectRow> {
    pam_core::effects::EFFECTS.iter().map(|e| (e.id, e.block, e.parameters.to_vec())).collect()
}
