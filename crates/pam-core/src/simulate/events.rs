//! What happens in an instant: a stop is reached or left, a flow becomes choked or no longer is.

use crate::description::dotted;
use crate::plant::Rig;
use crate::plant::{Controls, Plant};

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The lower (false) or upper (true) stop is reached.
    StopReached(bool),
    /// The lower (false) or upper (true) stop is left.
    StopLeft(bool),
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
    /// Where: `joint.elbow`, `load`, `valve.flexor`, `line`.
    pub block: String,
}

/// Conditions at one instant, for each coordinate (how far beyond its nearest stop, negative
/// inside) and each flow.
#[derive(Debug, Clone, Default)]
pub(crate) struct Watch {
    /// Distance beyond the lower and the upper stop of each coordinate; then critical less actual
    /// pressure ratio of each flow: positive when choked.
    margins: Vec<f64>,
    /// How many of them are of stops.
    stops: usize,
}

impl Watch {
    pub fn look(&mut self, plant: &Plant<'_, f64>, state: &[f64], controls: &Controls<f64>) {
        let rig = plant.rig();
        let wiring = &rig.wiring;
        self.stops = 2 * wiring.coordinates.len();
        self.margins.resize(self.stops + wiring.valves.len() + wiring.lines.len(), 0.0);
        let (beyond, choke) = self.margins.split_at_mut(self.stops);
        for (k, (out, coordinate)) in
            beyond.chunks_exact_mut(2).zip(&wiring.coordinates).enumerate()
        {
            let x = state[rig.layout.angle(k)];
            let inside = [f64::NEG_INFINITY; 2];
            let margins = coordinate.stops.map_or(inside, |s| [s.min_angle - x, x - s.max_angle]);
            out.copy_from_slice(&margins);
        }
        plant.choked(state, controls, choke);
    }

    /// Events of what is true now and was not (or the reverse) by `flags`, which are brought up to
    /// date. `before` are the conditions a time `dt` earlier.
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
        match (k < self.stops, now) {
            (true, true) => Kind::StopReached(upper),
            (true, false) => Kind::StopLeft(upper),
            (false, true) => Kind::Choked,
            (false, false) => Kind::Unchoked,
        }
    }

    fn block(&self, rig: &Rig, k: usize) -> String {
        let stops = self.stops;
        if k < stops {
            return rig.names.coordinates.get(k / 2).cloned().unwrap_or_default();
        }
        let spec = rig.spec();
        match spec.valves.get(k - stops) {
            Some(valve) => dotted("valve", &valve.name),
            None => spec
                .lines
                .get(k - stops - spec.valves.len())
                .map_or_else(String::new, |l| dotted("line", &l.name)),
        }
    }
}
