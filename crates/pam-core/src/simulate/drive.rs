//! Signals that drive a simulation: held commands, and channels that are prescribed.

use std::borrow::Cow;
use std::ops::Range;

use crate::description::dotted;
use crate::plant::Rig;
use crate::room::room;
use crate::{Error, Result};

/// What drives a simulation: one command per sample and input, and what is prescribed for the end
/// of each sample.
#[derive(Debug, Clone)]
pub struct Drive<'a> {
    pub(crate) samples: usize,
    pub(crate) commands: Vec<Cow<'a, [f64]>>,
    prescribed: Vec<(usize, Cow<'a, [f64]>)>,
}

/// Lowest absolute pressure that may be prescribed [Pa].
pub(crate) const LEAST_PRESSURE: f64 = 1.0;

impl<'a> Drive<'a> {
    /// A drive over a number of samples from signals by name: the rig's inputs (`valve_command`
    /// [V], `supply_command` [Pa, gauge]), `length` of a load frame [m], `pressure` of chambers
    /// without a valve and `supply_pressure` of measured supplies [Pa, gauge].
    ///
    /// # Errors
    /// [`Error::Model`] for a signal that is missing or that the rig does not take,
    /// [`Error::Length`] for one of another length, [`Error::Parameter`] for a value that is not
    /// possible.
    pub fn new(rig: &Rig, samples: usize, signals: &[(&str, &'a [f64])]) -> Result<Self> {
        let (spec, names) = (rig.spec(), &rig.names);
        let find = |name: &str| signals.iter().find(|(n, _)| *n == name).map(|(_, values)| *values);
        let mut commands = Vec::new();
        for (k, name) in names.inputs.iter().enumerate() {
            commands.push(match find(name) {
                Some(values) => {
                    let (low, high, unit) = input_range(rig, k);
                    check_signal(name, values, samples, (low, high), unit)?;
                    Cow::Borrowed(values)
                }
                None if k < spec.valves.len() => {
                    return Err(command_missing(name));
                }
                None => Cow::Owned(room("samples", &[samples], set_pressure(rig, k))?),
            });
        }
        let mut prescribed = Vec::new();
        for (name, values) in signals.iter().filter(|(n, _)| !names.inputs.iter().any(|i| i == n)) {
            let (place, low, high, unit) = prescribable(rig, name)?;
            check_signal(name, values, samples, (low, high), unit)?;
            prescribed.push((place, Cow::Borrowed(*values)));
        }
        check_frame(rig, find("length").is_some())?;
        Ok(Self { samples, commands, prescribed })
    }

    /// One sample of a rig that nobody commands: valves at 0 V, regulators at their own pressures.
    #[must_use]
    pub fn idle(rig: &Rig) -> Drive<'static> {
        let valves = rig.spec().valves.len();
        let own = |k| if k < valves { 0.0 } else { set_pressure(rig, k) };
        let commands = (0..rig.names.inputs.len()).map(|k| Cow::Owned(vec![own(k)])).collect();
        Drive { samples: 1, commands, prescribed: Vec::new() }
    }

    /// Another command of an input in every sample, a finite number.
    pub fn command(&mut self, input: usize, value: f64) {
        self.commands[input].to_mut().fill(value);
    }

    /// Samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Some of the samples, borrowed.
    #[must_use]
    pub fn part(&self, range: Range<usize>) -> Drive<'_> {
        let samples = range.len();
        let cut = |values| Cow::Borrowed(<[f64]>::get(values, range.clone()).unwrap_or(&[]));
        Drive {
            samples,
            commands: self.commands.iter().map(|values| cut(values)).collect(),
            prescribed: self
                .prescribed
                .iter()
                .map(|(place, values)| (*place, cut(values)))
                .collect(),
        }
    }

    /// A drive of commands in the order of the rig's inputs, and of what is prescribed, by its
    /// place, that were checked.
    pub(crate) fn checked(
        samples: usize,
        commands: Vec<Cow<'a, [f64]>>,
        prescribed: Vec<(usize, Cow<'a, [f64]>)>,
    ) -> Self {
        Self { samples, commands, prescribed }
    }

    /// Room for a value of each of some rows that are driven as this one is.
    pub(crate) fn of_rows(&self, rows: usize) -> Drive<'static> {
        let room = || Cow::Owned(vec![0.0; rows]);
        Drive {
            samples: rows,
            commands: self.commands.iter().map(|_| room()).collect(),
            prescribed: self.prescribed.iter().map(|(place, _)| (*place, room())).collect(),
        }
    }

    /// Drive a row as a sample of another drive does.
    pub(crate) fn set(&mut self, row: usize, other: &Drive<'_>, sample: usize) {
        self.follow(other, |own, values| own[row] = values[sample]);
    }

    /// Drive all rows as a sample of another drive does.
    pub(crate) fn set_all(&mut self, other: &Drive<'_>, sample: usize) {
        self.follow(other, |own, values| own.fill(values[sample]));
    }

    /// Write the rows of each signal by the samples of another drive.
    fn follow(&mut self, other: &Drive<'_>, write: impl Fn(&mut [f64], &[f64])) {
        for (own, values) in self.commands.iter_mut().zip(&other.commands) {
            write(own.to_mut(), values);
        }
        for ((_, own), (_, values)) in self.prescribed.iter_mut().zip(&other.prescribed) {
            write(own.to_mut(), values);
        }
    }

    /// Whether anything is prescribed.
    pub(crate) fn prescribes(&self) -> bool {
        !self.prescribed.is_empty()
    }

    pub(crate) fn places(&self) -> impl Iterator<Item = usize> + '_ {
        self.prescribed.iter().map(|(place, _)| *place)
    }

    /// Where one sample begins and ends: place, from, to.
    pub(crate) fn ends(&self, rig: &Rig, state: &[f64], sample: usize) -> Vec<(usize, f64, f64)> {
        let end = |(place, values): &(usize, Cow<'_, [f64]>)| {
            let value = values.get(sample).copied().unwrap_or(f64::NAN);
            let to = if *place < rig.layout.angle(0) {
                value + rig.gas.ambient_pressure
            } else {
                rig.wiring.groups[0].rest_length - value
            };
            (*place, state[*place], to)
        };
        self.prescribed.iter().map(end).collect()
    }
}

/// Range and unit of an input.
pub(crate) fn input_range(rig: &Rig, input: usize) -> (f64, f64, &'static str) {
    if input < rig.spec().valves.len() {
        (f64::MIN, f64::MAX, "V")
    } else {
        (-rig.gas.ambient_pressure, 1e8, "Pa (gauge)")
    }
}

/// What a regulator is set to that nobody sets [Pa, gauge].
pub(crate) fn set_pressure(rig: &Rig, input: usize) -> f64 {
    let spec = rig.spec();
    let supply =
        spec.supplies.iter().filter(|s| s.kind == "regulator").nth(input - spec.valves.len());
    supply.map_or(0.0, |s| s.initial_pressure)
}

/// What is missing where a valve has no command.
pub(crate) fn command_missing(name: &str) -> Error {
    Error::Model(format!("{name} is missing: a rig with a valve needs one value per sample [V]"))
}

/// A load frame needs a length.
pub(crate) fn check_frame(rig: &Rig, given: bool) -> Result<()> {
    if rig.spec().load.as_ref().is_some_and(|l| l.is_frame()) && !given {
        return Err(Error::Model(
            "length is missing: a load frame needs one value per sample [m]".into(),
        ));
    }
    Ok(())
}

/// Place of a state that can be prescribed, with the range and unit of its signal.
pub(crate) fn prescribable(rig: &Rig, name: &str) -> Result<(usize, f64, f64, &'static str)> {
    let spec = rig.spec();
    if name == "length" {
        return match spec.load.as_ref().filter(|load| load.is_frame()) {
            Some(load) => Ok((rig.layout.angle(0), load.min_length, load.max_length, "m")),
            None => Err(Error::Model(
                "length is given, which only a rig with a load frame takes ([load] kind = \
                    \"frame\")"
                    .into(),
            )),
        };
    }
    let (low, high, unit) = (LEAST_PRESSURE - rig.gas.ambient_pressure, 1e8, "Pa (gauge)");
    if let Some(k) = spec.supplies.iter().position(|s| dotted("supply_pressure", &s.name) == name) {
        if spec.supplies[k].kind != "measured" {
            return Err(Error::Model(format!(
                "{name} is given, which only a supply takes that is measured ([supply] kind = \
                    \"measured\"); this one is \"{}\"",
                spec.supplies[k].kind
            )));
        }
        return Ok((rig.layout.supply(k), low, high, unit));
    }
    let Some(k) = spec.chambers.iter().position(|c| dotted("pressure", &c.name) == name) else {
        return Err(Error::Model(format!(
            "{name} is not a signal that this rig takes; it takes: {}",
            rig.names.inputs.join(", ")
        )));
    };
    if rig.wiring.valves.iter().any(|v| v.to == k) {
        return Err(Error::Model(format!(
            "{name} is given, which only a chamber without [valve] takes: there the valve decides"
        )));
    }
    Ok((rig.layout.pressure(k), low, high, unit))
}

fn check_signal(
    name: &str,
    values: &[f64],
    samples: usize,
    (low, high): (f64, f64),
    unit: &str,
) -> Result<()> {
    if values.len() != samples {
        let why = "one for each sample".into();
        return Err(Error::Length {
            name: name.into(),
            found: values.len(),
            expected: samples,
            why,
        });
    }
    for (k, value) in values.iter().enumerate() {
        check_value(|| format!("{name}[{k}]"), *value, (low, high), unit)?;
    }
    Ok(())
}

/// One value of a signal.
pub(crate) fn check_value(
    name: impl Fn() -> String,
    value: f64,
    (low, high): (f64, f64),
    unit: &str,
) -> Result<()> {
    if value.is_finite() && value >= low && value <= high {
        return Ok(());
    }
    let allowed = if low == f64::MIN {
        "a finite voltage".into()
    } else {
        format!("a number from {low} to {high} {unit}")
    };
    Err(Error::parameter(name(), value, allowed))
}
