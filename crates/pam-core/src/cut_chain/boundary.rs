//! Measured channels that drive blocks of a cut chain.

use super::block::Block;
use super::measured::{Measured, Signal};
use crate::plant::{Plant, Rig};
use crate::scalar::{constant, Scalar};

/// A measured state with what to subtract from its sensor's reading.
#[derive(Debug, Clone, Copy)]
pub(super) struct Driven<'a, S> {
    pub place: usize,
    signal: Signal<'a>,
    zero: S,
    /// Time constant of its sensor [s].
    lag: S,
    /// The gas whose gauge drifts.
    drifting: Option<usize>,
    /// Whether another clock than the block's records it.
    shifted: bool,
    /// Length of the muscles at rest [m], where a length stands for the shortening of a linear
    /// load; `zero` is then that of the shortening, the length's with the other sign.
    rest: Option<f64>,
}

/// The measured states, as they drive a block.
pub(super) fn driven<'a, S: Scalar>(
    plant: &Plant<'_, S>,
    block: Block,
    measured: &Measured<'a>,
) -> Vec<Driven<'a, S>> {
    let (rig, layout) = (plant.rig(), plant.rig().layout());
    let rest = rest_length(rig);
    let driver = |(place, signal): &(usize, Signal<'a>)| {
        let (zero, rest) = (zero(plant, *place), rest.filter(|_| *place == layout.angle(0)));
        Driven {
            place: *place,
            signal: *signal,
            zero: if rest.is_some() { -zero } else { zero },
            lag: lag(plant, *place),
            drifting: gas(plant, *place).filter(|gas| plant.gauge_drift(*gas, 0.0).is_some()),
            rest,
            // a block's own clock is that of what it predicts
            shifted: plant.skewed() && (*place < layout.angle(0)) == block.mechanical(),
        }
    };
    measured.signals.iter().map(driver).collect()
}

/// Length at rest of the muscles on a linear load [m].
pub(super) fn rest_length(rig: &Rig) -> Option<f64> {
    rig.spec().load.as_ref().and_then(|_| rig.wiring.groups.first()).map(|group| group.rest_length)
}

/// Zero of the sensor of a state.
#[inline]
pub(super) fn zero<S: Scalar>(plant: &Plant<'_, S>, place: usize) -> S {
    let (rig, layout) = (plant.rig(), plant.rig().layout());
    let id = if place < layout.supplies {
        Some(rig.wiring.supply_zeros[place])
    } else if place < layout.mass(0) {
        rig.wiring.gases[place - layout.supplies].pressure_zero
    } else {
        rig.wiring.coordinates[place - layout.angle(0)].zero
    };
    id.map_or(constant(0.0), |id| plant.values()[id])
}

/// The gas of a pressure.
pub(super) fn gas<S: Scalar>(plant: &Plant<'_, S>, place: usize) -> Option<usize> {
    let layout = plant.rig().layout();
    (layout.pressure(0)..layout.mass(0)).contains(&place).then(|| place - layout.supplies)
}

/// Time constant of the sensor of a state [s].
fn lag<S: Scalar>(plant: &Plant<'_, S>, place: usize) -> S {
    gas(plant, place).and_then(|gas| plant.lagging(gas)).map_or(constant(0.0), |(_, lag)| lag)
}

impl<S: Scalar> Driven<'_, S> {
    /// True state at a fraction of sample `k`, read so much later [s] where another clock records
    /// it; an angle brings its rate along.
    #[inline]
    pub fn write(
        &self,
        plant: &Plant<'_, S>,
        k: usize,
        fraction: f64,
        dt: f64,
        shift: S,
        state: &mut [S],
    ) {
        let (rig, layout) = (plant.rig(), plant.rig().layout());
        let (cell, t, inside) = if self.shifted {
            self.signal.later(k, fraction, dt, shift.re())
        } else {
            (k, fraction, false)
        };
        let (value, slope) = self.signal.at(cell, t, dt);
        let (value, slope, sign) =
            self.rest.map_or((value, slope, 1.0), |rest| (rest - value, -slope, -1.0));
        let pressure = self.place < layout.angle(0);
        if pressure {
            state[self.place] = -self.zero + (value + rig.gas.ambient_pressure) + self.lag * slope;
            let time = (k as f64 + fraction) * dt;
            if let Some(drift) = self.drifting.and_then(|gas| plant.gauge_drift(gas, time)) {
                state[self.place] -= drift;
            }
        } else {
            state[self.place] = -self.zero + value;
            state[self.place + layout.coordinates] = constant(slope);
        }
        if inside {
            // what the shift's own derivatives add
            let (more, bend) = (shift - shift.re(), self.signal.curvature(cell, t, dt) * sign);
            if pressure {
                state[self.place] += more * slope + self.lag * more * bend;
            } else {
                state[self.place] += more * slope;
                state[self.place + layout.coordinates] += more * bend;
            }
        }
        let coordinate = self.place.checked_sub(layout.angle(0));
        if let Some(k) = coordinate.filter(|k| plant.misreads(*k)) {
            let angle = plant.true_angle(k, state[self.place]);
            state[self.place] = angle;
            let rate = state[self.place + layout.coordinates];
            state[self.place + layout.coordinates] = rate / plant.encoder_gain(k, angle);
        }
    }
}

/// Gases (and their valves) whose measured pressure is that in front of a tube, where what feeds
/// the valve is measured, constant or the block's own: the pressure behind can then be told.
pub(super) fn taps<S: Scalar>(
    plant: &Plant<'_, S>,
    block: Block,
    measured: &Measured<'_>,
) -> Vec<(usize, usize)> {
    let (rig, layout) = (plant.rig(), plant.rig().layout());
    let known = |place: usize| {
        let constant = rig.spec().supplies.get(place).is_some_and(|s| s.kind == "constant");
        constant || Some(place) == block.output(layout) || measured.signal(place).is_some()
    };
    let fed = plant.taps().filter(|(gas, _)| measured.signal(layout.pressure(*gas)).is_some());
    fed.filter(|(_, valve)| rig.wiring.valves[*valve].from.place(layout).is_none_or(known))
        .collect()
}
