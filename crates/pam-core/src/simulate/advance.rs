//! A simulation goes on, sample by sample.

use super::drive::Drive;
use super::initial::Initial;
use super::progress::Progress;
use super::run::{Run, STEPS_UNSEEN};
use super::timing::Timing;
use super::trajectory::{room, Trajectory};
use crate::plant::{Controls, Plant, Rig};
use crate::vector::Wanted;
use crate::Result;
use std::ops::Range;

impl Trajectory {
    /// Without rows, for some channels by number, in their order.
    #[must_use]
    pub fn of_some(run: &Run<'_>, rows: usize, wanted: &[usize]) -> Self {
        let channels = wanted.iter().map(|_| room(rows)).collect();
        Self { channels, wanted: Some(Wanted::new(&run.stepper.plant, wanted)), ..Self::blind() }
    }
}

impl Progress {
    /// Bring the conditions of events up to date, of a state that was moved under these controls.
    pub(crate) fn look(&mut self, run: &mut Run<'_>, controls: &Controls<f64>) {
        let plant = &run.stepper.plant;
        run.conditions.set(plant, controls);
        run.after.look(&run.conditions, |place| self.state[place]);
        run.after.report(plant.rig(), None, 0.0, &mut self.flags, &mut Vec::new());
    }

    /// As [`Self::observe`], with a run of the same rig.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_in(
        &self,
        run: &mut Run<'_>,
        timing: Timing,
        out: &mut Trajectory,
    ) -> Result<()> {
        self.observed(&run.stepper.plant, &mut run.stepper.scratch, timing, out)
    }

    /// Hold the commands of each sample and append the sample after it. What is prescribed moves
    /// evenly to its value for the end of each sample.
    ///
    /// # Errors
    /// [`Error::Integration`] when the state leaves the model's range; what was appended before
    /// stays, and the progress is that of the last good sample.
    pub fn advance(
        &mut self,
        rig: &Rig,
        timing: Timing,
        drive: &Drive<'_>,
        out: &mut Trajectory,
    ) -> Result<()> {
        self.advance_watched(rig, timing, drive, out, &mut || Ok(()))
    }

    /// As [`Self::advance`], with a look outside every few milliseconds: an error of `look` ends
    /// the run at the last sample.
    ///
    /// # Errors
    /// As [`Self::advance`], and that of `look`.
    pub fn advance_watched(
        &mut self,
        rig: &Rig,
        timing: Timing,
        drive: &Drive<'_>,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        self.advance_in(&mut Run::new(rig)?, timing, drive, 0..drive.samples, out, look)
    }

    /// As [`Self::advance_watched`] over some samples of a drive, with a run of the same rig.
    ///
    /// # Errors
    /// As [`Self::advance_watched`].
    pub fn advance_in(
        &mut self,
        run: &mut Run<'_>,
        timing: Timing,
        drive: &Drive<'_>,
        samples: Range<usize>,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        debug_assert_eq!(self.state.len(), run.stepper.plant.states(), "sums as the run has them");
        run.prescribe(drive);
        for k in samples {
            let happened = out.events.len();
            if let Err(error) = self.sample(run, timing, drive, k, out, look) {
                out.events.truncate(happened);
                return Err(error);
            }
        }
        Ok(())
    }

    /// One sample of a drive. Where it fails, this is still where the sample began.
    #[inline]
    fn sample(
        &mut self,
        run: &mut Run<'_>,
        timing: Timing,
        drive: &Drive<'_>,
        k: usize,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        let happened = out.events.len();
        run.stepper.plant.command(|input| drive.commands[input][k], &mut run.controls);
        let flown = !drive.prescribes() && self.flown(run, timing, out, look)?;
        if !flown {
            out.events.truncate(happened);
            self.stepped(run, timing, drive, k, out, look)?;
        }
        let Run { stepper, next, .. } = run;
        // Within a step they were found block by block.
        if let Some(new) = out.events.get_mut(happened..) {
            new.sort_by(|a, b| a.time.total_cmp(&b.time));
        }
        next.samples += 1;
        if !flown {
            next.check(&stepper.plant, timing)?; // what flew was looked at
        }
        next.seen(&stepper.plant, &mut stepper.scratch, timing, out);
        std::mem::swap(self, next);
        Ok(())
    }

    /// The steps of a sample under the commands of a run, in its faster way; whether they are done.
    #[inline]
    fn flown(
        &self,
        run: &mut Run<'_>,
        timing: Timing,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<bool> {
        if !run.flies() {
            return Ok(false);
        }
        run.next.clone_from(self);
        let began = self.samples as f64 * timing.sample_time;
        run.begin(began, true, &mut out.events);
        for from in (0..timing.substeps).step_by(STEPS_UNSEEN) {
            let steps = from..timing.substeps.min(from + STEPS_UNSEEN);
            let taken = steps.len();
            if !run.fly(timing, began, steps, &mut out.events) {
                return Ok(false);
            }
            run.seen(taken, look)?;
        }
        Ok(true)
    }

    /// The steps of a sample of a drive under the commands of a run, one by one.
    fn stepped(
        &self,
        run: &mut Run<'_>,
        timing: Timing,
        drive: &Drive<'_>,
        k: usize,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        run.next.clone_from(self);
        let ends = drive.ends(run.stepper.plant.rig(), &self.state, k);
        let began = self.samples as f64 * timing.sample_time;
        if self.kept > 0 {
            run.next.remember(&run.stepper.plant, &mut run.stepper.scratch, drive, k, timing);
            run.controls = run.next.delayed(&run.stepper.plant, began, timing);
        }
        run.begin(began, false, &mut out.events);
        for sub in 0..timing.substeps {
            if self.kept > 0 {
                let from = began + sub as f64 * timing.step();
                run.controls = run.next.delayed(&run.stepper.plant, from, timing);
            }
            run.step(&ends, timing, began, sub, &mut out.events);
            run.seen(1, look)?;
        }
        let Run { stepper, next, .. } = run;
        for (place, ..) in &ends {
            held_mass(&stepper.plant, *place, &mut next.state);
        }
        Ok(())
    }
}

/// The gas of a prescribed pressure is at the temperature of the room, and what that takes was
/// supplied from outside (or, where it is less, vented).
fn held_mass(plant: &Plant<'_, f64>, place: usize, state: &mut [f64]) {
    let layout = plant.rig().layout;
    if !(layout.pressure(0)..layout.mass(0)).contains(&place) {
        return;
    }
    let gas = place - layout.supplies;
    let (mass, pressure) = (plant.rest_mass(gas, state), state[place]);
    let more = mass - state[layout.mass(gas)];
    let air = &plant.rig().gas;
    let rt = air.gas_constant * air.temperature;
    state[layout.mass(gas)] = mass;
    if state.len() == layout.states() {
        return; // without sums
    }
    if more > 0.0 {
        state[layout.balance(0)] += more;
        state[layout.balance(2)] += more * rt;
        state[layout.balance(3)] += more * rt * (pressure / air.ambient_pressure).ln();
    } else {
        state[layout.balance(1)] -= more;
    }
}

/// Simulate `rows` rows: the initial state, and one for each held sample but the last.
///
/// # Errors
/// As [`Drive::new`] and [`Progress::advance`].
pub fn simulate(
    rig: &Rig,
    rows: usize,
    signals: &[(&str, &[f64])],
    timing: Timing,
    initial: &Initial,
) -> Result<Trajectory> {
    let mut out = Trajectory::new(rig, rows);
    let mut progress = Progress::start(rig, initial)?;
    progress.observe(rig, timing, &mut out)?;
    let drive = Drive::new(rig, rows, signals)?;
    progress.advance(rig, timing, &drive.part(0..rows.saturating_sub(1)), &mut out)?;
    Ok(out)
}
