//! RK4 steps per sample of each row.

use super::request::Checked;
use crate::plant::{ParameterId, Path};
use crate::simulate::of_row;
use crate::Result;

/// Parameters whose extremes are tried together, at most.
const MOST_TOGETHER: usize = 6;

/// Steps per sample of each plant: one number where all need the same.
pub(super) enum Steps {
    Same(usize),
    Each(Vec<usize>),
}

impl Steps {
    /// # Errors
    /// As [`crate::Rig::with_values`], with the number of the row.
    pub fn new(checked: &Checked<'_, '_>) -> Result<Self> {
        let request = checked.request;
        for plant in 0..request.plants {
            let values = checked.values(plant);
            checked.rig.parameters().with_values(&values).map_err(|e| of_row(plant, e))?;
        }
        let wanted = request.timing.substeps;
        if corners(checked).is_some_and(|corners| corners.iter().all(|at| *at == wanted)) {
            return Ok(Self::Same(wanted));
        }
        let each = |plant: usize| {
            let rig = checked.rig.with_values(&checked.values(plant));
            let steps = rig.and_then(|rig| request.timing.stable(&rig));
            Ok(steps.map_err(|e| of_row(plant, e))?.substeps)
        };
        Ok(Self::Each((0..request.plants).map(each).collect::<Result<_>>()?))
    }

    pub fn of(&self, plant: usize) -> usize {
        match self {
            Self::Same(steps) => *steps,
            Self::Each(steps) => steps[plant],
        }
    }
}

/// Steps at all corners of the box that the values span: the rates that limit a step rise, fall or
/// are convex in each parameter (openings, stiffness and damping; inverse volumes and inertias), so
/// that no point inside needs more. None for a tube's size, which opens it and gives it volume at
/// once, for too many parameters, or where a corner cannot be.
fn corners(checked: &Checked<'_, '_>) -> Option<Vec<usize>> {
    let request = checked.request;
    let spans: Vec<(usize, f64, f64)> = (checked.places.iter().zip(&request.parameters))
        .map(|(place, (_, values))| {
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            (place.index(), low, high)
        })
        .collect();
    let of_a_tube = |place: &ParameterId| {
        checked.rig.wiring.lines.iter().any(|line| match line.path {
            Path::Tube { length, diameter } => *place == length || *place == diameter,
            Path::Orifice(_) => false,
        })
    };
    if spans.len() > MOST_TOGETHER || checked.places.iter().any(of_a_tube) {
        return None;
    }
    let corner = |bits: usize| {
        let mut values = checked.rig.parameters().values().to_vec();
        for (k, (place, low, high)) in spans.iter().enumerate() {
            values[*place] = if bits >> k & 1 == 0 { *low } else { *high };
        }
        let rig = checked.rig.with_values(&values).ok()?;
        Some(request.timing.stable(&rig).ok()?.substeps)
    };
    (0..1 << spans.len()).map(corner).collect()
}
