//! Signals that are seen later than they were there: readings, and commands that are held.

use crate::scalar::Scalar;

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

/// Mean over a step [s] that begins at a time of values that are held over each sample, seen later
/// by a shift.
pub fn held_mean<S: Scalar>(
    value: impl Fn(i64) -> S,
    time: f64,
    step: f64,
    sample_time: f64,
    shift: S,
) -> S {
    // In samples; what lies nearer to an edge than rounding lies on it.
    let from = -shift / sample_time + time / sample_time;
    let to = from + step / sample_time;
    let cell = |x: f64| (x + 1e-9).floor();
    let (first, last) = (cell(from.re()), cell(to.re() - 2e-9).max(cell(from.re())));
    if first == last {
        return value(first as i64);
    }
    let mut sum = (-from + (first + 1.0)) * value(first as i64);
    let mut k = first + 1.0;
    while k < last {
        sum += value(k as i64);
        k += 1.0;
    }
    (sum + (to - last) * value(last as i64)) / (step / sample_time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    #[test]
    fn an_edge_moves_through_a_step() {
        let value = |k: i64| if k < 3 { 1.0 } else { 5.0 };
        let mean = |time: f64, shift: f64| held_mean(value, time, 1e-3, 5e-3, shift);
        assert_eq!((mean(0.014, 0.0), mean(0.015, 0.0), mean(0.015, 2e-3)), (1.0, 5.0, 1.0));
        assert!((mean(0.017, 2.25e-3) - (0.25 * 1.0 + 0.75 * 5.0)).abs() < 1e-9);
        let slope =
            held_mean(|k| Dual64::from(value(k)), 0.017, 1e-3, 5e-3, Dual64::new(2.25e-3, 1.0)).eps;
        assert!((slope + 4.0 / 1e-3).abs() < 1e-6, "{slope}");
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
