//! Valves that switch within a step: at which instants, and what that does to the slopes of a
//! state.

use super::rates::{Controls, Plant};
use crate::scalar::{constant, Scalar};

/// A valve takes another position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Switch<S> {
    /// How long after the step began [s].
    pub after: S,
    pub valve: usize,
    pub position: f64,
}

/// What valves that switch do in a step.
#[derive(Debug, Clone)]
pub(crate) struct Switches<S> {
    /// In the order of time.
    pub each: Vec<Switch<S>>,
    /// Where those that switched stand.
    taken: Vec<(usize, f64)>,
    /// Their states at the end of the step, with the place of the first.
    ends: Vec<(usize, Vec<S>)>,
}

impl<S: Scalar> Switches<S> {
    /// None.
    pub fn none() -> Self {
        Self { each: Vec::new(), taken: Vec::new(), ends: Vec::new() }
    }

    /// A valve takes its position.
    pub fn take(&mut self, switch: &Switch<S>) {
        self.taken.push((switch.valve, switch.position));
    }

    /// Write where valves stand over controls that know the beginning of the step.
    pub fn write(&self, controls: &mut Controls<S>) {
        for (valve, position) in &self.taken {
            controls.spool[*valve] = constant(*position);
        }
    }

    /// Write the states of the valves at the end of the step.
    pub fn end(&self, state: &mut [S]) {
        for (first, own) in &self.ends {
            state[*first..first + own.len()].copy_from_slice(own);
        }
    }
}

impl<S: Scalar> Plant<'_, S> {
    /// When valves switch in a step that begins at a time [s] with a state and lasts for some time
    /// [s].
    pub(crate) fn switches(
        &self,
        state: &[S],
        controls: &Controls<S>,
        time: f64,
        step: f64,
        out: &mut Switches<S>,
    ) {
        let Switches { each, taken, ends } = out;
        each.clear();
        taken.clear();
        ends.clear();
        let ports = &self.wiring.ports;
        for (valve, acting) in ports.switching.iter().enumerate() {
            let Some(acting) = acting else { continue };
            let now = controls.spool[valve];
            let edge = controls.edges.get(valve).filter(|edge| edge.changes());
            let change = edge.map(|edge| edge.share_before * step);
            let input = |age: f64| {
                let seen = match edge {
                    Some(edge) if age < edge.share_before.re() * step => edge.before,
                    _ => now,
                };
                ports.command[valve].iter().fold(seen, |x, acting| {
                    self.effect(acting).position(self.own(acting, state), x, age)
                })
            };
            let mut own = self.own(acting, state).to_vec();
            let mut tell = |after, position| each.push(Switch { after, valve, position });
            self.effect(acting).switched_to(&mut own, &input, change, (time, step), &mut tell);
            ends.push((self.layout.effect(acting.first), own));
        }
        each.sort_by(|a, b| a.after.re().total_cmp(&b.after.re()));
    }
}
