//! What the sensor of an angle reads, and the angle behind a reading.

use super::rates::Plant;
use crate::scalar::{constant, Scalar};

/// Newton steps from a reading to its angle, at most.
const MOST_STEPS: usize = 12;
/// A step that is none [rad].
const NO_STEP: f64 = 1e-14;

impl<S: Scalar> Plant<'_, S> {
    /// Whether the sensor of a coordinate reads anything but its angle.
    pub fn misreads(&self, coordinate: usize) -> bool {
        self.wiring.ports.encoder[coordinate].is_some()
    }

    /// What the sensor of a coordinate reads at a true angle [rad], its zero left out.
    #[inline]
    pub fn read_angle(&self, coordinate: usize, angle: S) -> S {
        match &self.wiring.ports.encoder[coordinate] {
            None => angle,
            Some(acting) => angle + self.effect(acting).misread(angle).0,
        }
    }

    /// Slope of that reading by the angle.
    #[inline]
    pub fn encoder_gain(&self, coordinate: usize, angle: S) -> S {
        match &self.wiring.ports.encoder[coordinate] {
            None => constant(1.0),
            Some(acting) => self.effect(acting).misread(angle).1 + 1.0,
        }
    }

    /// True angle behind a reading without its zero [rad].
    pub fn true_angle(&self, coordinate: usize, reading: S) -> S {
        let Some(acting) = &self.wiring.ports.encoder[coordinate] else { return reading };
        let effect = self.effect(acting);
        let mut angle = reading;
        let mut last = false;
        for _ in 0..MOST_STEPS {
            let (error, slope) = effect.misread(angle);
            let step = (angle + error - reading) / (slope + 1.0);
            angle -= step;
            if last {
                break;
            }
            // one more step, which gives the derivatives
            last = step.re().abs() < NO_STEP;
        }
        angle
    }
}
