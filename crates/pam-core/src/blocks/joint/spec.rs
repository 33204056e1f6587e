//! A joint as data.

use crate::error::{Error, Result};
use serde::Deserialize;

/// How a muscle pulls on a joint; the lengths are those of its kind, see [`super::Joint`].
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransmissionSpec {
    pub kind: String,
    #[serde(default)]
    pub upper_axial: f64,
    #[serde(default)]
    pub upper_offset: f64,
    #[serde(default)]
    pub lower_axial: f64,
    #[serde(default)]
    pub lower_offset: f64,
    #[serde(default)]
    pub radius: f64,
    #[serde(default)]
    pub coefficients: Vec<f64>,
    pub rest_angle: f64,
}

impl TransmissionSpec {
    /// Read a transmission on its own from JSON text.
    ///
    /// # Errors
    /// [`Error::Model`] for text that is not of this form (unknown keys included).
    pub fn from_json(text: &str) -> Result<Self> {
        serde_json::from_str(text).map_err(|e| Error::Model(format!("joint description: {e}")))
    }
}
