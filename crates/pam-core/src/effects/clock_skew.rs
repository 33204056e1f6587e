//! `clock_skew`: pressures, and angles too or not, are recorded by another clock than the commands.
//!
//! A pressure that is recorded at `t` was there at `t - d(t)` of the commands' clock,
//! `d = d_0 + r t`, an angle at `t - a d(t)`: the share `a` is 1 where one logger records both and
//! 0 where the angle is on the commands' clock. Commands act on the recording later by `d`. Within
//! a step the held commands are averaged over the shifted time, so that an edge moves through it
//! continuously and the shift can be differentiated. The rate of some 1e-4 changes no other time. A
//! clock that is ahead (`d < 0`) is known to a prediction from recordings; a simulation, which
//! cannot answer a command that is still to come, takes it as no shift. D. L. Mills, "Internet time
//! synchronization: the network time protocol", IEEE Trans. Communications 39, 1991 (offset and
//! skew).

use super::{Effect, EffectInfo, EffectParameter, Form, Kink, Port, SameData, Use};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "clock_skew",
    block: "sensors",
    at: "",
    kink: Some(Kink {
        where_not_zero: &["offset", "rate"],
        why: "its delay is no state of the rig; take it out, and give it as the delay of the loop",
        of_supplies: false,
    }),
    same_data: Some(SameData {
        effect: "input_path_lag",
        parameter: "delay",
        size: "offset",
        without: "rate",
        held: &[("angle_share", 1.0)],
    }),
    acts_in: &["supply", "chamber", "arm"],
    source: "Mills (1991), offset and skew of clocks",
    forms: &[Form {
        name: "offset_and_drift",
        parameters: &[
            EffectParameter::new("offset", "s", -10.0, 10.0, 0.01).starts(&[0.005, 0.03]).off(0.0),
            EffectParameter::new("rate", "1", -0.01, 0.01, 0.0001).starts(&[0.0, 0.0003]).off(0.0),
            EffectParameter::new("angle_share", "1", 0.0, 1.0, 1.0)
                .starts(&[0.0, 1.0])
                .role(Use::Choice),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Clock],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// How late a pressure is recorded at a time [s].
#[inline]
pub fn shift<S: Scalar>(offset: S, rate: S, time: f64) -> S {
    offset + rate * time
}

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

/// Another clock of what is recorded.
#[derive(Debug, Clone, Copy)]
struct ClockSkew<S> {
    offset: S,
    rate: S,
    angle_share: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(ClockSkew { offset: values[0], rate: values[1], angle_share: values[2] })
}

impl<S: Scalar> Effect<S> for ClockSkew<S> {
    fn clock(&self, time: f64) -> (S, S) {
        let shift = shift(self.offset, self.rate, time);
        (shift, shift * self.angle_share)
    }
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
    fn a_shift_grows() {
        assert!((shift(1e-2, 1e-4, 100.0) - 2e-2_f64).abs() < 1e-15);
        assert_eq!((shift(0.0, 0.0, 50.0), shift(0.0, -1e-3, 50.0)), (0.0, -0.05));
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
