//! `input_path_lag`: command delay, spool and line, lumped into one lag and one delay between
//! command and opening.
//!
//! `lag_and_delay`: `w' = (x - w)/T` of the normalised command `x`, then the delay `D` as three
//! equal lags `z_i' = (z_(i-1) - z_i)/(D/3)`, `z_0 = w`: a delay that can be differentiated.
//! Commands are held, so that the chain moves in closed form over any time, by the phi functions of
//! exponential integrators (M. Hochbruck & A. Ostermann, "Exponential integrators", *Acta Numerica*
//! 19, 2010), and no step is too long for it. The form is as commonly used for valves and their
//! drivers.
//!
//! The forms `second_order`, `slew_limit`, `up_and_down` and `dead_time` stand in files of their own.

mod dead_time;
mod second_order;
mod slew_limit;
mod up_and_down;

use super::{
    begun, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role, BEGINNING, BEGUN,
};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// Lag of a slow command.
const TIME_CONSTANT: EffectParameter =
    EffectParameter::new("time_constant", "s", 0.0, 100.0, 0.005).starts(&[0.003, 0.015]).off(0.0);

/// How late the command comes.
const DELAY: EffectParameter =
    EffectParameter::new("delay", "s", 0.0, 100.0, 0.0).starts(&[0.005]).off(0.0);

const LAG_AND_DELAY: Form = Form {
    name: "lag_and_delay",
    parameters: &[TIME_CONSTANT, DELAY],
    states: &[BEGINNING, opens("lag"), opens("delay_1"), opens("delay_2"), opens("delay_3")],
    integrates: false,
    ports: &[Port::Command],
    make: made_by!(make),
};

const fn opens(name: &'static str) -> EffectState {
    EffectState { name, role: Role::Opens }
}

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "input_path_lag",
    block: "valve",
    at: "valve",
    source: "lags, delay and limits in the forms as commonly used; Richer & Hurmuzlu (2000) for a \
        spool of second order; Hochbruck & Ostermann (2010) for the closed form; Hildebrandt, \
        Sawodny, Neumann & Hartmann (2005) for valves of muscles",
    forms: &[
        LAG_AND_DELAY,
        second_order::FORM,
        slew_limit::FORM,
        up_and_down::FORM,
        dead_time::FORM,
    ],
    ..EffectInfo::USUAL
};

/// Lags of which the delay is made.
const STAGES: f64 = 3.0;
/// A shorter lag [s] counts as none.
pub const SHORTEST: f64 = 2e-5;

/// A position on the way to an input after a time [s], with a lag.
#[inline]
fn lagging<S: Scalar>(from: S, input: S, time_constant: S, time: f64) -> S {
    if time_constant.re() > SHORTEST {
        input + (from - input) * (-constant::<S>(time) / time_constant).exp()
    } else {
        input
    }
}

/// Positions along the chain: behind the lag, and behind each part of the delay. The last one opens
/// the valve.
pub type Chain<S> = [S; 4];

/// The chain a time [s] later, its input held.
#[inline]
pub fn moved<S: Scalar>(
    from: &Chain<S>,
    input: S,
    time_constant: S,
    delay: S,
    time: f64,
) -> Chain<S> {
    let zero = constant::<S>(0.0);
    let lagging = time_constant.re() > SHORTEST;
    // Distances from where the chain goes, and what is left of the first one.
    let (first, age) =
        if lagging { (from[0] - input, constant::<S>(time) / time_constant) } else { (zero, zero) };
    let left = if lagging { (-age).exp() } else { zero };
    let lag = if lagging { input + first * left } else { input };
    let part = delay / STAGES;
    if part.re() <= SHORTEST {
        return [lag; 4];
    }
    let a = constant::<S>(time) / part;
    let e = (-a).exp();
    let d = [from[1] - input, from[2] - input, from[3] - input];
    let p = if lagging { phi(a - age, e, left) } else { [zero; 3] };
    [
        lag,
        input + e * d[0] + a * p[0] * first,
        input + e * (d[1] + a * d[0]) + a * a * p[1] * first,
        input + e * (d[2] + a * (d[1] + a * d[0] * 0.5)) + a * a * a * p[2] * first,
    ]
}

/// `exp(-a) phi_i(x)` for i = 1 to 3, `phi_i = sum x^k/(k + i)!`, from `exp(-a)` and `exp(x - a)`.
fn phi<S: Scalar>(x: S, e: S, ex: S) -> [S; 3] {
    if x.re().abs() < 0.5 {
        let mut sums = [constant::<S>(0.0); 3];
        for (i, sum) in sums.iter_mut().enumerate() {
            for k in (0..14_u32).rev() {
                // Horner: sum x^k/(k + i + 1)! = (1 + x/(i + 2) (1 + ...))/(i + 1)!
                *sum = *sum * x / f64::from(k + i as u32 + 2) + 1.0;
            }
        }
        return [e * sums[0], e * sums[1] * 0.5, e * sums[2] / 6.0];
    }
    let one = (ex - e) / x;
    let two = (one - e) / x;
    [one, two, (two - e * 0.5) / x]
}

/// Rates of the chain [1/s], its input held; of a lag that counts as none they are zero, and what
/// follows it is fed by its input.
pub fn rates<S: Scalar>(chain: &Chain<S>, input: S, time_constant: S, delay: S) -> Chain<S> {
    let zero = constant::<S>(0.0);
    let lagging = time_constant.re() > SHORTEST;
    let first = if lagging { (input - chain[0]) / time_constant } else { zero };
    let part = delay / STAGES;
    if part.re() <= SHORTEST {
        return [first, zero, zero, zero];
    }
    let fed = if lagging { chain[0] } else { input };
    [first, (fed - chain[1]) / part, (chain[1] - chain[2]) / part, (chain[2] - chain[3]) / part]
}

/// Fastest rate of the chain [1/s].
pub fn fastest(time_constant: f64, delay: f64) -> f64 {
    let rate = |time: f64| if time > SHORTEST { 1.0 / time } else { 0.0 };
    rate(time_constant).max(rate(delay / STAGES))
}

/// Lag and delay of a command; its states say that it has begun, and the chain.
#[derive(Debug, Clone, Copy)]
struct InputPath<S> {
    time_constant: S,
    delay: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(InputPath { time_constant: values[0], delay: values[1] })
}

impl<S: Scalar> InputPath<S> {
    /// The chain so long after a step began.
    fn chain(&self, own: &[S], input: S, age: f64) -> Chain<S> {
        if begun(own) {
            let was = std::array::from_fn(|k| own[1 + k]);
            moved(&was, input, self.time_constant, self.delay, age)
        } else {
            [input; 4]
        }
    }
}

impl<S: Scalar> Effect<S> for InputPath<S> {
    fn position(&self, own: &[S], input: S, age: f64) -> S {
        self.chain(own, input, age)[3]
    }

    fn follow(&self, own: &mut [S], input: S, step: f64) -> S {
        let chain = self.chain(own, input, step);
        own[0] = constant(BEGUN);
        own[1..].copy_from_slice(&chain);
        chain[3]
    }

    fn linear_rates(&self, own: &[S], input: S, out: &mut [S]) {
        let chain = std::array::from_fn(|k| own[1 + k]);
        out[1..].copy_from_slice(&rates(&chain, input, self.time_constant, self.delay));
    }

    fn fastest(&self) -> f64 {
        fastest(self.time_constant.re(), self.delay.re())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Slope;

    /// The same chain by many small Runge-Kutta steps.
    fn integrated(mut y: Chain<f64>, input: f64, tc: f64, delay: f64, time: f64) -> Chain<f64> {
        let rate = |y: &Chain<f64>| {
            let part = delay / 3.0;
            [(input - y[0]) / tc, (y[0] - y[1]) / part, (y[1] - y[2]) / part, (y[2] - y[3]) / part]
        };
        let add = |y: &Chain<f64>, k: &Chain<f64>, h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
        let (n, h) = (4000, time / 4000.0);
        for _ in 0..n {
            let k1 = rate(&y);
            let k2 = rate(&add(&y, &k1, h / 2.0));
            let k3 = rate(&add(&y, &k2, h / 2.0));
            let k4 = rate(&add(&y, &k3, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        y
    }

    #[test]
    fn closed_form_is_the_integral_of_the_chain() {
        let start = [0.3, 0.1, -0.2, 0.05];
        for (tc, delay) in
            [(5e-3, 9e-3), (4e-3, 12e-3), (4e-3, 12.001e-3), (2e-3, 30e-3), (30e-3, 3e-3)]
        {
            let exact = moved(&start, 0.8, tc, delay, 7e-3);
            let numeric = integrated(start, 0.8, tc, delay, 7e-3);
            for (a, b) in exact.iter().zip(numeric) {
                assert!((a - b).abs() < 1e-9, "{tc} {delay}: {a} {b}");
            }
        }
    }

    #[test]
    fn two_moves_are_one_and_no_lag_is_the_input() {
        let start = [0.3, 0.1, -0.2, 0.05];
        let once = moved(&start, 0.8, 5e-3, 9e-3, 4e-3);
        let twice = moved(&moved(&start, 0.8, 5e-3, 9e-3, 1e-3), 0.8, 5e-3, 9e-3, 3e-3);
        assert!(once.iter().zip(twice).all(|(a, b): (&f64, f64)| (a - b).abs() < 1e-14));
        assert_eq!(moved(&start, 0.8, 0.0, 0.0, 1e-3), [0.8; 4]);
        assert_eq!(moved(&start, 0.8, 1e-4, 1e-3, 1e9), [0.8; 4]);
    }

    #[test]
    fn the_closed_form_begins_with_the_rates() {
        let (start, h) = ([0.3, 0.1, -0.2, 0.05], 1e-9);
        for (tc, delay) in [(5e-3, 9e-3), (4e-3, 0.0), (0.0, 30e-3), (30e-3, 3e-3)] {
            let (was, now) = (moved(&start, 0.8, tc, delay, 0.0), moved(&start, 0.8, tc, delay, h));
            let (first, last) = (usize::from(tc == 0.0), if delay > 0.0 { 4 } else { 1 });
            for (k, rate) in rates(&start, 0.8, tc, delay).into_iter().enumerate() {
                let counts = (first..last).contains(&k);
                let expected: f64 = if counts { (now[k] - was[k]) / h } else { 0.0 };
                assert!(
                    (rate - expected).abs() < 1e-4 * expected.abs() + 1e-5,
                    "{tc} {delay} {k}: {rate}"
                );
            }
        }
    }

    #[test]
    fn sensitivities_are_those_of_differences() {
        let start = [0.3, 0.1, -0.2, 0.05].map(Slope::from);
        for (tc, delay) in [(5e-3, 9e-3), (4e-3, 12e-3)] {
            let run = |t: f64, d: f64| moved(&start.map(|s| s.re), 0.8, t, d, 3e-3)[3];
            let by_lag =
                moved(&start, 0.8.into(), Slope::new(tc, 1.0), delay.into(), 3e-3)[3].slope();
            let by_delay =
                moved(&start, 0.8.into(), tc.into(), Slope::new(delay, 1.0), 3e-3)[3].slope();
            let h = 1e-7;
            assert!((by_lag - (run(tc + h, delay) - run(tc - h, delay)) / (2.0 * h)).abs() < 1e-3);
            assert!(
                (by_delay - (run(tc, delay + h) - run(tc, delay - h)) / (2.0 * h)).abs() < 1e-3
            );
        }
    }
}
