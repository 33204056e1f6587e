//! The arm with the effects that act on it: torques of their own, another payload, a cord, a base that gives way.

use num_dual::Dual64;

use super::body::Body;
use super::rates::{Plant, Scratch};
use super::units::Group;
use crate::effects::payload_swing::Cord;
use crate::effects::{
    base_flexibility, external_torque, joint_coulomb_stribeck, joint_end_stop, muscle_rate_damping,
    pam_crowding_contact, payload_change, payload_swing,
};
use crate::scalar::{constant, Scalar};
use std::borrow::Cow;

/// Slope of the mean of a bank of slip elements where all of them stick, times the presliding distance.
const BANK: f64 = 3.75;

impl<S: Scalar> Plant<'_, S> {
    /// Accelerations of the coordinates and of what effects move beside them.
    #[inline(never)]
    pub(super) fn altered_motion(&self, state: &[S], time: f64, here: &mut Scratch<S>, out: &mut [S]) {
        let (layout, wiring, values) = (&self.layout, &self.rig.wiring, &self.values);
        let units = &wiring.effects;
        let (angles, rates) = state[layout.angle(0)..layout.extra(0)].split_at(layout.coordinates);
        let [pose, turn, load, column] = &mut here.arm;
        pose.copy_from_slice(angles);
        turn.copy_from_slice(rates);
        load.copy_from_slice(&here.torque);
        for (k, coordinate) in wiring.coordinates.iter().enumerate() {
            if let (true, Some([stiction, speed])) = (coordinate.effects.stribeck, units.stribeck) {
                load[k] -= joint_coulomb_stribeck::torque(values[stiction], values[speed], rates[k]);
            }
            if let (true, Some(stop)) = (coordinate.effects.stop, units.stop) {
                load[k] += joint_end_stop::torque(stop.map(|id| values[id]), angles[k], rates[k]);
            }
            if coordinate.effects.closure.is_some() {
                load[k] += self.closing_torque(k, state);
            }
        }
        let base = wiring.arm_effects.base.zip(units.base);
        let reaction = base.map(|(place, ids)| {
            let (q, rate) = (state[layout.extra(place)], state[layout.extra(place) + 1]);
            pose[0] += q;
            turn[0] += rate;
            // Friction and stops belong to the joint, whatever the base does.
            let joint = self.body.passive(0, angles[0], rates[0]);
            let exchanged = load[0] + joint;
            load[0] += joint - self.body.passive(0, pose[0], turn[0]);
            base_flexibility::acceleration(ids.map(|id| values[id]), q, rate, exchanged)
        });
        if let Some(pulse) = units.torque {
            for (k, coordinate) in wiring.coordinates.iter().enumerate() {
                if coordinate.effects.torque {
                    load[k] += external_torque::torque(pulse.map(|id| values[id]), time);
                }
            }
        }
        let body = self.carrying(time);
        let accelerations = layout.rate(0)..layout.extra(0);
        body.accelerations(pose, turn, load, &mut out[accelerations.clone()]);
        if let (Some((link, place)), Some([share, length, damping])) = (wiring.arm_effects.swing, units.swing)
        {
            let place = layout.extra(place);
            let (phi, rate) = (state[place], state[place + 1]);
            let gravity = body.gravity();
            let cord = Cord::new(values[length], values[damping], gravity, phi, rate);
            let mass = values[share] * self.payload(link, time);
            let felt = hang(&body, link, &cord, mass, gravity, [pose, turn, column], &mut out[accelerations]);
            (out[place], out[place + 1]) = (rate, cord.acceleration(felt));
        }
        if let (Some((place, _)), Some(acceleration)) = (base, reaction) {
            let place = layout.extra(place);
            out[layout.rate(0)] -= acceleration;
            (out[place], out[place + 1]) = (state[place + 1], acceleration);
        }
    }

    /// Payload at the end of a link [kg] (the mass of a linear load) at a time [s].
    fn payload(&self, link: usize, time: f64) -> S {
        let payload = self.body.payload(link);
        match (self.rig.wiring.arm_effects.payload, self.rig.wiring.effects.payload) {
            (Some(changed), Some([mass, moment])) if changed == link => {
                payload + payload_change::change(self.values[mass], self.values[moment], time)
            }
            _ => payload,
        }
    }

    /// The body with the payloads that its links carry rigidly at a time [s].
    fn carrying(&self, time: f64) -> Cow<'_, Body<S>> {
        let effects = &self.rig.wiring.arm_effects;
        let mut body = Cow::Borrowed(&self.body);
        if let Some(link) = effects.payload {
            body = Cow::Owned(body.with_payload(link, self.payload(link, time)));
        }
        if let (Some((link, _)), Some([share, ..])) = (effects.swing, self.rig.wiring.effects.swing) {
            let rigid = self.payload(link, time) * (-self.values[share] + 1.0);
            body = Cow::Owned(body.with_payload(link, rigid));
        }
        body
    }

    /// Cord and base at rest: the one hangs, the other carries the weight of the arm.
    pub(super) fn settle_arm(&self, state: &mut [S]) {
        let (layout, wiring) = (&self.layout, &self.rig.wiring);
        if let (Some(place), Some([compliance, ..])) = (wiring.arm_effects.base, wiring.effects.base) {
            let weight = self.body.weight(&state[layout.angle(0)..layout.rate(0)]);
            state[layout.extra(place)] = -(self.values[compliance] * weight);
        }
    }
}

/// Hang a mass on the end of a link: correct the accelerations of the body for its pull. What the cord's upper end feels [m/s2].
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
    // The pull is linear in the accelerations: mass (column . q'') column on the left, the rest on the right.
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
    /// Fastest rate of the body [1/s], and of what effects move beside it.
    pub(crate) fn fastest_body(&self) -> f64 {
        let (wiring, units) = (&self.rig.wiring, &self.rig.wiring.effects);
        let value = |id| self.values[id];
        let spring = |k| {
            let (damping, stiffness) = self.resistance(k);
            (damping, stiffness + self.stiffness(k))
        };
        let mut loads: Vec<(f64, f64)> = (0..wiring.coordinates.len()).map(spring).collect();
        loads.resize(wiring.coordinates.len().max(1), (0.0, 0.0));
        let base = units.base.map_or((0.0, 0.0), |ids| base_flexibility::mobility(ids.map(value)));
        let mut bodies = vec![self.carrying(f64::NEG_INFINITY)];
        if units.payload.is_some() {
            bodies.push(self.carrying(f64::INFINITY));
        }
        let body = |b: &Cow<'_, Body<f64>>| b.fastest(&loads, base.0);
        let mut fastest = bodies.iter().map(body).fold(base.1, f64::max);
        if let (Some((link, _)), Some([share, length, _])) = (wiring.arm_effects.swing, units.swing) {
            let heaviest = self.payload(link, f64::NEG_INFINITY).max(self.payload(link, f64::INFINITY));
            let ratio =
                bodies.iter().map(|b| value(share) * heaviest * b.end_mobility(link)).fold(0.0, f64::max);
            fastest = fastest.max(payload_swing::fastest(value(length), self.body.gravity(), ratio));
        }
        if let Some([_, time_constant]) = units.creep {
            fastest = fastest.max(1.0 / value(time_constant));
        }
        fastest.max(self.closure_memory())
    }

    /// Largest stiffness [N m/rad] of what pulls on a coordinate, over its range, at the highest pressure.
    fn stiffness(&self, coordinate: usize) -> f64 {
        let wiring = &self.rig.wiring;
        let pressure = self.rig.highest_pressure();
        let gauge = pressure - self.rig.gas.ambient_pressure;
        let mut total = 0.0;
        for (k, group) in wiring.groups.iter().enumerate().filter(|(_, g)| g.coordinate == coordinate) {
            let (low, high) = self.rig.angles(group);
            let mut most = 0.0_f64;
            for i in 0..=32 {
                let angle = Dual64::new(low + (high - low) * f64::from(i) / 32.0, 1.0);
                let point = group.joint.eval(angle);
                let table = group.muscle.table.eval(point.shortening / group.rest_length);
                let torque =
                    table.force(Dual64::from(gauge), Dual64::from(self.scales[k])) * point.torque_arm;
                let arm = point.moment_arm.re.abs();
                let volume = (self.fixed_volume[group.chamber] + table.volume.re.max(0.0) * group.count)
                    .max(f64::MIN_POSITIVE);
                let swept = table.volume_slope.re * arm * group.count / group.rest_length;
                let air = self.alphas[group.chamber].volume * pressure * swept * swept / volume;
                let friction = self.presliding_stiffness(
                    group,
                    table.force(Dual64::from(gauge), Dual64::from(1.0)).re.abs(),
                    gauge,
                );
                most = most.max(group.count * (torque.eps.abs() + friction * arm * arm) + air);
            }
            total += most;
        }
        total
    }

    /// Stiffness of one muscle's friction before it slips [N/m]: every element of the bank still sticks.
    fn presliding_stiffness(&self, group: &Group, force: f64, gauge: f64) -> f64 {
        let mut total = 0.0;
        if group.direction {
            let spec = &group.muscle.exact.spec;
            let width = spec.friction_coefficient.abs() + (spec.friction_pressure_slope * gauge).abs();
            total += width.max(spec.friction_floor) * force * BANK / group.muscle.presliding();
        }
        if let (true, Some([constant, slope, presliding])) =
            (group.effects.hysteresis, self.rig.wiring.effects.hysteresis)
        {
            total += (self.values[constant] + self.values[slope] * gauge) * BANK / self.values[presliding];
        }
        total
    }

    /// Damping and stiffness that effects add to a coordinate at most.
    fn resistance(&self, coordinate: usize) -> (f64, f64) {
        let (wiring, units) = (&self.rig.wiring, &self.rig.wiring.effects);
        let value = |id| self.values[id];
        let own = &wiring.coordinates[coordinate].effects;
        let (mut damping, mut stiffness) = self.closure_resistance(coordinate);
        if let (true, Some([stiction, speed])) = (own.stribeck, units.stribeck) {
            damping += joint_coulomb_stribeck::steepest(value(stiction), value(speed));
        }
        if let (true, Some([k, angle, dissipation, exponent, side])) = (own.stop, units.stop) {
            let (low, high) =
                wiring.coordinates[coordinate].stops.map_or((0.0, 0.0), |s| (s.min_angle, s.max_angle));
            let depth = if value(side) >= 0.0 { high - value(angle) } else { value(angle) - low }.max(0.0);
            let (k, n) = (value(k), value(exponent));
            stiffness += joint_end_stop::tangent(k, n, depth);
            let blow = (high - low).min(0.1);
            damping += joint_end_stop::tangent(k, n, blow) / n * blow * value(dissipation);
        }
        let (rubbing, contact) = self.muscles_resistance(coordinate);
        damping += rubbing;
        stiffness += contact;
        (damping, stiffness)
    }

    /// Damping and stiffness that effects on its muscles add to a coordinate at most.
    fn muscles_resistance(&self, coordinate: usize) -> (f64, f64) {
        let (wiring, units) = (&self.rig.wiring, &self.rig.wiring.effects);
        let value = |id| self.values[id];
        let gauge = self.rig.highest_pressure() - self.rig.gas.ambient_pressure;
        let (mut damping, mut stiffness) = (0.0, 0.0);
        for group in wiring.groups.iter().filter(|g| g.coordinate == coordinate) {
            let (low, high) = self.rig.angles(group);
            let points = (0..=16).map(|i| group.joint.eval(low + (high - low) * f64::from(i) / 16.0));
            let (arm, contracted) = points.fold((0.0_f64, 0.0_f64), |(arm, contracted), point| {
                (arm.max(point.moment_arm.abs()), contracted.max(point.shortening / group.rest_length))
            });
            let side = group.count * arm * arm;
            if let (true, Some(ids)) = (group.effects.damping, units.damping) {
                damping += muscle_rate_damping::largest(ids.map(value), gauge) * side;
            }
            if let (true, Some(ids)) = (group.effects.crowding, units.crowding) {
                let contact = ids.map(value);
                damping += pam_crowding_contact::largest(contact, gauge, contracted) * side;
                stiffness +=
                    pam_crowding_contact::stiffest(contact, gauge, contracted) / group.rest_length * side;
            }
        }
        (damping, stiffness)
    }
}
