//! Spool of a valve as a mass on a spring between two stops.
//!
//! `y'' = w^2 (x - y) - 2 zeta w y'` of the normalised position `y` under a held command `x`, in
//! closed form; at its stops, -1 and 1, it loses its speed and stays until it is pulled back. E.
//! Richer & Y. Hurmuzlu, "A high performance pneumatic force actuator system: part I, nonlinear
//! mathematical model", ASME J. Dyn. Syst. Meas. Control 122, 2000 (spool, coil and springs).

use crate::scalar::{constant, Scalar};
use std::f64::consts::PI;

/// Below it the powers of the square are enough.
const SMALL: f64 = 1e-2;
/// From the first stop on, a held command leads to one other stop at most.
const MOST_STOPS: usize = 3;
/// Halvings of the time in which a stop is reached.
const HALVINGS: usize = 60;
/// Slowest meeting with a stop whose instant has a slope [of the natural frequency].
const GRAZING: f64 = 1e-6;

/// `exp(-s) cosh(sqrt(q))` and `exp(-s) sinh(sqrt(q))/sqrt(q)`, of any sign of `q`.
fn swings<S: Scalar>(q: S, s: S) -> (S, S) {
    if q.re().abs() < SMALL {
        let even = q * (q * (q / 720.0 + 1.0 / 24.0) + 0.5) + 1.0;
        let odd = q * (q * (q / 5040.0 + 1.0 / 120.0) + 1.0 / 6.0) + 1.0;
        let left = (-s).exp();
        (left * even, left * odd)
    } else if q.re() > 0.0 {
        let root = q.sqrt();
        let (slow, fast) = ((root - s).exp() * 0.5, (-root - s).exp() * 0.5);
        (slow + fast, (slow - fast) / root)
    } else {
        let root = (-q).sqrt();
        let (sin, cos) = root.sin_cos();
        let left = (-s).exp();
        (left * cos, left * sin / root)
    }
}

/// Position and rate of a free oscillator about a held input a time [s] later; `natural` is its
/// natural frequency [rad/s].
pub fn swung<S: Scalar>([from, rate]: [S; 2], input: S, natural: S, damping: S, time: S) -> [S; 2] {
    let faded = damping * natural * time;
    let turned = natural * time;
    let (even, odd) = swings((damping * damping - 1.0) * turned * turned, faded);
    let away = from - input;
    [
        input + away * (even + faded * odd) + rate * odd * time,
        rate * (even - faded * odd) - natural * natural * away * odd * time,
    ]
}

/// Position and rate of a spool a time [s] later, its input (from -1 to 1) held, with stops at -1
/// and 1.
pub fn moved<S: Scalar>(from: [S; 2], input: S, natural: S, damping: S, time: f64) -> [S; 2] {
    let (mut at, mut left) = (from, constant::<S>(time));
    for _ in 0..MOST_STOPS {
        let Some((stop, after)) = next_stop(at, input, natural, damping, left.re()) else { break };
        (at, left) = ([constant(stop), constant(0.0)], left - after);
    }
    let [position, rate] = swung(at, input, natural, damping, left);
    if position.re().abs() > 1.0 {
        [constant(position.re().signum()), constant(0.0)] // by rounding
    } else {
        [position, rate]
    }
}

/// The stop that a spool reaches first within a time [s], and when.
fn next_stop<S: Scalar>(
    at: [S; 2],
    input: S,
    natural: S,
    damping: S,
    time: f64,
) -> Option<(f64, S)> {
    let from = [at[0].re(), at[1].re()];
    let (x, w, zeta) = (input.re(), natural.re(), damping.re());
    let plain = |time: f64| swung(from, x, w, zeta, time)[0];
    let mut begin = 0.0;
    for turn in turns(from[0] - x, from[1], w, zeta) {
        let mut end = turn.min(time);
        let stop = plain(end);
        if stop.abs() > 1.0 {
            let stop = stop.signum();
            for _ in 0..HALVINGS {
                let middle = 0.5 * (begin + end);
                if plain(middle) * stop > 1.0 {
                    end = middle;
                } else {
                    begin = middle;
                }
            }
            // the instant moves with what moves the spool there
            let [place, rate] = swung(at, input, natural, damping, constant(end));
            let slow = rate.re().abs() < GRAZING * w;
            let early = if slow { constant(0.0) } else { (place - place.re()) / rate.re() };
            return Some((stop, -early + end));
        }
        if turn >= time {
            return None;
        }
        begin = turn;
    }
    None // from there on it goes straight, or in smaller swings, to its input
}

/// The first two instants [s] at which a free oscillator turns round; infinite where there is none.
fn turns(away: f64, rate: f64, natural: f64, damping: f64) -> [f64; 2] {
    const NEVER: f64 = f64::INFINITY;
    if away == 0.0 && rate == 0.0 {
        return [NEVER; 2];
    }
    let pull = natural * (natural * away + damping * rate);
    let square = (1.0 - damping) * (1.0 + damping);
    if square > 0.0 {
        let damped = natural * square.sqrt();
        let angle = (rate * damped).atan2(pull);
        let first = if angle > 0.0 { angle } else { angle + PI };
        return [first / damped, (first + PI) / damped];
    }
    let (fast, ratio) = (natural * (-square).sqrt(), rate / pull);
    let sine = ratio * fast;
    if !(ratio > 0.0 && sine < 1.0) {
        [NEVER; 2]
    } else if sine < 1e-6 {
        [ratio, NEVER]
    } else {
        [sine.atanh() / fast, NEVER]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Slope;
    use crate::simulate::integrate::Rk4;

    const STEP: f64 = 1e-6;

    /// The same spool by many small Runge-Kutta steps, with a look at the stops after each.
    fn integrated(mut y: [f64; 2], x: f64, w: f64, zeta: f64, time: f64) -> [f64; 2] {
        let mut method = Rk4::new(2);
        for _ in 0..(time / STEP).round() as usize {
            let held = y[0].abs() >= 1.0 && (x - y[0]) * y[0] >= 0.0;
            if held {
                continue;
            }
            method.step(&mut y, STEP, |_, y, out| {
                out[0] = y[1];
                out[1] = w * w * (x - y[0]) - 2.0 * zeta * w * y[1];
            });
            if y[0].abs() > 1.0 {
                y = [y[0].signum(), 0.0];
            }
        }
        y
    }

    #[test]
    fn the_closed_form_is_the_integral_between_the_stops() {
        let w = 300.0;
        for zeta in [0.05, 0.2, 0.7, 1.0, 1.5] {
            for (y, x) in [
                ([0.0, 0.0], 0.9),
                ([0.9, 250.0], -0.8),
                ([-1.0, 0.0], 1.0),
                ([0.5, -400.0], -0.97),
                ([0.2, 90.0], 0.1),
            ] {
                for time in [2e-3, 8e-3, 30e-3] {
                    let (found, wanted) =
                        (moved(y, x, w, zeta, time), integrated(y, x, w, zeta, time));
                    assert!((found[0] - wanted[0]).abs() < 2e-3, "{zeta} {y:?} {x} {time}");
                    assert!((found[1] - wanted[1]).abs() < 2e-3 * w, "{zeta} {y:?} {x} {time}");
                    let half = moved(moved(y, x, w, zeta, 0.4 * time), x, w, zeta, 0.6 * time);
                    assert!((found[0] - half[0]).abs() < 1e-11, "{zeta} {y:?} {x} {time}");
                }
            }
        }
    }

    #[test]
    fn it_rests_at_a_stop_and_leaves_it() {
        let rest = moved([0.0, 0.0], 1.0, 500.0, 0.1, 0.02);
        assert_eq!(rest, [1.0, 0.0]);
        assert!(moved(rest, 0.5, 500.0, 0.1, 1e-3)[0] < 1.0);
        assert_eq!(turns(0.0, 0.0, 1.0, 0.5), [f64::INFINITY; 2]);
    }

    #[test]
    fn slopes_are_those_of_differences_behind_a_stop_too() {
        // it strikes the upper stop on its way and comes back
        let run = |w: f64, zeta: f64, x: f64| moved([0.0, 200.0], x, w, zeta, 12e-3);
        let (w, zeta, x) = (310.0, 0.3, 0.7);
        assert!(next_stop([0.0, 200.0], x, w, zeta, 12e-3).is_some());
        let dual = |w: Slope, zeta: Slope, x: Slope| {
            moved([0.0.into(), 200.0.into()], x, w, zeta, 12e-3).map(|s| s.slope())
        };
        let h = 1e-6;
        let by = [
            (
                dual(Slope::new(w, 1.0), zeta.into(), x.into()),
                run(w + h, zeta, x),
                run(w - h, zeta, x),
            ),
            (
                dual(w.into(), Slope::new(zeta, 1.0), x.into()),
                run(w, zeta + h, x),
                run(w, zeta - h, x),
            ),
            (
                dual(w.into(), zeta.into(), Slope::new(x, 1.0)),
                run(w, zeta, x + h),
                run(w, zeta, x - h),
            ),
        ];
        for (found, more, less) in by {
            for k in 0..2 {
                let wanted = (more[k] - less[k]) / (2.0 * h);
                assert!(
                    (found[k] - wanted).abs() < 1e-4 * (1.0 + wanted.abs()),
                    "{found:?} {wanted}"
                );
            }
        }
    }
}
