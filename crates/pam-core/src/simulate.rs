//! Fixed-step simulation: the command is held over each sample, RK4 steps fill it.

use crate::error::check_range;
use crate::integrate::rk4;
use crate::rig::plant::{Memory, Plant, Simulated, State, ANGLE, MASS, PRESSURE, RATE, STATES, SUPPLY};
use crate::rig::{ParameterId as P, Rig};
use crate::scalar::Scalar;
use crate::{Error, Result};

/// Sample time and step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Sample time [s]: one output row and one held command each.
    pub sample_time: f64,
    /// RK4 steps per sample.
    pub substeps: usize,
}

impl Timing {
    /// Timing from a sample time and a step [s] that divides it.
    ///
    /// # Errors
    /// [`Error::Parameter`] when either is not positive or the step does not divide the sample time.
    pub fn new(sample_time: f64, step: f64) -> Result<Self> {
        if !(sample_time.is_finite() && sample_time > 0.0) {
            return Err(Error::parameter("sample_time", sample_time, "a finite time > 0 s"));
        }
        let ratio = sample_time / step;
        let rounded = ratio.round();
        let divides = (1.0..=1e7).contains(&rounded) && (ratio - rounded).abs() <= 1e-6 * rounded;
        if !(step.is_finite() && step > 0.0 && divides) {
            let allowed =
                format!("a time > 0 s that divides sample_time = {sample_time} s into 1 to 1e7 steps");
            return Err(Error::parameter("step", step, allowed));
        }
        Ok(Self { sample_time, substeps: rounded as usize })
    }

    /// Step [s].
    pub fn step(&self) -> f64 {
        self.sample_time / self.substeps as f64
    }
}

/// Initial state as a user states it: gauge pressures [Pa], angle [rad], rate [rad/s]; true values, not sensor readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Initial {
    /// Supply pressure [Pa, gauge].
    pub supply_pressure: f64,
    /// Muscle pressure [Pa, gauge].
    pub muscle_pressure: f64,
    /// Joint angle [rad].
    pub joint_angle: f64,
    /// Joint rate [rad/s].
    pub joint_rate: f64,
}

impl Initial {
    /// The rig at rest: muscles vented, joint at its rest angle, tank as filled.
    pub fn rest(rig: &Rig) -> Self {
        Self {
            supply_pressure: rig.spec().supply.as_ref().map_or(0.0, |s| s.initial_pressure),
            muscle_pressure: 0.0,
            joint_angle: rig.spec().joint.as_ref().map_or(0.0, |j| j.rest_angle),
            joint_rate: 0.0,
        }
    }

    fn validate(&self, rig: &Rig) -> Result<()> {
        let vacuum = -rig.gas.ambient_pressure;
        for (name, value) in [
            ("initial.supply_pressure", self.supply_pressure),
            ("initial.muscle_pressure", self.muscle_pressure),
        ] {
            check_range(name, value, vacuum, 1e8, "Pa (gauge)")?;
        }
        check_range("initial.joint_rate", self.joint_rate, -1e4, 1e4, "rad/s")?;
        if let (Some(load), Some(muscle)) = (&rig.spec().load, &rig.spec().muscle) {
            let length = muscle.rest_length - self.joint_angle;
            check_range("initial.length", length, load.min_length, load.max_length, "m")?;
            return Ok(());
        }
        let (low, high) =
            rig.spec().joint.as_ref().map_or((-7.0, 7.0), |j| (j.min_angle - 0.2, j.max_angle + 0.2));
        check_range("initial.joint_angle", self.joint_angle, low, high, "rad")?;
        Ok(())
    }
}

/// Simulated channels, one row per sample; row 0 is the initial state. Pressures gauge and as the sensors
/// read them (zeros included), SI.
#[allow(missing_docs)]
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trajectory {
    pub supply_pressure: Vec<f64>,
    pub muscle_pressure: Vec<f64>,
    pub joint_angle: Vec<f64>,
    pub joint_rate: Vec<f64>,
    pub contraction_ratio: Vec<f64>,
    pub air_volume: Vec<f64>,
    pub muscle_force: Vec<f64>,
    pub joint_torque: Vec<f64>,
    pub gas_temperature: Vec<f64>,
}

/// One RK4 step of a plant with the given states integrated; driven states are read from
/// `drive(fraction, &mut state)`.
#[inline]
pub(crate) fn step<S: Scalar>(
    plant: &Plant<'_, S>,
    state: &mut State<S>,
    memory: &mut Memory<S>,
    spool: S,
    dt: f64,
    simulated: Simulated,
    mut drive: impl FnMut(f64, &mut State<S>),
) {
    let mut here = *state;
    drive(0.0, &mut here);
    let start = plant.contraction(here[ANGLE]);
    let mut next = rk4(state, dt, |fraction, y| {
        let mut y = *y;
        drive(fraction, &mut y);
        plant.rates(&y, spool, memory, start, simulated)
    });
    drive(1.0, &mut next);
    *memory = plant.advance_memory(memory, start, plant.contraction(next[ANGLE]));
    *state = next;
}

/// Error for a state that has left the model's range, if it has.
pub(crate) fn check_state<S: Scalar>(plant: &Plant<'_, S>, state: &State<S>, time: f64) -> Result<()> {
    let rig = plant.rig();
    let failure = |name: &str, value: f64, allowed: &str| {
        Err(Error::Integration { time, name: name.into(), value, allowed: allowed.into() })
    };
    const NAMES: [&str; STATES] =
        ["supply_pressure", "muscle_pressure", "joint_angle", "joint_rate", "gas_mass"];
    for (index, name) in NAMES.iter().enumerate() {
        let value = state[index].re();
        if !value.is_finite() {
            return failure(name, value, "a finite value (a smaller step may help)");
        }
    }
    if state[PRESSURE].re() < 0.0 || state[SUPPLY].re() < 0.0 {
        let worst = if state[PRESSURE].re() < 0.0 { PRESSURE } else { SUPPLY };
        return failure(
            NAMES[worst],
            state[worst].re(),
            "an absolute pressure >= 0 Pa (a smaller step may help)",
        );
    }
    if let Some(joint) = &rig.joint {
        let angle = state[ANGLE].re();
        if !joint.reaches(angle) {
            return failure("joint_angle", angle, "an angle that the tendon reaches");
        }
        let contraction = plant.contraction(state[ANGLE]).re();
        if let Some(muscle) = rig.muscle().filter(|m| !m.table.contains(contraction)) {
            let allowed =
                format!("inside the muscle's range {:.4} to {:.4}", muscle.table.e_min, muscle.table.e_max);
            return failure("contraction_ratio", contraction, &allowed);
        }
    }
    Ok(())
}

/// A running simulation at a sample: all that its future depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    state: State<f64>,
    memory: Memory<f64>,
    samples: u64,
}

impl Progress {
    /// Length of [`Self::to_vec`].
    pub const NUMBERS: usize = STATES + Memory::<f64>::NUMBERS + 1;

    /// The start of a simulation.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an impossible initial value.
    pub fn start(rig: &Rig, initial: Initial) -> Result<Self> {
        initial.validate(rig)?;
        let ambient = rig.gas.ambient_pressure;
        let mut state = State::<f64>::from_column_slice(&[
            initial.supply_pressure + ambient,
            initial.muscle_pressure + ambient,
            initial.joint_angle,
            initial.joint_rate,
            0.0,
        ]);
        state[MASS] = Plant::new(rig, *rig.values()).initial_mass(&state);
        Ok(Self { state, memory: Memory::default(), samples: 0 })
    }

    /// Samples since the start.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The numbers that [`Self::from_slice`] makes the same progress of, bit for bit.
    #[must_use]
    pub fn to_vec(&self) -> Vec<f64> {
        let memory = self.memory.to_array();
        self.state.iter().chain(&memory).copied().chain([self.samples as f64]).collect()
    }

    /// Progress from the numbers of [`Self::to_vec`].
    ///
    /// # Errors
    /// [`Error::Length`] for another number of them, [`Error::Parameter`] for one that is not finite.
    pub fn from_slice(numbers: &[f64]) -> Result<Self> {
        if numbers.len() != Self::NUMBERS {
            return Err(Error::Length {
                name: "state".into(),
                found: numbers.len(),
                expected: Self::NUMBERS,
                why: "as it was read".into(),
            });
        }
        for (k, value) in numbers.iter().enumerate() {
            check_range(&format!("state[{k}]"), *value, -1e15, 1e15, "(as it was read)")?;
        }
        let (state, rest) = numbers.split_at(STATES);
        let (memory, samples) = rest.split_at(Memory::<f64>::NUMBERS);
        Ok(Self {
            state: State::from_column_slice(state),
            memory: Memory::from_slice(memory),
            samples: samples.first().map_or(0, |n| n.max(0.0) as u64),
        })
    }

    /// Append this sample to a trajectory.
    ///
    /// # Errors
    /// [`Error::Integration`] when the state has left the model's range.
    pub fn observe(&self, rig: &Rig, timing: Timing, out: &mut Trajectory) -> Result<()> {
        self.observed(&Plant::new(rig, *rig.values()), timing, out)
    }

    fn observed(&self, plant: &Plant<'_, f64>, timing: Timing, out: &mut Trajectory) -> Result<()> {
        check_state(plant, &self.state, self.samples as f64 * timing.sample_time)?;
        out.push(plant, &self.state, &self.memory);
        Ok(())
    }

    /// Hold each command [V] for one sample and append the sample after it. What is prescribed moves evenly to its
    /// value for the end of each sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a command that is not finite, [`Error::Integration`] when the state leaves the model's
    /// range; what was appended before stays, and the progress is that of the last good sample.
    pub fn advance(
        &mut self,
        rig: &Rig,
        timing: Timing,
        valve_command: &[f64],
        prescribed: Prescribed<'_>,
        out: &mut Trajectory,
    ) -> Result<()> {
        let plant = Plant::new(rig, *rig.values());
        let dt = timing.step();
        prescribed.validate(rig, valve_command.len())?;
        for (k, command) in valve_command.iter().enumerate() {
            if !command.is_finite() {
                return Err(Error::parameter(format!("valve_command[{k}]"), *command, "a finite voltage"));
            }
            let spool = plant.spool(*command);
            let mut next = *self;
            let ends = prescribed.ends(rig, &self.state, k);
            for sub in 0..timing.substeps {
                let (state, memory) = (&mut next.state, &mut next.memory);
                if ends.is_free() {
                    step(&plant, state, memory, spool, dt, Simulated::ALL, |_, _| {});
                } else {
                    step(&plant, state, memory, spool, dt, ends.simulated(), |fraction, y| {
                        let share = (sub as f64 + fraction) / timing.substeps as f64;
                        ends.drive(share, timing.sample_time, y);
                    });
                    if ends.pressure.is_some() {
                        // A regulator's air is at the temperature of the room.
                        next.state[MASS] = plant.rest_mass(&next.state);
                    }
                }
            }
            next.samples += 1;
            next.observed(&plant, timing, out)?;
            *self = next;
        }
        Ok(())
    }
}

/// Lowest absolute pressure that may be prescribed [Pa].
const LEAST_PRESSURE: f64 = 1.0;

/// Channels that are given instead of simulated, one value for the end of each sample.
#[derive(Debug, Clone, Copy, Default)]
pub struct Prescribed<'a> {
    /// Length of the muscle [m]: needed by a load frame, refused by other rigs.
    pub length: Option<&'a [f64]>,
    /// Gauge pressure in the muscle [Pa], as a regulator holds it: for rigs without a valve.
    pub pressure: Option<&'a [f64]>,
}

impl Prescribed<'_> {
    fn validate(&self, rig: &Rig, samples: usize) -> Result<()> {
        let frame = rig.spec().load.as_ref().filter(|load| load.is_frame());
        let model = |text: &str| Err(Error::Model(text.into()));
        match (frame, self.length) {
            (Some(_), None) => {
                return model("length is missing: a load frame needs one value per sample [m]")
            }
            (None, Some(_)) => {
                return model(
                    "length is given, which only a rig with a load frame takes ([load] kind = \"frame\")",
                )
            }
            (Some(load), Some(length)) => {
                check_signal("length", length, samples, (load.min_length, load.max_length), "m")?;
            }
            (None, None) => {}
        }
        if let Some(pressure) = self.pressure {
            if rig.spec().valve.is_some() {
                return model(
                    "pressure is given, which only a rig without [valve] takes: there the valve decides",
                );
            }
            check_signal(
                "pressure",
                pressure,
                samples,
                (LEAST_PRESSURE - rig.gas.ambient_pressure, 1e8),
                "Pa (gauge)",
            )?;
        }
        Ok(())
    }

    /// Where one sample begins and ends.
    fn ends(&self, rig: &Rig, state: &State<f64>, sample: usize) -> Ends {
        let rest = rig.spec().muscle.as_ref().map_or(0.0, |m| m.rest_length);
        let at = |signal: Option<&[f64]>| signal.and_then(|s| s.get(sample)).copied();
        Ends {
            shortening: at(self.length).map(|length| (state[ANGLE], rest - length)),
            pressure: at(self.pressure).map(|p| (state[PRESSURE], p + rig.gas.ambient_pressure)),
        }
    }
}

/// Prescribed channels over one sample: (from, to).
#[derive(Debug, Clone, Copy)]
struct Ends {
    shortening: Option<(f64, f64)>,
    pressure: Option<(f64, f64)>,
}

impl Ends {
    fn is_free(&self) -> bool {
        self.shortening.is_none() && self.pressure.is_none()
    }

    fn simulated(&self) -> Simulated {
        Simulated { arm: self.shortening.is_none(), chamber: self.pressure.is_none(), supply: true }
    }

    fn drive(&self, share: f64, sample_time: f64, state: &mut State<f64>) {
        if let Some((from, to)) = self.shortening {
            (state[ANGLE], state[RATE]) = (from + (to - from) * share, (to - from) / sample_time);
        }
        if let Some((from, to)) = self.pressure {
            state[PRESSURE] = from + (to - from) * share;
        }
    }
}

fn check_signal(
    name: &str,
    values: &[f64],
    samples: usize,
    (low, high): (f64, f64),
    unit: &str,
) -> Result<()> {
    if values.len() != samples {
        let why = "one for the end of each sample".into();
        return Err(Error::Length { name: name.into(), found: values.len(), expected: samples, why });
    }
    for (k, value) in values.iter().enumerate() {
        check_range(&format!("{name}[{k}]"), *value, low, high, unit)?;
    }
    Ok(())
}

/// Simulate `valve_command` [V], one value per sample, held; without a valve its values have no effect but
/// their number sets the duration.
///
/// # Errors
/// [`Error::Parameter`] for an impossible argument, [`Error::Integration`] when the state leaves the model's range.
pub fn simulate(rig: &Rig, valve_command: &[f64], timing: Timing, initial: Initial) -> Result<Trajectory> {
    let mut progress = Progress::start(rig, initial)?;
    let mut out = Trajectory::with_capacity(valve_command.len());
    if let Some((last, held)) = valve_command.split_last() {
        progress.observe(rig, timing, &mut out)?;
        progress.advance(rig, timing, held, Prescribed::default(), &mut out)?;
        if !last.is_finite() {
            return Err(Error::parameter(
                format!("valve_command[{}]", held.len()),
                *last,
                "a finite voltage",
            ));
        }
    }
    Ok(out)
}

impl Trajectory {
    /// An empty trajectory with room for `n` samples.
    #[must_use]
    pub fn with_capacity(n: usize) -> Self {
        let v = || Vec::with_capacity(n);
        Self {
            supply_pressure: v(),
            muscle_pressure: v(),
            joint_angle: v(),
            joint_rate: v(),
            contraction_ratio: v(),
            air_volume: v(),
            muscle_force: v(),
            joint_torque: v(),
            gas_temperature: v(),
        }
    }

    fn push(&mut self, plant: &Plant<'_, f64>, state: &State<f64>, memory: &Memory<f64>) {
        let ambient = plant.rig().gas.ambient_pressure;
        let (pressure_zero, angle_zero) = (plant.values()[P::PressureZero], plant.values()[P::AngleZero]);
        let output = plant.output(state, memory);
        self.supply_pressure.push(state[SUPPLY] - ambient);
        self.muscle_pressure.push(state[PRESSURE] - ambient + pressure_zero);
        self.joint_angle.push(state[ANGLE] + angle_zero);
        self.joint_rate.push(state[RATE]);
        self.contraction_ratio.push(output.contraction_ratio);
        self.air_volume.push(output.volume);
        self.muscle_force.push(output.force);
        self.joint_torque.push(output.torque);
        self.gas_temperature.push(output.temperature);
    }
}
