//! Which rigs run in lanes, and what lanes need to know of one.

use super::blocks::{Orifice, Turns};
use super::curves::Curves;
use super::num::NEAR;
use crate::muscle::Pushed;
use crate::plant::{BodyUnit, Group, Passes, Rig};

/// How far beyond its stops a coordinate may go in lanes, in ranges of it.
const BEYOND: f64 = 0.25;
/// The same, where the curves end before that.
const LESS_BEYOND: [f64; 4] = [BEYOND, 0.1, 0.04, 0.01];

/// What lanes need to know of a rig beside the values of its parameters.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    pub orifice: Orifice,
    pub curves: Vec<Curves>,
}

impl Plan {
    /// How a rig runs in lanes, none where it cannot: whatever the values of its parameters, dead
    /// times and limits of regulators apart.
    #[must_use]
    pub fn of(rig: &Rig) -> Option<&Self> {
        rig.derived(Self::new)?.as_ref().filter(|_| rig.first_order())
    }

    /// The plan of a rig that can run in lanes; none for another.
    fn new(rig: &Rig) -> Option<Self> {
        let wiring = &rig.wiring;
        let body = matches!(wiring.body, BodyUnit::OneLink { .. } | BodyUnit::Mass { .. });
        // the curves hold torques linear in pressure, whose sign tells a slack muscle and whose size
        // does not tell how far one bows out
        let plain = wiring.ports.effects.is_empty()
            && wiring
                .groups
                .iter()
                .all(|g| !g.direction && g.muscle.pushed() != Pushed::Bows && !g.muscle.mapped());
        let one_joint = wiring.groups.iter().all(|g| g.coordinate == 0);
        let areas = wiring.valves.iter().all(|valve| matches!(valve.passes, Passes::Area(_)));
        let fed = wiring.inlets_of_regulators().next().is_some();
        let states = wiring.heated() || !wiring.waves.is_empty();
        if !(body && plain && one_joint && areas) || states || fed {
            return None;
        }
        let curves = wiring.groups.iter().map(|group| curves(rig, group));
        Some(Self { orifice: Orifice::new(&rig.gas), curves: curves.collect::<Option<_>>()? })
    }

    /// How a weight follows the angles inside all curves.
    pub fn turns(&self) -> Turns {
        let near = |curves: &Curves| curves.low.abs().max(curves.high.abs()) <= NEAR;
        match self.curves.iter().any(near) {
            true => Turns::Near,
            false => Turns::Far,
        }
    }

    /// Coordinates between which all curves hold.
    pub fn range(&self) -> (f64, f64) {
        let low = self.curves.iter().map(|curves| curves.low).fold(f64::NEG_INFINITY, f64::max);
        let high = self.curves.iter().map(|curves| curves.high).fold(f64::INFINITY, f64::min);
        (low, high)
    }

    /// Whether a coordinate is inside all curves.
    pub fn contains(&self, angle: f64) -> bool {
        self.curves.iter().all(|curves| curves.low <= angle && angle <= curves.high)
    }
}

/// Curves of a group over the range of its coordinate and somewhat more.
fn curves(rig: &Rig, group: &Group) -> Option<Curves> {
    let (low, high) = rig.angles(group);
    let holds = |angle: f64| {
        group.joint.reaches(angle)
            && group.muscle.table.contains(group.joint.eval(angle).shortening / group.rest_length)
    };
    LESS_BEYOND.iter().find_map(|share| {
        let more = share * (high - low);
        Curves::new(group, edge(&holds, low, low - more), edge(&holds, high, high + more))
    })
}

/// As far from a place towards another as something holds.
fn edge(holds: &dyn Fn(f64) -> bool, from: f64, to: f64) -> f64 {
    const STEPS: u32 = 64;
    let mut good = from;
    for k in 1..=STEPS {
        let next = from + (to - from) * f64::from(k) / f64::from(STEPS);
        if !holds(next) {
            break;
        }
        good = next;
    }
    good
}
