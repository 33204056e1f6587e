//! `_core.Joint`: shortening and moment arm of a joint.

use crate::convert::{array, error, values};
use numpy::{PyArray1, PyReadonlyArray1};
use pam_core::blocks::joint::{Joint as CoreJoint, JointPoint};
use pam_core::description::TransmissionSpec;
use pam_core::error::check_range;
use pyo3::prelude::*;

/// A joint made from a JSON description (SI, radians).
#[pyclass(frozen, module = "pamrs._core")]
pub struct Joint {
    inner: CoreJoint,
}

impl Joint {
    fn map<'py>(
        &self,
        py: Python<'py>,
        angle: &PyReadonlyArray1<'py, f64>,
        f: impl Fn(JointPoint<f64>) -> f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let at = |angle: f64| {
            check_range("joint.angle", angle, -7.0, 7.0, "rad")?;
            if !self.inner.reaches(angle) {
                let allowed = "an angle that the tendon reaches (it is too short)";
                return Err(pam_core::Error::parameter("joint.angle", angle, allowed));
            }
            Ok(f(self.inner.eval(angle)))
        };
        let result: pam_core::Result<Vec<f64>> = values(angle)?.into_iter().map(at).collect();
        result.map(|v| array(py, v)).map_err(|e| error(py, &e))
    }
}

#[pymethods]
impl Joint {
    #[new]
    fn new(py: Python<'_>, json: &str) -> PyResult<Self> {
        let made = TransmissionSpec::from_json(json).and_then(|spec| CoreJoint::new(&spec));
        Ok(Self { inner: made.map_err(|e| error(py, &e))? })
    }

    /// Shortening of the muscle [m] at joint angles [rad].
    fn shortening<'py>(
        &self,
        py: Python<'py>,
        angle: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &angle, |p| p.shortening)
    }

    /// Rate of shortening per rate of angle [m] at joint angles [rad].
    fn moment_arm<'py>(
        &self,
        py: Python<'py>,
        angle: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &angle, |p| p.moment_arm)
    }

    /// Torque per pull [m] at joint angles [rad].
    fn torque_arm<'py>(
        &self,
        py: Python<'py>,
        angle: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.map(py, &angle, |p| p.torque_arm)
    }

    /// 1 where the joint can have an angle [rad], else 0.
    fn reaches<'py>(
        &self,
        py: Python<'py>,
        angle: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let within =
            |angle: f64| f64::from(u8::from(angle.is_finite() && self.inner.reaches(angle)));
        Ok(array(py, values(&angle)?.into_iter().map(within).collect()))
    }
}
