//! What the muscles pull, with what they remember and what effects make of it.

use super::memory::Memory;
use super::ports::Acting;
use super::rates::{Plant, Scratch};
use super::units::Group;
use crate::blocks::joint::JointPoint;
use crate::effects::{At, AtMuscle};
use crate::muscle::TablePoint;
use crate::scalar::{constant, Scalar};

/// How long and wide the muscles of a group are at one instant.
pub(super) struct MuscleShape<S> {
    pub point: JointPoint<S>,
    pub contraction: S,
    pub table: TablePoint<S>,
}

/// Contraction ratios between which a stiffness is taken.
const NEAR: f64 = 1e-4;

/// Stiffness of a gas against a motion that sweeps so much of its volume: [N/m] for [m2], [N m/rad]
/// for [m3/rad].
pub(super) fn air_stiffness<S: Scalar>(alpha: S, pressure: S, swept: S, volume: S) -> S {
    alpha * pressure * swept * swept / volume
}

/// Write down what an effect with states acts on [N], where its first state stands.
#[inline]
fn feel<S: Scalar>(acting: &Acting, force: S, felt: &mut [S]) {
    if acting.count > 0 {
        felt[acting.first] = force;
    }
}

impl<S: Scalar> Plant<'_, S> {
    #[inline(always)]
    pub(super) fn muscle_shape(&self, k: usize, group: &Group, state: &[S]) -> MuscleShape<S> {
        let point = group.joint.eval(state[self.layout.angle(group.coordinate)]);
        let contraction = self.shortening(k, &point, state) / group.rest_length;
        MuscleShape { point, contraction, table: group.muscle.table.eval(contraction) }
    }

    /// Shortening of the muscles of a group [m]: by the motion of their load, and by what gives.
    #[inline(always)]
    fn shortening(&self, k: usize, point: &JointPoint<S>, state: &[S]) -> S {
        match &self.wiring.ports.muscles[k].give {
            Some(acting) if self.altered.gives => point.shortening + self.own(acting, state)[0],
            _ => point.shortening,
        }
    }

    /// Contraction ratio of a group at a state.
    pub(crate) fn contraction(&self, k: usize, state: &[S]) -> S {
        let group = &self.wiring.groups[k];
        let point = group.joint.eval(state[self.layout.angle(group.coordinate)]);
        self.shortening(k, &point, state) / group.rest_length
    }

    /// The same without its derivatives, which nothing works out.
    pub(crate) fn contraction_now(&self, k: usize, state: &[S]) -> f64 {
        let group = &self.wiring.groups[k];
        let angle = state[self.layout.angle(group.coordinate)].re();
        let give = self.wiring.ports.muscles[k].give.as_ref();
        let given = give.map_or(0.0, |acting| self.own(acting, state)[0].re());
        (group.joint.eval(angle).shortening + given) / group.rest_length
    }

    /// Rate [m/s] at which gives what is between the muscles of a group and their load, under the
    /// force of all of them [N].
    pub(super) fn give_rate(&self, k: usize, state: &[S], force: S, here: &mut Scratch<S>) -> S {
        let mut rate = [constant(0.0)];
        if let Some(acting) = &self.wiring.ports.muscles[k].give {
            feel(acting, force / self.wiring.groups[k].count, &mut here.felt);
            let at = At::Muscle(self.at_felt(k, acting, state, &here.felt));
            self.effect(acting).rates(&at, self.own(acting, state), &mut rate);
        }
        rate[0]
    }

    /// Force of all muscles of a group [N]; what effects with states act on is written to `felt`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub(super) fn muscle_force(
        &self,
        k: usize,
        group: &Group,
        state: &[S],
        memory: &Memory<S>,
        start: S,
        shape: &MuscleShape<S>,
        felt: &mut [S],
    ) -> S {
        let MuscleShape { point, contraction, table } = shape;
        let gauge = state[self.layout.pressure(group.chamber)] - self.rig.gas.ambient_pressure;
        let scale = self.scales[k];
        let force = if self.altered.muscles && self.wiring.ports.muscles[k].some {
            self.altered_force(k, group, state, memory, start, point, table, felt)
        } else {
            let force = group.muscle.pull(table, gauge, *contraction, scale);
            self.directed(group, memory, start, *contraction, gauge, scale, force)
        };
        group.muscle.buckled(force) * group.count
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
        felt: &mut [S],
    ) -> S {
        let here = &self.wiring.ports.muscles[k];
        let scale = self.scales[k];
        let mut at = self.at_muscle(k, group, state, point);
        at.stretched = (start - at.contraction) * group.rest_length;
        for acting in &here.gauge {
            at.gauge = self.effect(acting).gauge(at.gauge);
        }
        let mut force = group.muscle.pull(table, at.gauge, at.contraction, scale);
        for acting in &here.bladder {
            let bladder = group.muscle.bladder(table, at.gauge, at.contraction, scale);
            feel(acting, bladder, felt);
            force += self.effect(acting).bladder(self.own(acting, state), bladder, at.contraction);
        }
        force = self.directed(group, memory, start, at.contraction, at.gauge, scale, force);
        for acting in &here.force {
            at.force = force;
            feel(acting, force, felt);
            force += self.effect(acting).force(&at, self.own(acting, state));
        }
        force
    }

    /// What effects see of a group of muscles that have not moved since the step began.
    fn at_muscle(
        &self,
        k: usize,
        group: &Group,
        state: &[S],
        point: &JointPoint<S>,
    ) -> AtMuscle<S> {
        let shortening = self.shortening(k, point, state);
        AtMuscle {
            gauge: state[self.layout.pressure(group.chamber)] - self.rig.gas.ambient_pressure,
            contraction: shortening / group.rest_length,
            length: -shortening + group.rest_length,
            rate: -(point.moment_arm * state[self.layout.rate(group.coordinate)]),
            stretched: constant(0.0),
            force: constant(0.0),
            stiffness: constant(0.0),
        }
    }

    /// The same for a group by its number.
    fn at_group(&self, k: usize, state: &[S]) -> AtMuscle<S> {
        let group = &self.wiring.groups[k];
        let point = group.joint.eval(state[self.layout.angle(group.coordinate)]);
        self.at_muscle(k, group, state, &point)
    }

    /// The same for an effect with states, with the force that was written down for it.
    pub(super) fn at_felt(
        &self,
        k: usize,
        acting: &Acting,
        state: &[S],
        felt: &[S],
    ) -> AtMuscle<S> {
        let force = felt.get(acting.first).copied().unwrap_or(constant(0.0));
        let stiffness = match &self.wiring.ports.muscles[k].give {
            Some(give) if give.effect == acting.effect => self.stiffness_with_air(k, state),
            _ => constant(0.0),
        };
        AtMuscle { force, stiffness, ..self.at_group(k, state) }
    }

    /// Stiffness of one muscle of a group with its air [N/m].
    fn stiffness_with_air(&self, k: usize, state: &[S]) -> S {
        let group = &self.wiring.groups[k];
        let (muscle, e) = (&group.muscle, self.contraction(k, state));
        let pressure = state[self.layout.pressure(group.chamber)];
        let gauge = pressure - self.rig.gas.ambient_pressure;
        let pull = |e: S| muscle.pull(&muscle.table.eval(e), gauge, e, self.scales[k]);
        let fall = (pull(e - NEAR) - pull(e)) / (NEAR * group.rest_length);
        let of_muscle = if fall.re() > 0.0 { fall } else { constant(0.0) };
        let swept = muscle.table.eval(e).volume_slope * group.count / group.rest_length;
        let (alpha, volume) =
            (self.alphas[group.chamber].volume, self.volume(group.chamber, state));
        of_muscle + air_stiffness(alpha, pressure, swept, volume) / group.count
    }

    /// Contraction ratio of each group at a state.
    pub fn contractions(&self, state: &[S], out: &mut [S]) {
        for (k, out) in (0..self.wiring.groups.len()).zip(out) {
            *out = self.contraction(k, state);
        }
    }

    /// Memories of muscles that have not moved.
    pub fn fresh_memory(&self) -> Vec<Memory<S>> {
        vec![Memory::default(); self.wiring.groups.len()]
    }

    /// Memories, and the states of effects that follow the muscles, after a step that moved these
    /// between contraction ratios.
    pub fn follow_muscles(&self, state: &mut [S], memory: &mut [Memory<S>], from: &[S], to: &[S]) {
        for (k, group) in self.wiring.groups.iter().enumerate() {
            if group.direction {
                let stretched = (from[k] - to[k]) * group.rest_length;
                memory[k].direction =
                    memory[k].direction.moved(stretched, constant(group.muscle.presliding()));
            }
        }
        for (k, acting) in self.wiring.ports.follow_muscles() {
            let rest = self.wiring.groups[k].rest_length;
            self.effect(&acting).moved(self.own_mut(&acting, state), from[k], to[k], rest);
        }
    }

    /// Whether any muscle remembers its motion.
    pub fn remembers(&self) -> bool {
        let wiring = &self.wiring;
        wiring.groups.iter().any(|g| g.direction) || wiring.ports.follow_muscles().next().is_some()
    }
}
