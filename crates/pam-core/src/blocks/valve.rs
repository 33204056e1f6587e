//! Proportional 5/3 servo-valve: spool command to discharge area.
//!
//! `x = clip((u - u0)/half_range, -1, 1)`; `A = A_max a(|x|)` with a piecewise linear area table;
//! `x > 0` fills the chamber from the supply, `x < 0` vents it.

use crate::error::{Error, Result};
use crate::scalar::{constant, Scalar};

/// Normalised area table `a(|x|)` of a valve.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaTable {
    opening: Vec<f64>,
    fraction: Vec<f64>,
}

impl AreaTable {
    /// A table from openings (0 to 1, strictly rising) and area fractions (not falling, from 0).
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::Parameter`] when the table is not of that form.
    pub fn new(opening: &[f64], fraction: &[f64]) -> Result<Self> {
        if opening.len() != fraction.len() || opening.len() < 2 {
            return Err(Error::Length {
                name: "valve.area_fraction.fraction".into(),
                found: fraction.len(),
                expected: opening.len().max(2),
                why: "one area fraction per opening, at least two".into(),
            });
        }
        let finite = opening.iter().chain(fraction).all(|v| v.is_finite());
        let last = opening[opening.len() - 1];
        if !finite || opening[0] != 0.0 || last != 1.0 || opening.windows(2).any(|w| w[1] <= w[0]) {
            return Err(Error::parameter(
                "valve.area_fraction.opening",
                last,
                "openings rising strictly from 0 to 1",
            ));
        }
        if fraction[0] < 0.0 || fraction.windows(2).any(|w| w[1] < w[0]) {
            return Err(Error::parameter(
                "valve.area_fraction.fraction",
                fraction[0],
                "area fractions >= 0 that do not fall",
            ));
        }
        Ok(Self { opening: opening.to_vec(), fraction: fraction.to_vec() })
    }

    /// Area fraction at an opening `|x|` in `[0, 1]` [1].
    #[inline]
    pub fn eval<S: Scalar>(&self, opening: S) -> S {
        let x = opening.re();
        let last = self.opening.len() - 1;
        let mut cell = 0;
        while cell + 1 < last && x > self.opening[cell + 1] {
            cell += 1;
        }
        let slope = (self.fraction[cell + 1] - self.fraction[cell])
            / (self.opening[cell + 1] - self.opening[cell]);
        (opening - self.opening[cell]) * slope + self.fraction[cell]
    }
}

/// Normalised spool position `x` in `[-1, 1]` for a command [V].
#[inline]
pub fn spool_position<S: Scalar>(command: f64, null_voltage: S, half_range: f64) -> S {
    let x = (-null_voltage + command) / half_range;
    if x.re() > 1.0 {
        constant(1.0)
    } else if x.re() < -1.0 {
        constant(-1.0)
    } else {
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_passes_its_points_and_rejects_nonsense() {
        let (x, a) = ([0.0, 0.25, 0.5, 0.75, 1.0], [0.0, 0.2, 0.5, 0.8, 1.0]);
        let table = AreaTable::new(&x, &a).unwrap();
        for (x, a) in x.iter().zip(a) {
            assert!((table.eval::<f64>(*x) - a).abs() < 1e-15);
        }
        assert!((table.eval::<f64>(0.125) - 0.1).abs() < 1e-15);
        assert!(AreaTable::new(&[0.0, 0.5], &[0.0, 1.0]).is_err());
        assert!(AreaTable::new(&[0.0, 1.0], &[0.5, 0.1]).is_err());
        assert!(AreaTable::new(&[0.0, f64::NAN, 1.0], &[0.0, 0.5, 1.0]).is_err());
        assert!(AreaTable::new(&[0.0], &[0.0]).is_err());
    }

    #[test]
    fn spool_saturates() {
        assert_eq!(spool_position(11.0, 5.0, 5.0), 1.0);
        assert_eq!(spool_position(-3.0, 5.0, 5.0), -1.0);
        assert_eq!(spool_position(6.0, 5.0, 5.0), 0.2);
    }
}
