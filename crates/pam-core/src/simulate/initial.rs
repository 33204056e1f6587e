//! Where a simulation begins.

use crate::description::dotted;
use crate::error::check_range;
use crate::plant::Rig;
use crate::simulate::drive::LEAST_PRESSURE;
use crate::{Error, Result};

/// Temperatures that a gas may begin at [K].
const COLDEST: f64 = 1.0;
const HOTTEST: f64 = 1e4;

/// Initial state as a user states it, by the names of [`crate::plant::Names::initial`]: gauge
/// pressures [Pa], angles [rad], rates [rad/s], length [m]; `temperature` of the gas of a chamber
/// with an energy balance [K]; true values, not sensor readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Initial {
    values: Vec<f64>,
    given: Vec<bool>,
    /// Gases that begin at another temperature than that of the room [K].
    pub(super) temperatures: Vec<(usize, f64)>,
}

impl Initial {
    /// The rig at rest: every pressure its initial one, joints at their rest angle, a loaded muscle
    /// at its rest length.
    pub fn rest(rig: &Rig) -> Self {
        let (spec, wiring, layout) = (rig.spec(), &rig.wiring, &rig.layout);
        let of = |place: usize| {
            if place < layout.supplies {
                spec.supplies[place].initial_pressure
            } else if place < layout.mass(0) {
                wiring.gases[place - layout.supplies].initial_pressure
            } else if place < layout.angle(0) {
                0.0
            } else if place < layout.rate(0) && spec.load.is_some() {
                wiring.groups[0].rest_length
            } else if place < layout.rate(0) {
                let coordinate = &wiring.coordinates[place - layout.angle(0)];
                coordinate
                    .stops
                    .map_or(coordinate.rest, |s| coordinate.rest.clamp(s.min_angle, s.max_angle))
            } else {
                0.0
            }
        };
        let values: Vec<f64> = rig.names.initial.iter().map(|(_, place)| of(*place)).collect();
        Self { given: vec![false; values.len()], values, temperatures: Vec::new() }
    }

    /// The same with one value more, by its name.
    ///
    /// # Errors
    /// [`Error::Model`] for a name that the rig does not have, [`Error::Parameter`] for an
    /// impossible value.
    pub fn with(mut self, rig: &Rig, name: &str, value: f64) -> Result<Self> {
        if let Some((gas, _)) = temperatures(rig).find(|(_, n)| n == name) {
            let full = format!("initial.{name}");
            let kelvin = check_range(&full, value, COLDEST, HOTTEST, "K")?;
            self.temperatures.retain(|(other, _)| *other != gas);
            self.temperatures.push((gas, kelvin));
            return Ok(self);
        }
        let Some(k) = rig.names.initial.iter().position(|(n, _)| n == name) else {
            let names = rig.names.initial.iter().map(|(n, _)| n.clone());
            let names: Vec<_> = names.chain(temperatures(rig).map(|(_, n)| n)).collect();
            return Err(Error::Model(format!(
                "initial has the unknown entry '{name}'; there are: {}",
                names.join(", ")
            )));
        };
        let (layout, place) = (&rig.layout, rig.names.initial[k].1);
        let full = format!("initial.{name}");
        if place < layout.mass(0) {
            check_range(
                &full,
                value,
                LEAST_PRESSURE - rig.gas.ambient_pressure,
                1e8,
                "Pa (gauge)",
            )?;
        } else if place < layout.angle(0) {
            check_range(&full, value, -10.0, 10.0, "kg/s")?;
        } else if place >= layout.rate(0) {
            check_range(
                &full,
                value,
                -1e4,
                1e4,
                if rig.spec().load.is_some() { "m/s" } else { "rad/s" },
            )?;
        } else if let Some(load) = &rig.spec().load {
            check_range(&full, value, load.min_length, load.max_length, "m")?;
        } else {
            let stops = rig.wiring.coordinates[place - layout.angle(0)].stops;
            let (low, high) = stops.map_or((-7.0, 7.0), |s| (s.min_angle - 0.2, s.max_angle + 0.2));
            check_range(&full, value, low, high, "rad")?;
        }
        (self.values[k], self.given[k]) = (value, true);
        Ok(self)
    }

    /// The state, its masses and balance still zero.
    pub(crate) fn state(&self, rig: &Rig, states: usize) -> Vec<f64> {
        let (layout, wiring) = (&rig.layout, &rig.wiring);
        let mut state = vec![0.0; states];
        let ambient = rig.gas.ambient_pressure;
        for ((_, place), value) in rig.names.initial.iter().zip(&self.values) {
            state[*place] = if *place < layout.mass(0) {
                value + ambient
            } else if *place >= layout.angle(0) && rig.spec().load.is_some() {
                if *place < layout.rate(0) {
                    wiring.groups[0].rest_length - value
                } else {
                    0.0 - value
                }
            } else {
                *value
            };
        }
        for (gas, end) in wiring.beginnings() {
            let place = layout.pressure(gas);
            let given = rig
                .names
                .initial
                .iter()
                .zip(&self.given)
                .any(|((_, p), given)| *p == place && *given);
            if let (false, Some(end)) = (given, end.place(layout)) {
                state[place] = state[end];
            }
        }
        state
    }
}

/// Gases that keep a balance of energy, and what their temperatures are called.
fn temperatures(rig: &Rig) -> impl Iterator<Item = (usize, String)> + '_ {
    let chambers = rig.spec().chambers.iter().enumerate();
    chambers
        .filter(|(gas, _)| rig.wiring.gases[*gas].has_energy())
        .map(|(gas, chamber)| (gas, dotted("temperature", &chamber.name)))
}
