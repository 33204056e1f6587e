//! How long samples and steps are.

use crate::plant::Rig;
use crate::{Error, Result};

/// Steps of one sample: some ten seconds of a small rig.
const MOST_STEPS: f64 = 1e8;

/// Sample time and step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Sample time [s]: one output row and one held command each.
    pub sample_time: f64,
    /// RK4 steps per sample.
    pub substeps: usize,
}

impl Timing {
    /// Timing from a sample time and a step [s] that divides it.
    ///
    /// # Errors
    /// [`Error::Parameter`] when either is not positive or the step does not divide the sample
    /// time.
    pub fn new(sample_time: f64, step: f64) -> Result<Self> {
        if !(sample_time.is_finite() && sample_time > 0.0) {
            return Err(Error::parameter("sample_time", sample_time, "a finite time > 0 s"));
        }
        let ratio = sample_time / step;
        let rounded = ratio.round();
        let divides = (1.0..=1e7).contains(&rounded) && (ratio - rounded).abs() <= 1e-6 * rounded;
        if !(step.is_finite() && step > 0.0 && divides) {
            let allowed = format!(
                "a time > 0 s that divides sample_time = {sample_time:?} s into 1 to 1e7 steps"
            );
            return Err(Error::parameter("step", step, allowed));
        }
        Ok(Self { sample_time, substeps: rounded as usize })
    }

    /// The same with each step divided until it is at most as long as a rig allows.
    ///
    /// # Errors
    /// As [`Self::at_most`].
    pub fn stable(self, rig: &Rig) -> Result<Self> {
        self.at_most(rig.stable_step())
    }

    /// The same with each step divided until it is at most so long [s].
    ///
    /// # Errors
    /// [`Error::Parameter`] for a sample time that would take more steps than anybody waits for.
    pub fn at_most(self, longest: f64) -> Result<Self> {
        let parts = (self.step() / longest - 1e-9).ceil().max(1.0);
        if parts * self.substeps as f64 <= MOST_STEPS {
            return Ok(Self { substeps: self.substeps * parts as usize, ..self });
        }
        let allowed = format!("at most {MOST_STEPS:e} steps of {longest:.3e} s, as the rig needs");
        Err(Error::parameter("sample_time", self.sample_time, allowed))
    }

    /// Step [s].
    pub fn step(&self) -> f64 {
        self.sample_time / self.substeps as f64
    }
}
