//! The arm with the effects that act on it: torques of their own, another payload, a cord, a base
//! that gives way.

use crate::dual::Slope;

use super::body::Body;
use super::muscle_force::air_stiffness;
use super::ports::{Acting, Place};
use super::rates::{Plant, Scratch};
use super::units::{BodyUnit, Group};
use crate::description::dotted;
use crate::effects::{Cord, Extremes};
use crate::error::check_range;
use crate::muscle::slip::STUCK;
use crate::muscle::spec::check_softened;
use crate::scalar::{constant, Scalar};
use crate::{Error, Result};
use std::borrow::Cow;

/// Points of a range at which its largest moment arm is looked for, less one.
const ARM_POINTS: u32 = 16;

impl<S: Scalar> Plant<'_, S> {
    /// Accelerations of the coordinates and of what effects move beside them.
    #[inline(never)]
    pub(super) fn altered_motion(
        &self,
        state: &[S],
        time: f64,
        here: &mut Scratch<S>,
        out: &mut [S],
    ) {
        let (layout, ports) = (&self.layout, &self.wiring.ports);
        let (angles, rates) = state[layout.angle(0)..layout.effect(0)].split_at(layout.coordinates);
        let [pose, turn, load, column] = &mut here.arm;
        pose.copy_from_slice(angles);
        turn.copy_from_slice(rates);
        load.copy_from_slice(&here.torque);
        for (k, load) in load.iter_mut().enumerate() {
            *load = self.joint_torque(k, *load, state, here.load[k]);
        }
        let reaction = ports.mounting.as_ref().map(|acting| {
            let own = self.own(acting, state);
            pose[0] += own[0];
            turn[0] += own[1];
            // Friction and stops belong to the joint, whatever the base does.
            let joint = self.body.passive(0, angles[0], rates[0]);
            let exchanged = load[0] + joint;
            load[0] += joint - self.body.passive(0, pose[0], turn[0]);
            self.effect(acting).mounting(own, exchanged)
        });
        for (load, push) in load.iter_mut().zip(&ports.push) {
            for acting in push {
                *load += self.effect(acting).push(time);
            }
        }
        let body = self.carrying(time);
        let mut direction = body.base_angle();
        for (k, weight) in ports.weight.iter().enumerate() {
            direction += pose[k];
            for acting in weight {
                let torque = self.effect(acting).weight(direction, body.level_weight(k));
                load[..=k].iter_mut().for_each(|load| *load += torque);
            }
        }
        let accelerations = layout.rate(0)..layout.effect(0);
        body.accelerations(pose, turn, load, &mut out[accelerations.clone()]);
        if let Some((link, acting)) = &ports.hanging {
            let gravity = body.gravity();
            if let Some(cord) = self.effect(acting).cord(gravity, self.own(acting, state)) {
                let mass = self.effect(acting).hanging() * self.payload(*link, time);
                let moving = [pose, turn, column];
                let felt =
                    hang(&body, *link, &cord, mass, gravity, moving, &mut out[accelerations]);
                let rates = [self.own(acting, state)[1], cord.acceleration(felt)];
                self.own_mut(acting, out).copy_from_slice(&rates);
            }
        }
        if let (Some(acting), Some(acceleration)) = (&ports.mounting, reaction) {
            out[layout.rate(0)] -= acceleration;
            let rates = [self.own(acting, state)[1], acceleration];
            self.own_mut(acting, out).copy_from_slice(&rates);
        }
    }

    /// Torque of a joint with those of the effects on it [N m].
    #[inline]
    fn joint_torque(&self, coordinate: usize, load: S, state: &[S], pulled: S) -> S {
        let here = &self.wiring.ports.torque[coordinate];
        if here.is_empty() {
            return load;
        }
        let at = self.at_joint(coordinate, state, pulled);
        here.iter().fold(load, |load, acting| {
            load + self.effect(acting).torque(&at, self.own(acting, state))
        })
    }

    /// Payload at the end of a link [kg] (the mass of a linear load) at a time [s].
    fn payload(&self, link: usize, time: f64) -> S {
        let changes = self.wiring.ports.payload.iter().filter(|(changed, _)| *changed == link);
        changes.fold(self.body.payload(link), |payload, (_, acting)| {
            payload + self.effect(acting).payload(time)
        })
    }

    /// The body with the payloads that its links carry rigidly at a time [s].
    fn carrying(&self, time: f64) -> Cow<'_, Body<S>> {
        let ports = &self.wiring.ports;
        let mut body = Cow::Borrowed(&self.body);
        for (link, _) in &ports.payload {
            body = Cow::Owned(body.with_payload(*link, self.payload(*link, time)));
        }
        if let Some((link, acting)) = &ports.hanging {
            let rigid = self.payload(*link, time) * (-self.effect(acting).hanging() + 1.0);
            body = Cow::Owned(body.with_payload(*link, rigid));
        }
        body
    }
}

/// Hang a mass on the end of a link: correct the accelerations of the body for its pull. What the
/// cord's upper end feels [m/s2].
fn hang<S: Scalar>(
    body: &Body<S>,
    link: usize,
    cord: &Cord<S>,
    mass: S,
    gravity: f64,
    [pose, turn, column]: [&mut Vec<S>; 3],
    out: &mut [S],
) -> [S; 2] {
    let (sides, own) = body.end(link, pose, turn);
    let along = |v: &[S; 2]| v[0] * cord.along[0] + v[1] * cord.along[1];
    // The pull is linear in the accelerations: mass (column . q'') column on the left, the rest on
    // the right.
    let steady = along(&[own[0], own[1] + gravity]) - cord.centripetal;
    for (entry, side) in column.iter_mut().zip(&sides) {
        let across = side[0] * cord.across[0] + side[1] * cord.across[1];
        *entry = mass * (across * cord.damping - along(side) * steady);
    }
    let (direct, unit) = (body.response(pose, column), sides.iter().map(along).collect::<Vec<S>>());
    let answer = body.response(pose, &unit);
    let zero = constant::<S>(0.0);
    let (mut moved, mut mobility) = (zero, zero);
    for k in 0..out.len() {
        out[k] += direct[k];
        moved += unit[k] * out[k];
        mobility += unit[k] * answer[k];
    }
    let share = mass * moved / (mass * mobility + 1.0);
    let mut felt = [own[0], own[1] + gravity];
    for k in 0..out.len() {
        out[k] -= answer[k] * share;
        felt[0] += sides[k][0] * out[k];
        felt[1] += sides[k][1] * out[k];
    }
    felt
}

impl Plant<'_, f64> {
    /// Refuse masses that are not possible: an arm without inertia, more taken away from a payload
    /// than is there.
    ///
    /// # Errors
    /// [`Error::Parameter`] that names what is too small.
    pub(crate) fn check_masses(&self) -> Result<()> {
        let wiring = &self.wiring;
        if let BodyUnit::OneLink { inertia, payload, length, .. } = &wiring.body {
            let total = self.values[*inertia] + self.values[*payload] * length.powi(2);
            check_range("arm.inertia + payload length^2", total, 1e-9, 1e9, "kg m2")?;
        }
        let least = if matches!(wiring.body, BodyUnit::Mass { .. }) { 1e-6 } else { 0.0 };
        for (link, acting) in &wiring.ports.payload {
            let now = self.body.payload(*link);
            let changes = wiring.ports.payload.iter().filter(|(changed, _)| changed == link);
            let taken: f64 =
                changes.map(|(_, a)| self.effect(a).payload(f64::INFINITY).min(0.0)).sum();
            if now + taken < least {
                let effect = &wiring.ports.effects[acting.effect];
                let name = format!("{}.{}", effect.name, effect.form.parameters[0].name);
                let allowed =
                    format!("at least {} kg: no more can be taken away than is there", least - now);
                return Err(Error::parameter(
                    name,
                    self.effect(acting).payload(f64::INFINITY),
                    allowed,
                ));
            }
        }
        Ok(())
    }

    /// Refuse muscles that are softer than nothing at their temperature.
    ///
    /// # Errors
    /// [`Error::Parameter`] that names what their moduli are made of.
    pub(crate) fn check_moduli(&self) -> Result<()> {
        for (group, spec) in self.wiring.groups.iter().zip(&self.rig.spec.muscles) {
            let [softening, temperature] =
                [group.softening, group.temperature].map(|id| self.values[id]);
            let reference = group.reference_temperature;
            check_softened(&dotted("muscle", &spec.name), softening, temperature, reference)?;
        }
        Ok(())
    }

    /// Fastest rate of the body [1/s], and of what effects move beside it.
    pub(crate) fn fastest_body(&self) -> f64 {
        let (wiring, ports) = (&self.wiring, &self.wiring.ports);
        let spring = |k| {
            let (damping, stiffness) = self.resistance(k);
            (damping, stiffness + self.stiffness(k))
        };
        let mut loads: Vec<(f64, f64)> = (0..wiring.coordinates.len()).map(spring).collect();
        loads.resize(wiring.coordinates.len().max(1), (0.0, 0.0));
        let mounting = ports.mounting.as_ref().map(|acting| self.effect(acting));
        let (mobility, own) = mounting.map_or((0.0, 0.0), |base| (base.mobility(), base.fastest()));
        let mut bodies = vec![self.carrying(f64::NEG_INFINITY)];
        if !ports.payload.is_empty() {
            bodies.push(self.carrying(f64::INFINITY));
        }
        let body = |b: &Cow<'_, Body<f64>>| b.fastest(&loads, mobility);
        let mut fastest = bodies.iter().map(body).fold(own, f64::max);
        if let Some((link, acting)) = &ports.hanging {
            let effect = self.effect(acting);
            let heaviest =
                self.payload(*link, f64::NEG_INFINITY).max(self.payload(*link, f64::INFINITY));
            let ratio =
                |b: &Cow<'_, Body<f64>>| effect.hanging() * heaviest * b.end_mobility(*link);
            let ratio = bodies.iter().map(ratio).fold(0.0, f64::max);
            fastest = fastest.max(effect.swing_rate(self.body.gravity(), ratio));
        }
        fastest
            .max(self.fastest_effect(|place| matches!(place, Place::Group(_) | Place::Joint(_))))
            .max(self.fastest_give())
    }

    /// Fastest rate of what gives between a muscle and its load, and of what else remembers there
    /// [1/s].
    pub(crate) fn fastest_give(&self) -> f64 {
        let muscles = self.wiring.ports.muscles.iter().enumerate();
        let rate = |k: usize, give: &Acting| {
            let effect = self.effect(give);
            let own = effect.fastest() * (1.0 + self.further_stiffness(k) * effect.mobility());
            own.max(self.fastest_effect(|place| place == Place::Group(k)))
        };
        let rates = muscles.filter_map(|(k, m)| m.give.as_ref().map(|give| rate(k, give)));
        rates.fold(0.0, f64::max)
    }

    /// Largest stiffness that friction and contacts add to one muscle of a group [N/m] at the highest
    /// pressure.
    fn further_stiffness(&self, k: usize) -> f64 {
        let group = &self.wiring.groups[k];
        let gauge = self.rig.highest_pressure() - self.rig.gas.ambient_pressure;
        let (low, high) = self.rig.range(group);
        let high = group.muscle.table.e_max.min(high + 0.5 * (high - low)); // it is shorter
        let friction = |i: u32| {
            let e = low + (high - low) * f64::from(i) / f64::from(ARM_POINTS);
            let pull = group.muscle.pull(&group.muscle.table.eval(e), gauge, e, 1.0);
            self.presliding_stiffness(k, group, pull.abs(), gauge)
        };
        let most = self.reach((0.0, 0.0), high);
        let (_, contact) = self.summed(&self.wiring.ports.muscles[k].force, &most);
        (0..=ARM_POINTS).map(friction).fold(0.0, f64::max) + contact / group.rest_length
    }

    /// Largest stiffness [N m/rad] of what pulls on a coordinate, over its range, at the highest
    /// pressure.
    fn stiffness(&self, coordinate: usize) -> f64 {
        let wiring = &self.wiring;
        let pressure = self.rig.highest_pressure();
        let gauge = pressure - self.rig.gas.ambient_pressure;
        let mut total = 0.0;
        for (k, group) in
            wiring.groups.iter().enumerate().filter(|(_, g)| g.coordinate == coordinate)
        {
            let (low, high) = self.rig.angles(group);
            let mut most = 0.0_f64;
            for i in 0..=32 {
                let angle = Slope::new(low + (high - low) * f64::from(i) / 32.0, 1.0);
                let point = group.joint.eval(angle);
                let contraction = point.shortening / group.rest_length;
                let table = group.muscle.table.eval(contraction);
                let pull = |scale: f64| {
                    let (gauge, scale) = (Slope::from(gauge), Slope::from(scale));
                    group.muscle.pull(&table, gauge, contraction, scale)
                };
                let torque = pull(self.scales[k]) * point.torque_arm;
                let arm = point.moment_arm.re.abs();
                let volume = (self.fixed_volume[group.chamber]
                    + table.volume.re.max(0.0) * group.count)
                    .max(f64::MIN_POSITIVE);
                let swept = table.volume_slope.re * arm * group.count / group.rest_length;
                let alpha = self.alphas[group.chamber].volume;
                let air = air_stiffness(alpha, pressure, swept, volume);
                let friction = self.presliding_stiffness(k, group, pull(1.0).re.abs(), gauge);
                most = most.max(group.count * (torque.slope().abs() + friction * arm * arm) + air);
            }
            total += most;
        }
        total
    }

    /// Stiffness of one muscle's friction before it slips [N/m]: every element of the bank still
    /// sticks.
    fn presliding_stiffness(&self, k: usize, group: &Group, force: f64, gauge: f64) -> f64 {
        let mut total = 0.0;
        if group.direction {
            let spec = &group.muscle.exact.spec;
            let width =
                spec.friction_coefficient.abs() + (spec.friction_pressure_slope * gauge).abs();
            total += width.max(spec.friction_floor) * force * STUCK / group.muscle.presliding();
        }
        for acting in &self.wiring.ports.muscles[k].force {
            total += self.effect(acting).presliding(gauge, force);
        }
        total
    }

    /// Damping and stiffness that effects add to a coordinate at most, those on its muscles
    /// included.
    fn resistance(&self, coordinate: usize) -> (f64, f64) {
        let wiring = &self.wiring;
        let stops = wiring.coordinates[coordinate].stops;
        let angles = stops.map_or((0.0, 0.0), |s| (s.min_angle, s.max_angle));
        let torque = &wiring.ports.torque[coordinate];
        let load = if torque.is_empty() { 0.0 } else { self.largest_load(coordinate) };
        let most = Extremes { load, ..self.reach(angles, 0.0) };
        let (mut damping, mut stiffness) = self.summed(torque, &most);
        for (k, group) in
            wiring.groups.iter().enumerate().filter(|(_, g)| g.coordinate == coordinate)
        {
            let (low, high) = self.rig.angles(group);
            let share = |i: u32| low + (high - low) * f64::from(i) / f64::from(ARM_POINTS);
            let points = (0..=ARM_POINTS).map(|i| group.joint.eval(share(i)));
            let (arm, contracted) = points.fold((0.0_f64, 0.0_f64), |(arm, contracted), point| {
                (
                    arm.max(point.moment_arm.abs()),
                    contracted.max(point.shortening / group.rest_length),
                )
            });
            let side = group.count * arm * arm;
            let most = self.reach(angles, contracted);
            let (rubbing, contact) = self.summed(&wiring.ports.muscles[k].force, &most);
            damping += rubbing * side;
            stiffness += contact / group.rest_length * side;
        }
        (damping, stiffness)
    }

    /// Largest torques [N m] that the muscles put on a coordinate over its range, at the highest
    /// pressure, all counted as positive.
    fn largest_load(&self, coordinate: usize) -> f64 {
        let gauge = self.rig.highest_pressure() - self.rig.gas.ambient_pressure;
        let groups = self.wiring.groups.iter().enumerate();
        let load = |(k, group): (usize, &Group)| {
            let (low, high) = self.rig.angles(group);
            let at = |i: u32| {
                let angle = low + (high - low) * f64::from(i) / f64::from(ARM_POINTS);
                let point = group.joint.eval(angle);
                let contraction = point.shortening / group.rest_length;
                let table = group.muscle.table.eval(contraction);
                let pull = group.muscle.pull(&table, gauge, contraction, self.scales[k]);
                (pull * point.torque_arm * group.count).abs()
            };
            (0..=ARM_POINTS).map(at).fold(0.0, f64::max)
        };
        groups.filter(|(_, group)| group.coordinate == coordinate).map(load).sum()
    }

    fn summed(&self, acting: &[Acting], most: &Extremes) -> (f64, f64) {
        acting
            .iter()
            .map(|acting| self.effect(acting).resistance(most))
            .fold((0.0, 0.0), |sum, here| (sum.0 + here.0, sum.1 + here.1))
    }

    /// Extremes of a joint or of a muscle on it.
    fn reach(&self, angles: (f64, f64), contraction: f64) -> Extremes {
        let (pressure, ambient) = (self.rig.highest_pressure(), self.rig.gas.ambient_pressure);
        Extremes { pressure, ambient, angles, contraction, valves: 0, load: 0.0 }
    }
}
