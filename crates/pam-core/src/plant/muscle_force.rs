//! What the muscles pull, with what they remember and what effects make of it.

use super::memory::Memory;
use super::rates::{Controls, Plant, Scratch};
use super::units::Group;
use crate::blocks::joint::JointPoint;
use crate::effects::{
    activation_pressure, mullins_softening, muscle_creep, muscle_hysteresis, muscle_rate_damping,
    pam_crowding_contact,
};
use crate::muscle::TablePoint;
use crate::scalar::{constant, Scalar};

/// One group at one instant.
pub(super) struct Pull<S> {
    pub contraction: S,
    /// Of all its muscles [N].
    pub force: S,
    pub moment_arm: S,
    pub torque_arm: S,
    pub table: TablePoint<S>,
}

impl<S: Scalar> Plant<'_, S> {
    #[inline(always)]
    pub(super) fn pull(&self, k: usize, group: &Group, state: &[S], memory: &Memory<S>, start: S) -> Pull<S> {
        let point = group.joint.eval(state[self.layout.angle(group.coordinate)]);
        let contraction = point.shortening / group.rest_length;
        let table = group.muscle.table.eval(contraction);
        let gauge = state[self.layout.pressure(group.chamber)] - self.rig.gas.ambient_pressure;
        let scale = self.scales[k];
        let force = if group.effects.some {
            self.altered_force(k, group, state, memory, start, &point, &table)
        } else {
            let force = table.force(gauge, scale);
            self.directed(group, memory, start, contraction, gauge, scale, force)
        };
        Pull {
            contraction,
            force: force * group.count,
            moment_arm: point.moment_arm,
            torque_arm: point.torque_arm,
            table,
        }
    }

    /// The force of one muscle for the way in which it has been moving.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn directed(
        &self,
        group: &Group,
        memory: &Memory<S>,
        start: S,
        contraction: S,
        gauge: S,
        scale: S,
        force: S,
    ) -> S {
        if !group.direction {
            return force;
        }
        let stretched = (start - contraction) * group.rest_length;
        let slip = memory.direction.moved(stretched, constant(group.muscle.presliding()));
        group.muscle.moving(force, contraction, gauge, scale, slip.mean())
    }

    /// Force of one muscle with the effects on its group.
    #[inline(never)]
    #[allow(clippy::too_many_arguments)]
    fn altered_force(
        &self,
        k: usize,
        group: &Group,
        state: &[S],
        memory: &Memory<S>,
        start: S,
        point: &JointPoint<S>,
        table: &TablePoint<S>,
    ) -> S {
        let (here, units, values) = (&group.effects, &self.rig.wiring.effects, &self.values);
        let (contraction, scale) = (point.shortening / group.rest_length, self.scales[k]);
        let mut gauge = state[self.layout.pressure(group.chamber)] - self.rig.gas.ambient_pressure;
        if let (true, Some([threshold])) = (here.activation, units.activation) {
            gauge = activation_pressure::effective(gauge, values[threshold]);
        }
        let mut force = table.force(gauge, scale);
        if let (true, Some([softening, width])) = (here.softening, units.softening) {
            let bladder = scale * (gauge * table.a_elastic + table.b_elastic);
            let (softening, width) = (values[softening], values[width]);
            force += mullins_softening::change(softening, width, bladder, contraction, memory.largest);
        }
        force = self.directed(group, memory, start, contraction, gauge, scale, force);
        if let (true, Some([friction, pressure, presliding])) = (here.hysteresis, units.hysteresis) {
            let stretched = (start - contraction) * group.rest_length;
            let slip = memory.hysteresis.moved(stretched, values[presliding]);
            force += muscle_hysteresis::force(&slip, values[friction], values[pressure], gauge);
        }
        if let (Some(damper), Some([stiffness, _])) = (here.creep, units.creep) {
            let damper = state[self.layout.extra(damper)];
            force += muscle_creep::force(values[stiffness], length(group, point.shortening), damper);
        }
        let rate = -(point.moment_arm * state[self.layout.rate(group.coordinate)]);
        if let (true, Some(damping)) = (here.damping, units.damping) {
            force += muscle_rate_damping::force(damping.map(|id| values[id]), gauge, rate);
        }
        if let (true, Some(contact)) = (here.crowding, units.crowding) {
            force += pam_crowding_contact::force(contact.map(|id| values[id]), gauge, contraction, rate);
        }
        force
    }

    /// Rates of what the effects on the muscles and the closures need; of the rest zero.
    #[inline(never)]
    pub(super) fn extra_rates(&self, state: &[S], controls: &Controls<S>, here: &Scratch<S>, out: &mut [S]) {
        let layout = &self.layout;
        out[layout.extra(0)..layout.states()].fill(constant(0.0));
        self.closure_rates(state, controls, here, out);
        let Some([_, time_constant]) = self.rig.wiring.effects.creep else { return };
        for group in &self.rig.wiring.groups {
            let Some(damper) = group.effects.creep.map(|k| layout.extra(k)) else { continue };
            let shortening = group.joint.eval(state[layout.angle(group.coordinate)]).shortening;
            let time_constant = self.values[time_constant];
            out[damper] = muscle_creep::rate(time_constant, length(group, shortening), state[damper]);
        }
    }

    /// Dampers of creeping muscles at rest.
    pub(super) fn settle_dampers(&self, state: &mut [S]) {
        for group in &self.rig.wiring.groups {
            if let Some(damper) = group.effects.creep {
                let shortening = group.joint.eval(state[self.layout.angle(group.coordinate)]).shortening;
                state[self.layout.extra(damper)] = length(group, shortening);
            }
        }
    }

    /// Contraction ratio of each group at a state.
    pub fn contractions(&self, state: &[S], out: &mut [S]) {
        for (out, group) in out.iter_mut().zip(&self.rig.wiring.groups) {
            *out =
                group.joint.eval(state[self.layout.angle(group.coordinate)]).shortening / group.rest_length;
        }
    }

    /// Memories of muscles that have never been further than in a state.
    pub fn fresh_memory(&self, state: &[S]) -> Vec<Memory<S>> {
        let mut now = vec![constant(0.0); self.rig.wiring.groups.len()];
        self.contractions(state, &mut now);
        let softens = |k: usize| self.rig.wiring.groups[k].effects.softening;
        let memory = |(k, e): (usize, &S)| {
            let largest = if softens(k) { *e } else { constant(0.0) };
            Memory { largest, ..Memory::default() }
        };
        now.iter().enumerate().map(memory).collect()
    }

    /// Memories after a step that moved the muscles between contraction ratios.
    pub fn advance_memory(&self, memory: &mut [Memory<S>], from: &[S], to: &[S]) {
        for (k, group) in self.rig.wiring.groups.iter().enumerate() {
            let stretched = (from[k] - to[k]) * group.rest_length;
            if group.direction {
                memory[k].direction =
                    memory[k].direction.moved(stretched, constant(group.muscle.presliding()));
            }
            if let (true, Some([.., presliding])) =
                (group.effects.hysteresis, self.rig.wiring.effects.hysteresis)
            {
                memory[k].hysteresis = memory[k].hysteresis.moved(stretched, self.values[presliding]);
            }
            if group.effects.softening && to[k].re() > memory[k].largest.re() {
                memory[k].largest = to[k];
            }
        }
    }

    /// Whether any muscle remembers its motion.
    pub fn remembers(&self) -> bool {
        let remembers = |g: &Group| g.direction || g.effects.hysteresis || g.effects.softening;
        self.rig.wiring.groups.iter().any(remembers)
    }
}

/// Length of a group's muscles [m].
fn length<S: Scalar>(group: &Group, shortening: S) -> S {
    -shortening + group.rest_length
}
