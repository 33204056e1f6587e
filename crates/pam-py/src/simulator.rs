//! `_core.Simulator`: a simulation that goes on sample by sample, and the one way both it and `Rig.simulate` run.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::convert::{array, error, values};
use crate::rig::Rig;
use numpy::{PyArray1, PyReadonlyArray1};
use pam_core::simulate::{Initial, Prescribed, Progress, Timing, Trajectory};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// RK4 steps between two looks at Ctrl-C: some 50 ms.
const STEPS_AT_ONCE: usize = 80_000;

/// Advance a progress without the interpreter, looking at Ctrl-C now and then.
pub fn run(
    py: Python<'_>,
    rig: &pam_core::Rig,
    timing: Timing,
    progress: &mut Progress,
    command: &[f64],
    prescribed: Prescribed<'_>,
    out: &mut Trajectory,
) -> PyResult<()> {
    let at_once = (STEPS_AT_ONCE / timing.substeps).max(1);
    for first in (0..command.len()).step_by(at_once) {
        let last = (first + at_once).min(command.len());
        let part = |signal: Option<&'_ [f64]>| signal.map(|s| s.get(first..last).unwrap_or(&[]).to_vec());
        let (length, pressure) = (part(prescribed.length), part(prescribed.pressure));
        let here = Prescribed { length: length.as_deref(), pressure: pressure.as_deref() };
        let held = &command[first..last];
        py.detach(|| progress.advance(rig, timing, held, here, out)).map_err(|e| error(py, &e))?;
        py.check_signals()?;
    }
    Ok(())
}

/// Channels of a trajectory by name, those that the rig has.
pub fn channels<'py>(py: Python<'py>, rig: &pam_core::Rig, t: Trajectory) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    if rig.spec().supply.is_some() {
        out.set_item("supply_pressure", array(py, t.supply_pressure))?;
    }
    out.set_item("muscle_pressure", array(py, t.muscle_pressure))?;
    if rig.spec().arm.is_some() {
        out.set_item("joint_angle", array(py, t.joint_angle))?;
        out.set_item("joint_rate", array(py, t.joint_rate))?;
        out.set_item("contraction_ratio", array(py, t.contraction_ratio))?;
        out.set_item("muscle_force", array(py, t.muscle_force))?;
        out.set_item("joint_torque", array(py, t.joint_torque))?;
    } else if let (Some(_), Some(muscle)) = (&rig.spec().load, &rig.spec().muscle) {
        let length = t.contraction_ratio.iter().map(|e| muscle.rest_length * (1.0 - e)).collect();
        out.set_item("length", array(py, length))?;
        out.set_item("length_rate", array(py, t.joint_rate.iter().map(|rate| -rate).collect()))?;
        out.set_item("contraction_ratio", array(py, t.contraction_ratio))?;
        out.set_item("muscle_force", array(py, t.muscle_force))?;
    }
    out.set_item("air_volume", array(py, t.air_volume))?;
    out.set_item("temperature", array(py, t.gas_temperature))?;
    Ok(out)
}

/// Initial values; what is left out is at rest.
pub fn initial(
    rig: &pam_core::Rig,
    muscle_pressure: Option<f64>,
    supply_pressure: Option<f64>,
    joint_angle: Option<f64>,
    joint_rate: Option<f64>,
    length: Option<f64>,
) -> Initial {
    let rest = Initial::rest(rig);
    let shortening = length.zip(rig.spec().muscle.as_ref()).map(|(l, muscle)| muscle.rest_length - l);
    Initial {
        supply_pressure: supply_pressure.unwrap_or(rest.supply_pressure),
        muscle_pressure: muscle_pressure.unwrap_or(rest.muscle_pressure),
        joint_angle: shortening.or(joint_angle).unwrap_or(rest.joint_angle),
        joint_rate: joint_rate.unwrap_or(rest.joint_rate),
    }
}

/// A simulation of a rig that waits for its next command.
#[pyclass(frozen, module = "pamrs._core")]
pub struct Simulator {
    rig: Arc<pam_core::Rig>,
    timing: Timing,
    progress: Mutex<Progress>,
}

impl Simulator {
    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Simulator {
    #[new]
    #[pyo3(signature = (rig, sample_time, step, *, muscle_pressure=None, supply_pressure=None, joint_angle=None, joint_rate=None, length=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        rig: &Rig,
        sample_time: f64,
        step: f64,
        muscle_pressure: Option<f64>,
        supply_pressure: Option<f64>,
        joint_angle: Option<f64>,
        joint_rate: Option<f64>,
        length: Option<f64>,
    ) -> PyResult<Self> {
        let rig = rig.shared();
        let start = initial(&rig, muscle_pressure, supply_pressure, joint_angle, joint_rate, length);
        let made = Timing::new(sample_time, step).and_then(|t| Ok((t, Progress::start(&rig, start)?)));
        let (timing, progress) = made.map_err(|e| error(py, &e))?;
        Ok(Self { rig, timing, progress: Mutex::new(progress) })
    }

    /// Hold each command [V] for one sample; the samples after them as channels by name.
    #[pyo3(signature = (valve_command, length=None, pressure=None))]
    fn advance<'py>(
        &self,
        py: Python<'py>,
        valve_command: PyReadonlyArray1<'py, f64>,
        length: Option<PyReadonlyArray1<'py, f64>>,
        pressure: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let command = values(&valve_command);
        let (length, pressure) = (length.as_ref().map(values), pressure.as_ref().map(values));
        let prescribed = Prescribed { length: length.as_deref(), pressure: pressure.as_deref() };
        let mut out = Trajectory::with_capacity(command.len());
        let mut progress = *self.progress();
        let done = run(py, &self.rig, self.timing, &mut progress, &command, prescribed, &mut out);
        *self.progress() = progress;
        done?;
        channels(py, &self.rig, out)
    }

    /// The present sample as channels by name, one value each.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut out = Trajectory::with_capacity(1);
        let progress = *self.progress();
        progress.observe(&self.rig, self.timing, &mut out).map_err(|e| error(py, &e))?;
        channels(py, &self.rig, out)
    }

    /// Numbers of the state that restore it bit for bit.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.progress().to_vec())
    }

    /// Go back, or on, to a state.
    fn restore(&self, py: Python<'_>, state: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        *self.progress() = Progress::from_slice(&values(&state)).map_err(|e| error(py, &e))?;
        Ok(())
    }

    /// Samples since the start.
    #[getter]
    fn samples(&self) -> u64 {
        self.progress().samples()
    }
}
