//! What was measured around a block.

use crate::description::dotted;
use crate::plant::{Channel, Rig};
use crate::{Error, Result};

/// A measured signal, smoothed, with its time derivative at each sample; as the sensor reads it,
/// SI, gauge.
#[derive(Debug, Clone, Copy)]
pub struct Signal<'a> {
    /// Values, one per sample.
    pub value: &'a [f64],
    /// Time derivatives, one per sample.
    pub slope: &'a [f64],
}

impl Signal<'_> {
    fn check(&self, name: &str, n: usize) -> Result<()> {
        for (part, data) in [("value", self.value), ("slope", self.slope)] {
            if data.len() != n {
                return Err(Error::Length {
                    name: format!("{name}.{part}"),
                    found: data.len(),
                    expected: n,
                    why: "one per sample of valve_command".into(),
                });
            }
            if let Some((k, v)) = data.iter().enumerate().find(|(_, v)| !v.is_finite()) {
                return Err(Error::parameter(format!("{name}.{part}[{k}]"), *v, "a finite value"));
            }
        }
        Ok(())
    }

    /// Sample and fraction some time [s] after a fraction of sample `k`, inside the recording, and
    /// whether that is where it asks for.
    pub(crate) fn later(&self, k: usize, fraction: f64, dt: f64, shift: f64) -> (usize, f64, bool) {
        let last = (self.value.len() - 1) as f64;
        let wanted = k as f64 + fraction + shift / dt;
        let place = wanted.clamp(0.0, last);
        let cell = place.floor().min((last - 1.0).max(0.0));
        (cell as usize, place - cell, wanted == place)
    }

    /// Values at both ends of sample `k`, and slopes there per sample.
    #[inline]
    fn ends(&self, k: usize, dt: f64) -> [f64; 4] {
        let next = (k + 1).min(self.value.len() - 1);
        [self.value[k], self.slope[k] * dt, self.value[next], self.slope[next] * dt]
    }

    /// Cubic Hermite value and derivative at a fraction of sample `k`.
    #[inline]
    pub(crate) fn at(&self, k: usize, fraction: f64, dt: f64) -> (f64, f64) {
        let [p0, m0, p1, m1] = self.ends(k, dt);
        if fraction == 0.0 {
            return (p0, m0 / dt);
        }
        if fraction == 1.0 {
            return (p1, m1 / dt);
        }
        let (t, t2) = (fraction, fraction * fraction);
        let t3 = t2 * t;
        let value =
            p0 + m0 * (t - 2.0 * t2 + t3) + (p1 - p0) * (3.0 * t2 - 2.0 * t3) + m1 * (t3 - t2);
        let slope = m0 * (1.0 - 4.0 * t + 3.0 * t2)
            + (p1 - p0) * 6.0 * (t - t2)
            + m1 * (3.0 * t2 - 2.0 * t);
        (value, slope / dt)
    }

    /// Second derivative there.
    pub(crate) fn curvature(&self, k: usize, t: f64, dt: f64) -> f64 {
        let [p0, m0, p1, m1] = self.ends(k, dt);
        ((p1 - p0) * (6.0 - 12.0 * t) + m0 * (6.0 * t - 4.0) + m1 * (6.0 * t - 2.0)) / (dt * dt)
    }
}

/// An input of a block that nobody measured, piecewise linear in time: a torque [N m], a force [N]
/// or a mass flow [kg/s].
#[derive(Debug, Clone, Default)]
pub(crate) struct Input {
    /// Samples from one knot to the next.
    pub spacing: usize,
    /// Its value at each knot of each window, the windows one after the other; zero where there are
    /// none.
    pub heights: Vec<f64>,
}

impl Input {
    /// Knots of a window of so many samples.
    pub fn knots(&self, samples: usize) -> usize {
        samples.div_ceil(self.spacing) + 1
    }
}

/// Measured signals around a block.
#[derive(Debug, Clone)]
pub struct Measured<'a> {
    pub(crate) samples: usize,
    /// Commands, `held` values for each sample.
    pub(crate) commands: Vec<&'a [f64]>,
    /// Commands that follow each other within a sample, each held equally long.
    pub(crate) held: usize,
    /// Place of the state and its signal.
    pub(crate) signals: Vec<(usize, Signal<'a>)>,
    /// Gases with a thermometer, and what it reads [K].
    pub(crate) thermometers: Vec<(usize, Signal<'a>)>,
    /// Places of states that nobody measured, and where they begin.
    pub(crate) outlets: Vec<(usize, f64)>,
    /// Samples inside the windows of a temperature at which the pressures are taken anew.
    pub(crate) anchors: Vec<usize>,
    /// What the block gets beside what its model makes.
    pub(crate) input: Option<Input>,
}

impl<'a> Measured<'a> {
    /// Commands (one for each input of the rig, held over each sample) and measured channels by
    /// name: `supply_pressure`, `muscle_pressure`, `line_pressure`, `joint_angle`, `length` of the
    /// muscle on a linear load, each with the name of its block behind it where it has one. A
    /// `temperature` of a chamber's gas drives nothing: it says where that of its gas begins.
    ///
    /// Where samples are means of several of a log, all commands may have so many values for each
    /// sample: a valve lets through what its openings do one after the other, not what their mean
    /// does.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::Parameter`] for bad arrays; [`Error::Model`] for a name that
    /// the rig does not have, or a command that is missing.
    pub fn new(
        rig: &Rig,
        samples: usize,
        commands: &[(&str, &'a [f64])],
        signals: &[(&str, Signal<'a>)],
    ) -> Result<Self> {
        let mut own = Vec::new();
        let longest = commands.iter().map(|(_, values)| values.len()).max().unwrap_or(0);
        let held = (longest / samples.max(1)).max(1);
        for name in &rig.names().inputs {
            let Some((_, values)) = commands.iter().find(|(n, _)| n == name) else {
                return Err(Error::Model(format!(
                    "{name} is missing: one value per sample is needed"
                )));
            };
            if values.len() != samples * held {
                let why = "one per sample, or equally many of each command".into();
                let (found, expected) = (values.len(), samples * held);
                return Err(Error::Length { name: name.clone(), found, expected, why });
            }
            if let Some((k, u)) = values.iter().enumerate().find(|(_, u)| !u.is_finite()) {
                return Err(Error::parameter(format!("{name}[{k}]"), *u, "a finite value"));
            }
            own.push(*values);
        }
        let layout = rig.layout();
        let (mut places, mut thermometers) = (Vec::new(), Vec::new());
        for (name, signal) in signals {
            let channel = rig.names().channels.iter().find(|(n, _)| n == name);
            if let Some((_, Channel::Temperature(k))) = channel {
                signal.check(name, samples)?;
                if let Some((j, t)) = signal.value.iter().enumerate().find(|(_, t)| **t <= 0.0) {
                    let allowed = "above absolute zero";
                    return Err(Error::parameter(format!("{name}.value[{j}]"), *t, allowed));
                }
                thermometers.push((*k, *signal));
                continue;
            }
            let place = channel.and_then(|(_, c)| match *c {
                Channel::Supply(k) => Some(layout.supply(k)),
                Channel::Pressure(k) => Some(layout.pressure(k)),
                Channel::Angle(k) => Some(layout.angle(k)),
                Channel::Length => Some(layout.angle(0)),
                _ => None,
            });
            let Some(place) = place else {
                return Err(Error::Model(format!(
                    "{name} is not a channel at which this rig can be cut"
                )));
            };
            signal.check(name, samples)?;
            places.push((place, *signal));
        }
        Ok(Self {
            samples,
            commands: own,
            held,
            signals: places,
            thermometers,
            outlets: Vec::new(),
            anchors: Vec::new(),
            input: None,
        })
    }

    /// The same, with regulators whose outlet nobody measured beginning at rest at these pressures
    /// [Pa, gauge] and not at that of what they feed.
    ///
    /// # Errors
    /// [`Error::Model`] for a supply that the rig does not have; [`Error::Parameter`] for a
    /// pressure that is no number above a vacuum.
    pub fn beginning(mut self, rig: &Rig, outlets: &[(&str, f64)]) -> Result<Self> {
        for (name, pressure) in outlets {
            let supplies = &rig.spec().supplies;
            let Some(k) = supplies.iter().position(|s| dotted("supply", &s.name) == *name) else {
                return Err(Error::Model(format!("no supply '{name}' in this rig")));
            };
            let absolute = pressure + rig.gas.ambient_pressure;
            if !absolute.is_finite() || absolute <= 0.0 {
                let allowed = "a finite pressure above a vacuum";
                return Err(Error::parameter(format!("outlets.{name}"), *pressure, allowed));
            }
            self.outlets.push((rig.layout().supply(k), absolute));
        }
        Ok(self)
    }

    /// What a regulator that begins at rest at a pressure of its own was set to until then [Pa,
    /// gauge].
    pub(crate) fn set_before(&self, rig: &Rig, input: usize) -> Option<f64> {
        if self.outlets.is_empty() {
            return None;
        }
        let spec = rig.spec();
        let mut regulators =
            spec.supplies.iter().enumerate().filter(|(_, s)| s.kind == "regulator");
        let (k, _) = regulators.nth(input.checked_sub(spec.valves.len())?)?;
        let told = self.outlets.iter().find(|(place, _)| *place == rig.layout().supply(k));
        told.map(|(_, pressure)| pressure - rig.gas.ambient_pressure)
    }

    /// The same, with the pressures of a block that predicts a temperature taken anew at these
    /// samples (rising) too, where no window of it begins: its temperature stays.
    ///
    /// # Errors
    /// [`Error::Parameter`] for samples that do not rise or that are not there.
    pub fn anchored(mut self, anchors: &[usize]) -> Result<Self> {
        let (rising, n) = (anchors.windows(2).all(|w| w[0] < w[1]), self.samples);
        if let Some(last) = anchors.last().filter(|last| !rising || **last >= n) {
            let allowed = format!("sample indices that rise, below {n}");
            return Err(Error::parameter("anchors", *last as f64, allowed));
        }
        self.anchors = anchors.to_vec();
        Ok(self)
    }

    /// The same, with an input of the block that nobody measured: a torque on the joint [N m], a
    /// force on the load [N], a mass flow into the gas or supply [kg/s]. It is linear between knots,
    /// so many samples apart from the beginning of each window to behind its end; `heights` has its
    /// value at each, window by window, or nothing where it is zero. The derivatives of a prediction
    /// with respect to them come last.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a spacing of 0, or a height that is not finite.
    pub fn with_input(mut self, spacing: usize, heights: &[f64]) -> Result<Self> {
        if spacing == 0 {
            return Err(Error::parameter("spacing", 0.0, "at least one sample"));
        }
        if let Some((k, v)) = heights.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(Error::parameter(format!("heights[{k}]"), *v, "a finite value"));
        }
        self.input = Some(Input { spacing, heights: heights.to_vec() });
        Ok(self)
    }

    /// Knots of each window of the input; none without one.
    pub(crate) fn knots(&self, starts: &[usize]) -> Vec<usize> {
        let ends = starts.iter().skip(1).copied().chain([self.samples]);
        let lengths = starts.iter().zip(ends).map(|(a, b)| b - a);
        self.input.iter().flat_map(|input| lengths.clone().map(|n| input.knots(n))).collect()
    }

    /// What the thermometer of a gas reads [K], where it has one.
    pub(crate) fn thermometer(&self, gas: usize) -> Option<&Signal<'a>> {
        self.thermometers.iter().find(|(k, _)| *k == gas).map(|(_, signal)| signal)
    }

    #[inline]
    pub(crate) fn signal(&self, place: usize) -> Option<&Signal<'a>> {
        self.signals.iter().find(|(p, _)| *p == place).map(|(_, signal)| signal)
    }
}
