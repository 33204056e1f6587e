//! `_core.Rig`: simulation and cut-chain prediction.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::convert::{array, error, values};
use crate::simulator::{channels, events, initial, watched, EventRow};
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray1};
use pam_core::cut_chain::{closure_terms, predict, Block};
use pam_core::cut_chain::{Measured, Signal};
use pam_core::effects::EFFECTS;
use pam_core::keys::BLOCKS;
use pam_core::plant::{LinearModel, Side};
use pam_core::simulate::drive::Drive;
use pam_core::simulate::run::Run;
use pam_core::simulate::{Progress, Timing, Trajectory};
use pam_core::RigSpec;
use pyo3::exceptions::PyRuntimeError;
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

/// Signals by name as Python gives them.
pub type Signals<'py> = BTreeMap<String, PyReadonlyArray1<'py, f64>>;
type Pair<'py> = (PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);
/// Of states, inputs and outputs.
type Names = (Vec<String>, Vec<String>, Vec<String>);
/// A, B and C.
type Matrices<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);
type Owned = Vec<(String, Vec<f64>)>;

/// Signals by name as the core takes them.
pub fn owned(signals: &Signals<'_>) -> PyResult<Owned> {
    signals.iter().map(|(name, signal)| Ok((name.clone(), values(signal)?))).collect()
}

/// Borrowed view of [`owned`].
pub fn borrowed(signals: &Owned) -> Vec<(&str, &[f64])> {
    signals.iter().map(|(name, signal)| (name.as_str(), signal.as_slice())).collect()
}

impl Rig {
    /// A block with what was measured around it, for some work without the interpreter.
    #[allow(clippy::too_many_arguments)]
    fn cut<T: Send>(
        &self,
        py: Python<'_>,
        block: &str,
        commands: &Signals<'_>,
        sample_time: f64,
        step: f64,
        measured: &BTreeMap<String, Pair<'_>>,
        samples: usize,
        outlets: &BTreeMap<String, f64>,
        anchors: &[usize],
        work: impl FnOnce(Block, &Measured<'_>, Timing) -> pam_core::Result<T> + Send,
    ) -> PyResult<T> {
        let commands = owned(commands)?;
        let signals = measured
            .iter()
            .map(|(name, (value, slope))| Ok((name, values(value)?, values(slope)?)))
            .collect::<PyResult<Vec<_>>>()?;
        let inner = &*self.inner;
        let found = py.detach(|| {
            let signals: Vec<_> = (signals.iter())
                .map(|(name, value, slope)| (name.as_str(), Signal { value, slope }))
                .collect();
            let outlets: Vec<_> = outlets.iter().map(|(name, p)| (name.as_str(), *p)).collect();
            let measured = Measured::new(inner, samples, &borrowed(&commands), &signals)?
                .beginning(inner, &outlets)?
                .anchored(anchors)?;
            let block = Block::from_name(inner, block)?;
            let longest = block.longest_step(inner, &measured)?;
            let timing = Timing::new(sample_time, step)?.at_most(longest)?;
            work(block, &measured, timing)
        });
        found.map_err(|e| error(py, &e))
    }
}

#[pymethods]
impl Rig {
    #[new]
    fn new(py: Python<'_>, json: &str) -> PyResult<Self> {
        let made = py.detach(|| RigSpec::from_json(json).and_then(pam_core::Rig::new));
        Ok(Self { inner: Arc::new(made.map_err(|e| error(py, &e))?) })
    }

    /// The same rig from another description; compiled muscles are kept where they can be.
    fn respecified(&self, py: Python<'_>, json: &str) -> PyResult<Self> {
        let made =
            py.detach(|| RigSpec::from_json(json).and_then(|spec| self.inner.respecified(spec)));
        Ok(Self { inner: Arc::new(made.map_err(|e| error(py, &e))?) })
    }

    /// The same rig with other values of its parameters, in the order of their names; nothing is
    /// wired again.
    fn with_values(&self, py: Python<'_>, values: PyReadonlyArray1<'_, f64>) -> PyResult<Self> {
        let values = crate::convert::values(&values)?;
        let made = py.detach(|| self.inner.with_values(&values));
        Ok(Self { inner: Arc::new(made.map_err(|e| error(py, &e))?) })
    }

    /// The same rig with other values of some parameters by name; None where one of them is not a
    /// parameter that can vary, so that the rig has to be made again.
    fn revalued(&self, py: Python<'_>, values: BTreeMap<String, f64>) -> PyResult<Option<Self>> {
        let table = self.inner.parameters();
        let mut all = table.values().to_vec();
        for (name, value) in &values {
            match table.find(name) {
                Ok(id) => all[id.index()] = *value,
                Err(_) => return Ok(None),
            }
        }
        let made = py.detach(|| self.inner.with_values(&all));
        Ok(Some(Self { inner: Arc::new(made.map_err(|e| error(py, &e))?) }))
    }

    /// Values of the parameters, in the order of their names.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray1<f64>> {
        array(py, self.inner.parameters().values().to_vec())
    }

    /// Name and role of every number of a fresh simulation's state, in its order.
    fn state_map(&self) -> Vec<(String, &'static str)> {
        self.inner.state_map().into_iter().map(|place| (place.name, place.role.name())).collect()
    }

    /// Names of the commands that a simulation takes.
    #[getter]
    fn inputs(&self) -> Vec<String> {
        self.inner.names().inputs.clone()
    }

    /// Names of the simulated channels.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.inner.names().channels.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Names of the states that an initial value can be given for.
    #[getter]
    fn states(&self) -> Vec<String> {
        self.inner.names().initial.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Dotted names of the scalar parameters that predictions can be differentiated with respect
    /// to.
    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.inner.parameters().names().to_vec()
    }

    /// Longest stable step [s].
    #[getter]
    fn stable_step(&self) -> f64 {
        self.inner.stable_step()
    }

    /// Simulate a number of rows under held signals; channels by name, and what happened on the
    /// way. `record` names the channels that are kept, all where it is none; `stepwise` is without
    /// the equations of the lanes.
    #[pyo3(signature = (rows, signals, sample_time, step, start, record=None, stepwise=false))]
    #[allow(clippy::too_many_arguments)]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        rows: usize,
        signals: Signals<'py>,
        sample_time: f64,
        step: f64,
        start: BTreeMap<String, f64>,
        record: Option<Vec<String>>,
        stepwise: bool,
    ) -> PyResult<(Bound<'py, PyDict>, Vec<EventRow>)> {
        let rig = &*self.inner;
        let signals = owned(&signals)?;
        let begun = Timing::new(sample_time, step).and_then(|timing| {
            let timing = timing.stable(rig)?;
            let numbers =
                |names: &Vec<String>| names.iter().map(|n| rig.names().channel(n)).collect();
            let wanted: Option<Vec<usize>> = record.as_ref().map(numbers).transpose()?;
            let drive = Drive::new(rig, rows, &borrowed(&signals))?;
            let mut run = match &wanted {
                _ if stepwise => Run::new(rig)?,
                Some(wanted) => Run::alone_for(rig, wanted)?,
                None => Run::alone(rig)?,
            };
            let mut out = wanted.map_or_else(
                || Trajectory::new(rig, rows),
                |wanted| Trajectory::of_some(&run, rows, &wanted),
            );
            let progress = run.start(&initial(rig, &start)?);
            progress.observe_in(&mut run, timing, &mut out)?;
            Ok((timing, progress, drive, run, out))
        });
        let (timing, mut progress, drive, mut run, mut out) = begun.map_err(|e| error(py, &e))?;
        let held = 0..rows.saturating_sub(1);
        watched(py, |look| progress.advance_in(&mut run, timing, &drive, held, &mut out, look))?;
        let happened = events(&out);
        let kept = match &record {
            Some(names) => channels(py, names.iter().map(String::as_str), out)?,
            None => channels(py, rig.names().channels.iter().map(|(n, _)| n.as_str()), out)?,
        };
        Ok((kept, happened))
    }

    /// Linear model about a start with every valve at its null: names of states, inputs and
    /// outputs, then the matrices of `x' = A x + B u, y = C x`. `side` is that on which valves
    /// open.
    fn linearise<'py>(
        &self,
        py: Python<'py>,
        start: BTreeMap<String, f64>,
        side: &str,
    ) -> PyResult<(Names, Matrices<'py>)> {
        let rig = &*self.inner;
        let made = py.detach(|| {
            let side = Side::from_name(side)?;
            Progress::start(rig, &initial(rig, &start)?)?.linearised(rig, side)
        });
        let LinearModel { states, inputs, outputs, a, b, c } = made.map_err(|e| error(py, &e))?;
        let (n, m, p) = (states.len(), inputs.len(), outputs.len());
        let matrix = |values, shape: [usize; 2]| array(py, values).reshape(shape);
        Ok((
            (states, inputs, outputs),
            (matrix(a, [n, n])?, matrix(b, [n, m])?, matrix(c, [p, n])?),
        ))
    }

    /// Predict a block's output from its measured neighbours, with the jacobian (None without
    /// parameters). Regulators that nobody measured begin at `outlets` [Pa, gauge] where given; a
    /// block of a temperature takes its pressures anew at the samples `anchors` as well. With a
    /// `spacing` [samples] the block has an input that nobody measured, of these `heights` at its
    /// knots, and the jacobian the derivatives with respect to them.
    #[allow(clippy::too_many_arguments, clippy::type_complexity)]
    #[pyo3(signature = (block, commands, sample_time, step, starts, parameters, measured, samples, outlets=None, anchors=Vec::new(), spacing=None, heights=Vec::new()))]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        block: &str,
        commands: Signals<'py>,
        sample_time: f64,
        step: f64,
        starts: Vec<usize>,
        parameters: Vec<String>,
        measured: BTreeMap<String, Pair<'py>>,
        samples: usize,
        outlets: Option<BTreeMap<String, f64>>,
        anchors: Vec<usize>,
        spacing: Option<usize>,
        heights: Vec<f64>,
    ) -> PyResult<(Bound<'py, numpy::PyArray1<f64>>, Option<Bound<'py, PyArray2<f64>>>)> {
        let p = self.cut(
            py,
            block,
            &commands,
            sample_time,
            step,
            &measured,
            samples,
            &outlets.unwrap_or_default(),
            &anchors,
            |block, measured, timing| {
                let ids = (parameters.iter())
                    .map(|name| self.inner.parameters().find(name))
                    .collect::<pam_core::Result<Vec<_>>>()?;
                let forced;
                let measured = match spacing {
                    None => measured,
                    Some(spacing) => {
                        forced = measured.clone().with_input(spacing, &heights)?;
                        &forced
                    }
                };
                predict(&self.inner, block, measured, timing, &starts, &ids)
            },
        )?;
        let rows = p.value.len();
        let jacobian = if p.columns > 0 {
            Some(array(py, p.jacobian).reshape([rows, p.columns])?)
        } else {
            None
        };
        Ok((array(py, p.value), jacobian))
    }

    /// Terms of the closure in a block at each sample of a prediction, one column for each of its
    /// coefficients.
    #[allow(clippy::too_many_arguments)]
    fn closure_terms<'py>(
        &self,
        py: Python<'py>,
        block: &str,
        commands: Signals<'py>,
        sample_time: f64,
        step: f64,
        starts: Vec<usize>,
        measured: BTreeMap<String, Pair<'py>>,
        samples: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (terms, columns) = self.cut(
            py,
            block,
            &commands,
            sample_time,
            step,
            &measured,
            samples,
            &BTreeMap::new(),
            &[],
            |block, measured, timing| closure_terms(&self.inner, block, measured, timing, &starts),
        )?;
        array(py, terms).reshape([samples, columns])
    }
}

/// Every kind of block of a rig with its keys, as JSON text.
#[pyfunction]
pub fn blocks() -> PyResult<String> {
    serde_json::to_string(BLOCKS).map_err(|e| PyRuntimeError::new_err(e.to_string()))
}

/// What every effect of the core is, as JSON text: a list in the order of the chain.
#[pyfunction]
pub fn effects() -> PyResult<String> {
    serde_json::to_string(EFFECTS).map_err(|e| PyRuntimeError::new_err(e.to_string()))
}
