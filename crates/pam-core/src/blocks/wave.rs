//! Tube that holds gas and carries waves, as a row of equal segments.
//!
//! Between two nodes of gas flows `m`, which has inertia: `dm/dt = (A/l) [(u - d)(1 - h b^2 w^4/(u
//! d)^2) - (2 (b^2 - h) w^2 ln(u/d) + k/n w max(w, e p))/(u + d)]` with the area `A`, the length
//! `l` of one of `n` segments, `w = m/(C rho0 sqrt(T0/T))`, the pressures `u = max(p_up, b w)` and
//! `d = max(p_down, b w)`, and `p` their mean. A node of the volume `A l` has `dp/dt = alpha R
//! T/(A l) (m_in - m_out)`; a half of it is at either end of the tube. Waves run at `sqrt(alpha R
//! T)`: `alpha` is 1.4 for sound, 1 where the wall keeps the gas at its temperature. E. B. Wylie,
//! V. L. Streeter, *Fluid Transients in Systems*, 1993 (inertia, capacity and friction of a pipe
//! in lumps); B. W. Andersen, *The Analysis and Design of Pneumatic Systems*, 1967.
//!
//! The friction is that with which the tube passes in a steady flow what [`Tube`] passes, however
//! many segments it has: with `y = p/w` at its two ends `f(y_1) - f(y_2) = k`, `f = y^2 + 2 (h -
//! b^2) ln y + h b^2/y^2`, where `f'(b) = 0`, so that the flow is choked where it leaves at the
//! speed at which a tube of [`Tube`] does, and `k` and `h` give the same choked flow and the same
//! slope next to equal pressures. The terms besides `k` are those of the momentum that gas takes
//! along where it becomes faster (Shapiro, *Compressible Fluid Flow*, 1953, chapter 6). Between
//! the two the flows differ by less than half a percent up to `b = 0.5` and by 2.3 % for the
//! shortest tube there is (`b = 0.61`). Below `b = 0.12` (14 m of 4 mm) `f'(y) >= 0` bounds `h`,
//! and the slope next to equal pressures is up to 2 % off. `e` is where [`Tube`] is laminar.

use super::gas::{Gas, LAMINAR_RATIO};
use super::tube::Tube;
use crate::scalar::{constant, Scalar};
use std::f64::consts::PI;

/// Pressures below count as this one where friction asks for their ratio [Pa].
const LEAST: f64 = 1.0;

/// The segments of a tube at one gas temperature.
#[derive(Debug, Clone, Copy)]
pub struct Wave<S> {
    /// Choked mass flow of the whole tube per upstream pressure [kg/(s Pa)].
    flow_factor: S,
    /// Its critical pressure ratio `b` [1].
    critical_ratio: S,
    /// `h` [1].
    bend: S,
    /// `k/n` [1].
    friction: S,
    /// `e`, share of the choked flow up to which it is laminar [1].
    laminar: S,
    /// Area over the length of a segment [m].
    area_per_length: S,
    /// Speed of a wave [m/s].
    speed: S,
    /// Length of a segment [m].
    length: S,
}

impl<S: Scalar> Wave<S> {
    /// A tube of a length and an inner diameter [m] in some segments; `alpha` as above.
    pub fn new(length: S, diameter: S, alpha: S, segments: usize, gas: &Gas) -> Self {
        let tube = Tube::new(length, diameter, gas.temperature);
        let b = tube.critical_ratio;
        let (square, fall) = (b * b, -b.ln());
        let free = (square * fall * 2.0 - b * (-b + 1.0)) / (fall * 2.0 - 1.0 + square);
        let bend = if free.re() > -square.re() { free } else { -square };
        // f(1) - f(b)
        let friction = -square + 1.0 + (bend - square) * fall * 2.0 + bend * (square - 1.0);
        let segment = length / segments as f64;
        Self {
            flow_factor: tube.flow_factor,
            critical_ratio: b,
            bend,
            friction: friction / segments as f64,
            laminar: tube.psi(constant(LAMINAR_RATIO)),
            area_per_length: diameter * diameter * (PI / 4.0) / segment,
            speed: (alpha * (gas.gas_constant * gas.temperature)).sqrt(),
            length: segment,
        }
    }

    /// Rate of the mass flow [kg/s2] between two nodes of absolute pressures [Pa].
    #[inline]
    pub fn flow_rate(&self, from: S, to: S, flow: S) -> S {
        if flow.re() >= 0.0 {
            self.driven(from, to, flow) * self.area_per_length
        } else {
            -(self.driven(to, from, -flow) * self.area_per_length)
        }
    }

    /// Pressure difference [Pa] less what the flow along it loses.
    #[inline]
    fn driven(&self, upstream: S, downstream: S, flow: S) -> S {
        let (b, h) = (self.critical_ratio, self.bend);
        let w = flow / self.flow_factor;
        let least = b * w;
        let at_least = |pressure: S| {
            if pressure.re() < least.re().max(LEAST) {
                if least.re() > LEAST {
                    least
                } else {
                    constant(LEAST)
                }
            } else {
                pressure // or no number, which ends the run
            }
        };
        let (u, d) = (at_least(upstream), at_least(downstream));
        let (sum, square) = (u + d, w * w);
        let laminar = self.laminar * sum * 0.5;
        let faster = if w.re() > laminar.re() { square } else { w * laminar };
        let sonic = square / (u * d);
        let lost = (b * b - h) * square * (u / d).ln() * 2.0 + self.friction * faster;
        (u - d) * (-(h * b * b * sonic * sonic) + 1.0) - lost / sum
    }
}

impl Wave<f64> {
    /// Mass flow per pressure of a wave, `A/c` [kg/(s Pa)]: what it takes from a node at one end of
    /// a segment.
    pub fn admittance(&self) -> f64 {
        self.area_per_length * self.length / self.speed
    }

    /// Fastest rate of a flow [1/s]: of a wave from node to node and of the friction, which is
    /// steepest at the speed at which the tube is choked.
    pub fn fastest(&self) -> f64 {
        let b = self.critical_ratio;
        let steepest = (self.friction / b + 2.0 * b) / self.flow_factor;
        2.0 * self.speed / self.length + self.area_per_length * steepest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Slope;

    fn gas() -> Gas {
        Gas::new(101_325.0, 293.15, 287.05, 1.4)
    }

    /// Steady flow through one segment.
    fn steady(wave: &Wave<f64>, from: f64, to: f64) -> f64 {
        let (mut low, mut high) = (0.0, wave.flow_factor * from / wave.critical_ratio);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if wave.flow_rate(from, to, middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    #[test]
    fn it_passes_what_the_tube_without_waves_passes() {
        for (length, diameter, most) in [
            (0.3, 0.004, 0.005),
            (1.0, 0.004, 0.005),
            (2.0, 0.008, 0.005),
            (8.0, 0.004, 0.005),
            (30.0, 0.004, 0.01),
            (1e-3, 0.01, 0.025),
        ] {
            let tube = Tube::<f64>::new(length, diameter, 293.15);
            let wave = Wave::new(length, diameter, 1.4, 1, &gas());
            for share in [0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99] {
                let b = tube.critical_ratio();
                let to = 6e5 * (b + (1.0 - b) * share);
                let (want, found) = (tube.mass_flow(6e5, to), steady(&wave, 6e5, to));
                assert!(
                    (found / want - 1.0).abs() < most,
                    "{length} m, {diameter} m, {share}: {}",
                    found / want
                );
            }
            // choked alike, laminar alike
            let choked = steady(&wave, 6e5, 1e3);
            assert!((choked / tube.mass_flow(6e5, 1e3) - 1.0).abs() < 1e-3, "{length}");
            let small = steady(&wave, 6e5, 6e5 - 100.0);
            assert!((small / tube.mass_flow(6e5, 6e5 - 100.0) - 1.0).abs() < 0.02, "{length}");
        }
    }

    #[test]
    fn a_flow_turns_with_its_pressures_and_no_number_stays_none() {
        let wave = Wave::<f64>::new(2.0, 0.004, 1.4, 4, &gas());
        for flow in [0.0, 1e-6, 1e-4, 3e-3, 0.1] {
            assert_eq!(wave.flow_rate(5e5, 2e5, flow), -wave.flow_rate(2e5, 5e5, -flow));
        }
        assert_eq!(wave.flow_rate(3e5, 3e5, 0.0), 0.0);
        assert!(wave.flow_rate(0.0, 0.0, 0.0) == 0.0 && wave.flow_rate(-1.0, 1e5, 0.0) < 0.0);
        assert!(wave.flow_rate(f64::NAN, 1e5, 1e-3).is_nan());
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let at =
            |x: [f64; 6]| Wave::<f64>::new(x[3], x[4], x[5], 3, &gas()).flow_rate(x[0], x[1], x[2]);
        for x in [
            [5e5, 2e5, 1e-3, 2.0, 0.004, 1.4],
            [5e5, 4.9e5, -2e-4, 8.0, 0.004, 1.2],
            [3e5, 3e5, 1e-6, 40.0, 0.004, 1.4],
            [3e5, 1e4, 2e-3, 2.0, 0.004, 1.0],
        ] {
            for k in 0..6 {
                let mut d = x.map(Slope::from);
                d[k].eps = [1.0];
                let exact = Wave::new(d[3], d[4], d[5], 3, &gas()).flow_rate(d[0], d[1], d[2]);
                let h = 1e-6 * x[k].abs();
                let (mut up, mut down) = (x, x);
                up[k] += h;
                down[k] -= h;
                let difference = (at(up) - at(down)) / (2.0 * h);
                assert!(
                    (exact.slope() - difference).abs() < 1e-5 * difference.abs() + 1e-9,
                    "{x:?} {k}: {} {difference}",
                    exact.slope()
                );
            }
        }
    }

    #[test]
    fn nothing_is_faster_than_it_says() {
        for (length, diameter, segments) in [(8.0, 0.004, 1), (8.0, 0.004, 32), (0.5, 0.006, 8)] {
            let wave = Wave::<f64>::new(length, diameter, 1.4, segments, &gas());
            let friction = wave.fastest() - 2.0 * wave.speed / wave.length;
            for i in 0..40 {
                let to = 1e3 * 1.2_f64.powi(i);
                for j in 0..400 {
                    let flow = f64::from(j) / 300.0 * 2e5 * wave.flow_factor / wave.critical_ratio;
                    let h = 1e-9;
                    let slope = (wave.flow_rate(2e5, to, flow + h)
                        - wave.flow_rate(2e5, to, (flow - h).max(0.0)))
                        / (h + h.min(flow));
                    assert!(-slope < 1.001 * friction, "{to} {flow}: {slope} {friction}");
                }
            }
        }
    }
}
