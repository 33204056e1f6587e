//! One plant by the equations of the lanes: how a single run advances where its rig allows it. The
//! bits are those of the same plant in a flight.

use super::num::{in_fours, Num, Single};
use super::plan::Plan;
use super::rates::{opening, Lanes, Shape};
use super::rk4::Rk4;
use crate::plant::{Controls, Plant};
use pulp::{Scalar, Simd, WithSimd};

type One = Num<Scalar, Single>;

/// The state of a plant after a step.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'s>(&'s [One]);

impl Seen<'_> {
    /// The number at a place.
    #[inline(always)]
    pub fn at(&self, place: usize) -> f64 {
        self.0[place].numbers()[0]
    }
}

/// A plant in a lane of its own.
pub(crate) struct Solo<'a> {
    plan: &'a Plan,
    lanes: Lanes<'a, Scalar, Single>,
    method: Rk4<Scalar, Single>,
    state: Vec<One>,
}

impl<'a> Solo<'a> {
    /// Room for a plant; none for one that does not run in lanes.
    pub fn new(plant: &Plant<'a, f64>) -> Option<Self> {
        let rig = plant.rig();
        let plan = Plan::of(rig)?;
        let sums = plant.states() > rig.layout.states();
        let state = vec![Num::splat(Scalar, 0.0); plant.states()];
        let lanes = Lanes::new(Scalar, plan, &[plant], sums);
        Some(Self { plan, lanes, method: Rk4::new(&state), state })
    }

    /// Advance a state by some steps of a length [s] under held controls. `look` sees what it was
    /// before each of them and what it is then, place by place, with the number of the step. Whether it stayed where the lanes' curves, and the
    /// model, hold; where it did not, it has to be advanced in another way.
    pub fn advance(
        &mut self,
        plant: &Plant<'a, f64>,
        state: &mut [f64],
        controls: &Controls<f64>,
        steps: (usize, f64),
        look: impl FnMut(usize, Seen<'_>, Seen<'_>),
    ) -> bool {
        if !self.holds(plant, state) {
            return false;
        }
        for (k, spool) in controls.spool.iter().enumerate() {
            self.lanes.open(k, &[opening(plant, k, *spool)]);
        }
        for (k, set) in controls.set_pressure.iter().enumerate() {
            self.lanes.set(k, &[set.now]);
        }
        let stayed = in_fours(Advance { solo: self, plant, state, steps, look });
        stayed && self.holds(plant, state)
    }

    /// Whether a state is in the range of the model and of the curves.
    fn holds(&self, plant: &Plant<'a, f64>, state: &[f64]) -> bool {
        let layout = plant.rig().layout;
        let (pressures, rest) = state[..layout.states()].split_at(layout.mass(0));
        pressures.iter().all(|pressure| *pressure >= 0.0 && pressure.is_finite())
            && rest.iter().all(|value| value.is_finite())
            && self.plan.contains(state[layout.angle(0)])
    }
}

/// The steps, compiled for each kind of register: a muscle's columns stand side by side in them.
struct Advance<'s, 'p, 'a, L> {
    solo: &'s mut Solo<'a>,
    plant: &'p Plant<'a, f64>,
    state: &'s mut [f64],
    steps: (usize, f64),
    look: L,
}

impl<L: FnMut(usize, Seen<'_>, Seen<'_>)> WithSimd for Advance<'_, '_, '_, L> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<W: Simd>(self, wide: W) -> bool {
        // Compiled once for the shape of most rigs, and once for all others.
        match self.solo.lanes.shape {
            shape if shape.is_small() && shape.sums() => self.steps(wide, Shape::small(true)),
            shape if shape.is_small() => self.steps(wide, Shape::small(false)),
            shape => self.steps(wide, shape.of_any_size()),
        }
    }
}

impl<L: FnMut(usize, Seen<'_>, Seen<'_>)> Advance<'_, '_, '_, L> {
    #[inline(always)]
    fn steps<W: Simd>(self, wide: W, shape: Shape) -> bool {
        let Self { solo, plant, state, steps: (count, step), mut look } = self;
        let angle = plant.rig().layout.angle(0);
        let state = &mut state[..shape.states()];
        for (own, value) in solo.state.iter_mut().zip(&*state) {
            *own = Num::splat(Scalar, *value);
        }
        for k in 0..count {
            solo.method.step(wide, shape, &mut solo.lanes, &mut solo.state, step);
            let seen = Seen(&solo.state);
            if !solo.plan.contains(seen.at(angle)) {
                return false;
            }
            look(k, Seen(solo.method.before()), seen);
        }
        for (value, own) in state.iter_mut().zip(&solo.state) {
            *value = own.numbers()[0];
        }
        true
    }
}
