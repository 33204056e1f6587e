//! What happens in an instant: a stop is reached or left, a flow becomes choked or no longer is, a
//! chamber falls below the ambient pressure or rises above what it bears.

use crate::description::dotted;
use crate::plant::Rig;
use crate::plant::{Controls, Plant, Pressure};

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The lower (false) or upper (true) stop is reached.
    StopReached(bool),
    /// The lower (false) or upper (true) stop is left.
    StopLeft(bool),
    /// A chamber falls clearly below the ambient pressure (false) or rises above the largest one
    /// that the stand allows (true).
    PressurePassed(bool),
    /// It no longer is there.
    PressureBack(bool),
    /// A flow becomes choked.
    Choked,
    /// A flow is no longer choked.
    Unchoked,
}

impl Kind {
    /// Name, public API.
    pub fn name(self) -> &'static str {
        match self {
            Self::StopReached(false) => "min_stop_reached",
            Self::StopReached(true) => "max_stop_reached",
            Self::StopLeft(false) => "min_stop_left",
            Self::StopLeft(true) => "max_stop_left",
            Self::PressurePassed(false) => "vacuum_reached",
            Self::PressurePassed(true) => "max_pressure_passed",
            Self::PressureBack(false) => "vacuum_left",
            Self::PressureBack(true) => "max_pressure_kept",
            Self::Choked => "choked",
            Self::Unchoked => "unchoked",
        }
    }
}

/// One event.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Time [s]; between the ends of a step by a straight line.
    pub time: f64,
    /// What happened.
    pub kind: Kind,
    /// Where: `joint.elbow`, `load`, `chamber`, `valve.flexor`, `line`.
    pub block: String,
}

/// How far below the ambient pressure a chamber has a vacuum [Pa]: a muscle that is stretched while
/// it is vented dips a little.
const VACUUM: f64 = 5e3;

/// What an event's condition is found from.
#[derive(Debug, Clone, Copy)]
enum Condition {
    /// Nothing that changes.
    Still(f64),
    /// How far a state is below a limit: its place and the limit.
    Below(usize, f64),
    /// The same above one.
    Above(usize, f64),
    /// Critical less actual ratio of two pressures: positive when choked.
    Flow(Pressure, Pressure, f64),
}

impl Condition {
    #[inline]
    fn margin(self, at: &impl Fn(usize) -> f64) -> f64 {
        let pressure = |pressure: Pressure| match pressure {
            Pressure::At(place) => at(place),
            Pressure::Held(value) => value,
        };
        match self {
            Self::Still(margin) => margin,
            Self::Below(place, limit) => limit - at(place),
            Self::Above(place, limit) => at(place) - limit,
            Self::Flow(one, other, critical) => {
                let (a, b) = (pressure(one), pressure(other));
                let (low, high) = if a < b { (a, b) } else { (b, a) };
                critical - low / high.max(f64::MIN_POSITIVE)
            }
        }
    }
}

/// How far from its edge a ratio of pressures is told from it without a division.
const CLEAR: f64 = 1e-9;

impl Condition {
    /// Whether the margin is positive.
    #[inline]
    fn holds(self, at: &impl Fn(usize) -> f64) -> bool {
        if let Self::Flow(one, other, critical) = self {
            let pressure = |pressure: Pressure| match pressure {
                Pressure::At(place) => at(place),
                Pressure::Held(value) => value,
            };
            let (a, b) = (pressure(one), pressure(other));
            let (low, high) = if a < b { (a, b) } else { (b, a) };
            let off = critical * high - low;
            if off.abs() > CLEAR * high {
                return off > 0.0;
            }
        }
        self.margin(at) > 0.0
    }
}

/// The conditions of events under some controls: both stops of each coordinate, both limits of each
/// chamber's pressure, then each flow.
#[derive(Debug, Clone, Default)]
pub(crate) struct Conditions {
    each: Vec<Condition>,
    /// How many of them are of stops.
    stops: usize,
    /// How many of them are of stops and of pressures.
    limits: usize,
    /// Spool positions that they are for.
    spools: Vec<f64>,
}

impl Conditions {
    /// Whether one of them is not what `flags` say, by a state, place by place.
    #[inline]
    pub fn differ(&self, flags: &[bool], at: impl Fn(usize) -> f64) -> bool {
        self.each.iter().zip(flags).any(|(condition, flag)| condition.holds(&at) != *flag)
    }

    /// Those of stops and pressures, which no control changes.
    fn set_limits(&mut self, plant: &Plant<'_, f64>) {
        let rig = plant.rig();
        for (k, coordinate) in rig.wiring.coordinates.iter().enumerate() {
            let place = rig.layout.angle(k);
            match coordinate.stops {
                None => self.each.extend([Condition::Still(f64::NEG_INFINITY); 2]),
                Some(stops) => {
                    self.each.push(Condition::Below(place, stops.min_angle));
                    self.each.push(Condition::Above(place, stops.max_angle));
                }
            }
        }
        self.stops = self.each.len();
        let ambient = rig.gas.ambient_pressure;
        for chamber in 0..rig.wiring.chambers {
            let place = rig.layout.pressure(chamber);
            self.each.push(Condition::Below(place, ambient - VACUUM));
            self.each.push(match rig.spec().max_pressure {
                Some(most) => Condition::Above(place, ambient + most),
                None => Condition::Still(f64::NEG_INFINITY),
            });
        }
        self.limits = self.each.len();
    }

    /// Those of the plant that they are of under other controls.
    pub fn set(&mut self, plant: &Plant<'_, f64>, controls: &Controls<f64>) {
        if !self.each.is_empty() && self.spools == controls.spool {
            return;
        }
        self.spools.clone_from(&controls.spool);
        if self.each.is_empty() {
            self.set_limits(plant);
        }
        self.each.truncate(self.limits);
        self.each.extend(plant.passages(controls).map(|(ends, critical)| match ends {
            Some((one, other)) => Condition::Flow(one, other, critical),
            None => Condition::Still(critical - 1.0),
        }));
    }
}

/// Conditions at one instant: how far beyond what ends them, negative inside.
#[derive(Debug, Clone, Default)]
pub(crate) struct Watch {
    margins: Vec<f64>,
    /// How many of them are of stops, and of stops and pressures.
    stops: usize,
    limits: usize,
}

impl Watch {
    /// Look at a state, place by place.
    #[inline]
    pub fn look(&mut self, conditions: &Conditions, at: impl Fn(usize) -> f64) {
        (self.stops, self.limits) = (conditions.stops, conditions.limits);
        self.margins.clear();
        self.margins.extend(conditions.each.iter().map(|condition| condition.margin(&at)));
    }

    /// Events of what is true now and was not (or the reverse) by `flags`, which are brought up to
    /// date. `before` are the conditions a time `dt` earlier.
    #[inline]
    pub fn report(
        &self,
        rig: &Rig,
        before: Option<(&Self, f64)>,
        time: f64,
        flags: &mut [bool],
        out: &mut Vec<Event>,
    ) {
        for (k, (margin, flag)) in self.margins.iter().zip(flags.iter_mut()).enumerate() {
            let now = *margin > 0.0;
            if now == *flag {
                continue;
            }
            *flag = now;
            let back = before.and_then(|(b, dt)| Some((*b.margins.get(k)?, dt)));
            let share = back.map_or(0.0, |(was, dt)| {
                // Where the straight line between the two crosses zero; a jump counts at its end.
                let span = margin - was;
                if span.is_finite() && span != 0.0 {
                    dt * (margin / span).clamp(0.0, 1.0)
                } else {
                    0.0
                }
            });
            out.push(Event {
                time: time - share,
                kind: self.kind(k, now),
                block: self.block(rig, k),
            });
        }
    }

    fn kind(&self, k: usize, now: bool) -> Kind {
        let upper = k % 2 == 1;
        match (k < self.stops, k < self.limits, now) {
            (true, _, true) => Kind::StopReached(upper),
            (true, _, false) => Kind::StopLeft(upper),
            (_, true, true) => Kind::PressurePassed(upper),
            (_, true, false) => Kind::PressureBack(upper),
            (_, _, true) => Kind::Choked,
            (_, _, false) => Kind::Unchoked,
        }
    }

    fn block(&self, rig: &Rig, k: usize) -> String {
        let (stops, limits, spec) = (self.stops, self.limits, rig.spec());
        if k < stops {
            return rig.names.coordinates.get(k / 2).cloned().unwrap_or_default();
        }
        if k < limits {
            let chamber = spec.chambers.get((k - stops) / 2);
            return chamber.map_or_else(String::new, |c| dotted("chamber", &c.name));
        }
        match spec.valves.get(k - limits) {
            Some(valve) => dotted("valve", &valve.name),
            None => spec
                .lines
                .get(k - limits - spec.valves.len())
                .map_or_else(String::new, |l| dotted("line", &l.name)),
        }
    }
}
