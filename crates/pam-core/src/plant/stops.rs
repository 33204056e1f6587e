//! Joints that meet a stop: where they may within a step, and what sensitivities gain.
//!
//! A stop with damping pushes from the first instant: the acceleration jumps. A joint which is a
//! little further meets it a little sooner, and has moved under the new acceleration for that time:
//! the saltation of a system that switches (see `kinks.rs`).

use super::rates::{Controls, Plant, Scratch, Simulated};
use super::units::Coordinate;
use super::Memory;
use crate::scalar::{constant, Scalar};

/// How far beyond an end the push of a stop is read [rad or m].
const TOUCH: f64 = 1e-9;

impl<S: Scalar> Plant<'_, S> {
    /// Whether a step has to ask: sensitivities are wanted of a coordinate that moves between stops.
    pub fn asks_for_stops(&self, simulated: &Simulated) -> bool {
        S::DERIVATIVES > 0
            && (self.wiring.coordinates.iter().enumerate())
                .any(|(k, c)| c.stops.is_some() && simulated.moves(self.layout.angle(k)))
    }

    /// The coordinates, without their derivatives.
    pub fn where_coordinates_are(&self, state: &[S], out: &mut Vec<f64>) {
        out.clear();
        out.extend((0..self.layout.coordinates).map(|k| state[self.layout.angle(k)].re()));
    }

    /// Time until the first coordinate that moves as it does now meets a stop [s]; infinite where
    /// none will.
    pub fn time_to_stop(&self, state: &[S]) -> f64 {
        let one = |(k, coordinate): (usize, &Coordinate)| {
            let place = self.layout.angle(k);
            let (angle, rate) = (state[place].re(), state[place + self.layout.coordinates].re());
            let stops = coordinate.stops?;
            if rate > 0.0 && angle <= stops.max_angle {
                Some((stops.max_angle - angle) / rate)
            } else if rate < 0.0 && angle >= stops.min_angle {
                Some((stops.min_angle - angle) / rate)
            } else {
                None
            }
        };
        (self.wiring.coordinates.iter().enumerate()).filter_map(one).fold(f64::INFINITY, f64::min)
    }

    /// What the sensitivities gain by the stops that coordinates met within a step.
    #[allow(clippy::too_many_arguments)]
    pub fn meet_stops(
        &self,
        were: &[f64],
        state: &mut [S],
        controls: &Controls<S>,
        memory: &[Memory<S>],
        start: &[S],
        simulated: &Simulated,
        here: &mut Scratch<S>,
    ) {
        for (k, (was, coordinate)) in were.iter().zip(&self.wiring.coordinates).enumerate() {
            let place = self.layout.angle(k);
            let (now, rate) = (state[place], state[place + self.layout.coordinates].re());
            let Some(stops) = coordinate.stops.filter(|_| simulated.moves(place)) else { continue };
            let (end, inward) = if *was <= stops.max_angle && now.re() > stops.max_angle {
                (stops.max_angle, -TOUCH)
            } else if *was >= stops.min_angle && now.re() < stops.min_angle {
                (stops.min_angle, TOUCH)
            } else {
                continue;
            };
            if rate * inward >= 0.0 {
                continue; // it has turned already
            }
            let [free, pushed] = [inward, -inward].map(|beside| {
                let mut out = vec![constant(0.0); state.len()];
                state[place] = constant(end + beside);
                self.rates(state, controls, memory, start, simulated, here, &mut out);
                out
            });
            state[place] = now;
            let later = -(now - now.re()) / rate;
            for (own, value) in state.iter_mut().enumerate() {
                let jump = free[own].re() - pushed[own].re();
                if jump != 0.0 && simulated.moves(own) {
                    *value += later * jump;
                }
            }
        }
    }
}
