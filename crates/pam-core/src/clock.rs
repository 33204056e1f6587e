//! Signals that are seen later than they were there: readings, and commands that are held.

use crate::scalar::{constant, Scalar};

/// A reading so late [samples], from the readings of the samples before (newest last) and the
/// present one.
pub fn late(past: impl Fn(usize) -> Option<f64>, present: f64, shift: f64) -> f64 {
    if shift <= 0.0 {
        return present;
    }
    let back = shift.floor() as usize;
    // Readings by how many samples ago; before the first one it stood still.
    let ago = |n: usize| match n.checked_sub(1) {
        None => Some(present),
        Some(k) => past(k),
    };
    let oldest = |n: usize| (0..=n).rev().find_map(ago).unwrap_or(present);
    let (near, far) = (oldest(back), oldest(back + 1));
    near + (far - near) * (shift - back as f64)
}

/// How near to an edge a time lies on it [samples]: rounding.
const ON_EDGE: f64 = 1e-9;

/// Samples whose values a step sees that are held over each sample: one, and then another.
#[derive(Debug, Clone, Copy)]
pub struct Held<S> {
    /// The sample at the beginning of the step.
    pub before: i64,
    /// The sample at its end.
    pub now: i64,
    /// Share of the step until it changes [1].
    pub share_before: S,
}

impl<S: Scalar> Held<S> {
    /// Over a step [s], no longer than a sample, that begins at a time [s], seen later by a shift
    /// [s].
    pub fn over(time: f64, step: f64, sample_time: f64, shift: S) -> Self {
        // In samples; what lies nearer to an edge than rounding lies on it.
        let from = -shift / sample_time + time / sample_time;
        let to = from.re() + step / sample_time;
        let cell = |x: f64| (x + ON_EDGE).floor();
        let first = cell(from.re());
        let last = cell(to - 2.0 * ON_EDGE).max(first);
        let edge = -from + last;
        let of_step = |edge: S| edge / (step / sample_time);
        let (first, last) = (first as i64, last as i64);
        if first < last {
            Self { before: first, now: last, share_before: of_step(edge) }
        } else if edge.re().abs() > ON_EDGE {
            Self { before: first, now: first, share_before: constant(0.0) }
        } else {
            // an edge on the step's beginning moves into it when the shift grows: its slope, without
            // what rounding leaves
            Self { before: first - 1, now: first, share_before: of_step(edge - edge.re()) }
        }
    }

    /// What is commanded over the step, by the value of a sample.
    pub fn edge(&self, value: impl Fn(i64) -> S) -> Edge<S> {
        let now = value(self.now);
        let before = if self.before == self.now { now } else { value(self.before) };
        Edge { now, before, share_before: self.share_before }
    }
}

/// A command over a step: one value, and then another.
///
/// Valves and regulators follow each, and not their mean: the flow of a mean opening is not the mean
/// of what openings pass one after the other, and a limit of a rate acts on each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge<S> {
    /// At the end of the step.
    pub now: S,
    /// At its beginning.
    pub before: S,
    /// Share of the step until it changes [1].
    pub share_before: S,
}

impl<S: Scalar> Edge<S> {
    /// The same value all the time.
    #[inline]
    pub fn steady(value: S) -> Self {
        Self { now: value, before: value, share_before: constant(0.0) }
    }

    /// Whether it is not the same at both ends of the step.
    #[inline]
    pub fn changes(&self) -> bool {
        self.before.re() != self.now.re()
    }

    /// Mean value over the step.
    pub fn mean(&self) -> S {
        self.now + self.share_before * (self.before - self.now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Slope;

    #[test]
    fn an_edge_moves_through_a_step() {
        let value = |k: i64| if k < 3 { 1.0 } else { 5.0 };
        let mean = |time: f64, shift: f64| Held::over(time, 1e-3, 5e-3, shift).edge(value).mean();
        assert_eq!((mean(0.014, 0.0), mean(0.015, 0.0), mean(0.015, 2e-3)), (1.0, 5.0, 1.0));
        assert!((mean(0.017, 2.25e-3) - (0.25 * 1.0 + 0.75 * 5.0)).abs() < 1e-9);
        let slope = Held::over(0.017, 1e-3, 5e-3, Slope::new(2.25e-3, 1.0))
            .edge(|k| Slope::from(value(k)))
            .mean()
            .slope();
        assert!((slope + 4.0 / 1e-3).abs() < 1e-6, "{slope}");
    }

    #[test]
    fn an_edge_on_the_beginning_of_a_step_has_a_slope() {
        let value = |k: i64| Slope::from(if k < 3 { 1.0 } else { 5.0 });
        let shift = |by: f64| Slope::new(by, 1.0);
        let ends = |held: Held<Slope>| (held.before, held.now, held.share_before);
        let mean = Held::over(0.015, 1e-3, 5e-3, shift(0.0)).edge(value).mean();
        assert!((mean.re - 5.0).abs() < 1e-9 && (mean.slope() + 4.0 / 1e-3).abs() < 1e-6);
        let (first, last, share) = ends(Held::over(0.02, 1e-3, 5e-3, shift(5e-3)));
        assert_eq!((first, last), (2, 3));
        assert!(share.re.abs() < 1e-9 && (share.slope() - 1.0 / 1e-3).abs() < 1e-6);
        let (first, last, share) = ends(Held::over(0.022, 1e-3, 5e-3, shift(5e-3)));
        assert_eq!((first, last, share.slope()), (3, 3, 0.0));
        let (first, last, share) = ends(Held::over(0.017, 1e-3, 5e-3, shift(2.25e-3)));
        assert_eq!((first, last), (2, 3));
        assert!((share.re - 0.25).abs() < 1e-9);
    }

    #[test]
    fn a_reading_comes_late() {
        let before = [7.0, 5.0, 2.0];
        let at = |shift: f64| late(|k| before.iter().rev().nth(k).copied(), 1.0, shift);
        assert_eq!(
            [at(-1.0), at(0.0), at(0.25), at(1.0), at(2.5), at(3.0), at(9.0)],
            [1.0, 1.0, 1.25, 2.0, 6.0, 7.0, 7.0]
        );
    }
}
