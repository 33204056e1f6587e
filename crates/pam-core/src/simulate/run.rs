//! What the samples of one rig need on the way, kept from one to the next.

use super::drive::Drive;
use super::events::{Conditions, Event, Watch};
use super::initial::Initial;
use super::progress::Progress;
use super::stepper::Stepper;
use super::timing::Timing;
use crate::plant::Rig;
use crate::plant::{Controls, Plant, Simulated};
use crate::vector::{needs_sums, Solo};
use crate::Result;
use self_cell::self_cell;
use std::ops::Range;
use std::sync::Arc;

/// Steps between two looks outside: some ten milliseconds of a large rig.
pub(crate) const STEPS_UNSEEN: usize = 8_000;

/// What samples of one rig need on the way and do not depend on: made once, whatever runs with it.
pub struct Run<'a> {
    pub(crate) stepper: Stepper<'a, f64>,
    /// The faster way to take a sample, for runs that have it.
    solo: Option<Solo<'a>>,
    /// Commands of the sample that is on its way.
    pub(crate) controls: Controls<f64>,
    pub(crate) simulated: Simulated,
    /// Places that are prescribed.
    places: Vec<usize>,
    pub(crate) conditions: Conditions,
    pub(crate) before: Watch,
    pub(crate) after: Watch,
    /// The sample that is on its way.
    pub(crate) next: Progress,
    /// Steps since the last look outside.
    unseen: usize,
}

impl<'a> Run<'a> {
    /// Room for a rig.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn new(rig: &'a Rig) -> Result<Self> {
        Ok(Self::of(Plant::new(rig, rig.parameters().lift(), true)?))
    }

    /// Room for a rig that is run alone: by the equations of the lanes where it can be.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn alone(rig: &'a Rig) -> Result<Self> {
        Ok(Self::alone_of(Plant::new(rig, rig.parameters().lift(), true)?))
    }

    /// The same where only some channels are wanted, by number: without the sums that none of them
    /// needs.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn alone_for(rig: &'a Rig, wanted: &[usize]) -> Result<Self> {
        let sums = wanted.iter().any(|channel| needs_sums(rig, *channel));
        Ok(Self::alone_of(Plant::new(rig, rig.parameters().lift(), sums)?))
    }

    fn alone_of(plant: Plant<'a, f64>) -> Self {
        let solo = Solo::new(&plant);
        Self { solo, ..Self::of(plant) }
    }

    /// The start of a simulation.
    #[must_use]
    pub fn start(&self, initial: &Initial) -> Progress {
        Progress::of(&self.stepper.plant, initial)
    }

    /// Room for a plant.
    pub(crate) fn of(plant: Plant<'a, f64>) -> Self {
        Self {
            simulated: Simulated::all_but(plant.rig(), &[]),
            solo: None,
            controls: plant.controls(|_| 0.0),
            stepper: Stepper::new(plant),
            places: Vec::new(),
            conditions: Conditions::default(),
            before: Watch::default(),
            after: Watch::default(),
            next: Progress::default(),
            unseen: 0,
        }
    }

    /// Integrate everything but what a drive prescribes.
    pub(crate) fn prescribe(&mut self, drive: &Drive<'_>) {
        if !drive.places().eq(self.places.iter().copied()) {
            self.places = drive.places().collect();
            self.simulated = Simulated::all_but(self.stepper.plant.rig(), &self.places);
        }
    }

    /// Take the sample that is on its way to its beginning, a time [s]; whether it goes on in the
    /// faster way.
    #[inline]
    pub(crate) fn begin(&mut self, began: f64, flies: bool, events: &mut Vec<Event>) {
        let Self { stepper, controls, conditions, before, next, .. } = self;
        stepper.begin(&next.state, controls, began);
        conditions.set(&stepper.plant, stepper.controls(controls, 0));
        // the faster way looks at margins only where something happens
        if flies && !conditions.differ(&next.flags, |place| next.state[place]) {
            return;
        }
        before.look(conditions, |place| next.state[place]);
        before.report(stepper.plant.rig(), None, began, &mut next.flags, events);
    }

    /// Whether it has the faster way.
    pub(crate) fn flies(&self) -> bool {
        self.solo.is_some()
    }

    /// Count steps, and look outside now and then.
    #[inline]
    pub(crate) fn seen(
        &mut self,
        steps: usize,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        self.unseen += steps;
        if self.unseen < STEPS_UNSEEN {
            return Ok(());
        }
        self.unseen = 0;
        look()
    }

    /// Steps of a sample that began at a time [s] and the events within them, in the faster way.
    /// Whether they are done: where not, the sample has to begin anew.
    #[inline]
    pub(crate) fn fly(
        &mut self,
        timing: Timing,
        began: f64,
        steps: Range<usize>,
        events: &mut Vec<Event>,
    ) -> bool {
        let Self { stepper, solo, controls, conditions, before, after, next, .. } = self;
        let (Some(solo), plant) = (solo, &stepper.plant) else { return false };
        let Progress { state, flags, .. } = next;
        let dt = timing.step();
        solo.advance(plant, state, controls, (steps.len(), dt), |sub, was, seen| {
            if conditions.differ(flags, |place| seen.at(place)) {
                before.look(conditions, |place| was.at(place));
                after.look(conditions, |place| seen.at(place));
                let time = began + (steps.start + sub + 1) as f64 * dt;
                after.report(plant.rig(), Some((before, dt)), time, flags, events);
            }
        })
    }

    /// One integration step of a sample that began at a time [s], and the events within it.
    #[inline]
    pub(crate) fn step(
        &mut self,
        ends: &[(usize, f64, f64)],
        timing: Timing,
        began: f64,
        sub: usize,
        events: &mut Vec<Event>,
    ) {
        let Self { stepper, controls, conditions, simulated, before, after, next, .. } = self;
        let rig = stepper.plant.rig();
        let dt = timing.step();
        let from = began + sub as f64 * dt;
        let (state, memory) = (&mut next.state, &mut next.memory);
        stepper.step(state, memory, controls, from, dt, simulated, |_, _, fraction, y| {
            let share = (sub as f64 + fraction) / timing.substeps as f64;
            for (place, from, to) in ends {
                y[*place] = from + (to - from) * share;
                if *place >= rig.layout.angle(0) {
                    y[place + rig.layout.coordinates] = (to - from) / timing.sample_time;
                }
            }
        });
        conditions.set(&stepper.plant, stepper.controls(controls, 2));
        after.look(conditions, |place| next.state[place]);
        let time = began + (sub + 1) as f64 * dt;
        after.report(rig, Some((before, dt)), time, &mut next.flags, events);
        std::mem::swap(before, after);
    }
}

self_cell!(
    struct Held {
        owner: Arc<Rig>,
        #[covariant]
        dependent: Run,
    }
);

/// A [`Run`] that keeps its rig alive, so that it can wait for the next command.
pub struct OwnedRun(Held);

impl OwnedRun {
    /// Room for a rig.
    ///
    /// # Errors
    /// As [`Run::alone`].
    pub fn new(rig: Arc<Rig>) -> Result<Self> {
        Ok(Self(Held::try_new(rig, |rig| Run::alone(rig))?))
    }

    /// Do something with the run.
    pub fn with<T>(&mut self, work: impl FnOnce(&mut Run<'_>) -> T) -> T {
        self.0.with_dependent_mut(|_, run| work(run))
    }
}
