//! Cut-chain simulation: measured signals drive a block, whose own output is predicted.
//!
//! Wherever a channel between two blocks was measured the chain is cut there (analytical redundancy), so that each block
//! has a residual of its own. Integrating blocks run over windows that start from the (smoothed) measurement;
//! the derivative with respect to the window's initial state comes along, so that its error can be projected out.

use crate::rig::parameters::unit;
use crate::rig::plant::{Memory, Plant, Simulated, State, ANGLE, MASS, PRESSURE, RATE, SUPPLY};
use crate::rig::{ParameterId as P, Rig};
use crate::scalar::{constant, Scalar};
use crate::simulate::{check_state, step, Timing};
use crate::{Error, Result};
use nalgebra::Const;
use num_dual::DualSVec64;

/// A block whose output channel is predicted from its measured neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// Command and chamber pressure to supply pressure.
    Supply,
    /// Command, supply pressure and angle to chamber pressure.
    Chamber,
    /// Chamber pressure to angle (muscle, joint and arm).
    Arm,
}

impl Block {
    /// The block of a name: `supply`, `chamber` or `arm`.
    ///
    /// # Errors
    /// [`Error::Model`] for another name.
    pub fn from_name(name: &str) -> Result<Self> {
        match name {
            "supply" => Ok(Self::Supply),
            "chamber" => Ok(Self::Chamber),
            "arm" => Ok(Self::Arm),
            _ => Err(Error::Model(format!("no block '{name}': supply, chamber, arm"))),
        }
    }

    fn simulated(self) -> Simulated {
        Simulated { supply: self == Self::Supply, chamber: self == Self::Chamber, arm: self == Self::Arm }
    }

    fn output(self) -> usize {
        match self {
            Self::Supply => SUPPLY,
            Self::Chamber => PRESSURE,
            Self::Arm => ANGLE,
        }
    }

    /// States of the block that a window starts from, in the order of their sensitivities.
    fn initial_states(self) -> &'static [usize] {
        match self {
            Self::Supply => &[SUPPLY],
            Self::Chamber => &[PRESSURE],
            Self::Arm => &[ANGLE, RATE],
        }
    }

    /// Number of initial states per window.
    pub fn initial_count(self) -> usize {
        self.initial_states().len()
    }
}

/// A measured signal, smoothed, with its time derivative at each sample; as the sensor reads it, SI, gauge.
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

    /// Cubic Hermite value and derivative at a fraction of sample `k`.
    #[inline]
    fn at(&self, k: usize, fraction: f64, dt: f64) -> (f64, f64) {
        let (p0, m0) = (self.value[k], self.slope[k] * dt);
        let next = (k + 1).min(self.value.len() - 1);
        let (p1, m1) = (self.value[next], self.slope[next] * dt);
        let (t, t2) = (fraction, fraction * fraction);
        let t3 = t2 * t;
        let value = p0 + m0 * (t - 2.0 * t2 + t3) + (p1 - p0) * (3.0 * t2 - 2.0 * t3) + m1 * (t3 - t2);
        let slope = m0 * (1.0 - 4.0 * t + 3.0 * t2) + (p1 - p0) * 6.0 * (t - t2) + m1 * (3.0 * t2 - 2.0 * t);
        (value, slope / dt)
    }
}

/// Measured signals around a block; a channel that was not measured is `None`.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// Valve command [V], held over each sample.
    pub valve_command: &'a [f64],
    /// Supply pressure [Pa, gauge].
    pub supply_pressure: Option<Signal<'a>>,
    /// Muscle pressure [Pa, gauge].
    pub muscle_pressure: Option<Signal<'a>>,
    /// Joint angle [rad].
    pub joint_angle: Option<Signal<'a>>,
}

/// Prediction of a block's output with its sensitivities.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Predicted output at each sample, as the sensor reads it.
    pub value: Vec<f64>,
    /// Row-major `samples x (parameters + initial states)`: derivatives with respect to each parameter and to the
    /// initial states of the window that the row belongs to.
    pub jacobian: Vec<f64>,
    /// Columns of the jacobian.
    pub columns: usize,
}

const LANES: usize = 8;

/// Predict a block's output over windows.
///
/// `starts` are the sample indices at which windows begin (rising, the first one 0). `parameters` are those to
/// differentiate with respect to; pass none for values alone (`columns` is then 0).
///
/// # Errors
/// [`Error::Length`], [`Error::Parameter`] for bad arguments; [`Error::Model`] when the block lacks a measured neighbour;
/// [`Error::Integration`] when the state leaves the model's range.
pub fn predict(
    rig: &Rig,
    block: Block,
    measured: &Measured<'_>,
    timing: Timing,
    starts: &[usize],
    parameters: &[P],
) -> Result<Prediction> {
    let n = measured.valve_command.len();
    check(rig, block, measured, starts, n)?;
    let mut out = Prediction { value: vec![0.0; n], jacobian: Vec::new(), columns: 0 };
    if parameters.is_empty() {
        let plant = Plant::new(rig, *rig.values());
        run(&plant, block, measured, timing, starts, &[0.0; 2], |k, y| out.value[k] = y)?;
        return Ok(out);
    }
    out.columns = parameters.len() + block.initial_count();
    out.jacobian = vec![0.0; n * out.columns];
    let columns: Vec<usize> = (0..out.columns).collect();
    for chunk in columns.chunks(LANES) {
        let mut values = rig.values().lift::<DualSVec64<LANES>>();
        let mut bumps = [constant::<DualSVec64<LANES>>(0.0); 2];
        for (lane, column) in chunk.iter().enumerate() {
            match parameters.get(*column) {
                Some(id) => values.seed(*id, lane),
                None => bumps[column - parameters.len()].eps = unit(lane),
            }
        }
        let plant = Plant::new(rig, values);
        let (value, jacobian, width) = (&mut out.value, &mut out.jacobian, out.columns);
        run(&plant, block, measured, timing, starts, &bumps, |k, y| {
            value[k] = y.re;
            let gradient = y.eps.unwrap_generic(Const::<LANES>, Const::<1>);
            for (column, slope) in chunk.iter().zip(gradient.iter()) {
                jacobian[k * width + column] = *slope;
            }
        })?;
    }
    Ok(out)
}

fn check(rig: &Rig, block: Block, measured: &Measured<'_>, starts: &[usize], n: usize) -> Result<()> {
    if let Some((k, u)) = measured.valve_command.iter().enumerate().find(|(_, u)| !u.is_finite()) {
        return Err(Error::parameter(format!("valve_command[{k}]"), *u, "a finite voltage"));
    }
    if starts.first() != Some(&0)
        || starts.windows(2).any(|w| w[1] <= w[0])
        || starts.last().is_some_and(|s| *s >= n)
    {
        let worst = starts.last().copied().unwrap_or(0) as f64;
        return Err(Error::parameter("starts", worst, format!("sample indices rising from 0, below {n}")));
    }
    let spec = rig.spec();
    let lacks = |what: &str| Err(Error::Model(format!("block '{block:?}' cannot be predicted: {what}")));
    for (name, signal) in [
        ("supply_pressure", &measured.supply_pressure),
        ("muscle_pressure", &measured.muscle_pressure),
        ("joint_angle", &measured.joint_angle),
    ] {
        if let Some(signal) = signal {
            signal.check(name, n)?;
        }
    }
    if measured.muscle_pressure.is_none() {
        return lacks("muscle_pressure was not measured");
    }
    match block {
        _ if spec.load.is_some() => lacks("a linear load cannot be cut from its muscle yet"),
        Block::Supply if spec.supply.is_none() => lacks("the rig has no supply"),
        Block::Supply | Block::Chamber if spec.valve.is_some() && measured.supply_pressure.is_none() => {
            lacks("supply_pressure was not measured")
        }
        Block::Arm if spec.arm.is_none() => lacks("the rig has no arm"),
        _ if spec.arm.is_some() && measured.joint_angle.is_none() => lacks("joint_angle was not measured"),
        _ => Ok(()),
    }
}

/// True state from measured signals at a fraction of sample `k`; `keep` tells which states are not driven.
#[inline]
fn drive<S: Scalar>(
    plant: &Plant<'_, S>,
    measured: &Measured<'_>,
    k: usize,
    fraction: f64,
    dt: f64,
    keep: Simulated,
    state: &mut State<S>,
) {
    let ambient = plant.rig().gas.ambient_pressure;
    if let (false, Some(signal)) = (keep.supply, &measured.supply_pressure) {
        state[SUPPLY] = constant(signal.at(k, fraction, dt).0 + ambient);
    }
    if let (false, Some(signal)) = (keep.chamber, &measured.muscle_pressure) {
        state[PRESSURE] = -plant.values()[P::PressureZero] + (signal.at(k, fraction, dt).0 + ambient);
    }
    if let (false, Some(signal)) = (keep.arm, &measured.joint_angle) {
        let (angle, rate) = signal.at(k, fraction, dt);
        state[ANGLE] = -plant.values()[P::AngleZero] + angle;
        state[RATE] = constant(rate);
    }
}

fn run<S: Scalar>(
    plant: &Plant<'_, S>,
    block: Block,
    measured: &Measured<'_>,
    timing: Timing,
    starts: &[usize],
    bumps: &[S; 2],
    mut sink: impl FnMut(usize, S),
) -> Result<()> {
    let simulated = block.simulated();
    let (dt, ambient) = (timing.sample_time, plant.rig().gas.ambient_pressure);
    let nothing = Simulated { supply: false, chamber: false, arm: false };
    let output = block.output();
    let offset: S = match block {
        Block::Supply => constant(-ambient),
        Block::Chamber => plant.values()[P::PressureZero] - ambient,
        Block::Arm => plant.values()[P::AngleZero],
    };
    let n = measured.valve_command.len();
    let mut memory = Memory::default();
    let mut state = State::<S>::from_element(constant(0.0));
    let mut starts = starts.iter().peekable();
    for k in 0..n {
        if starts.next_if(|s| **s == k).is_some() {
            let before = state;
            drive(plant, measured, k, 0.0, dt, nothing, &mut state);
            for (index, bump) in block.initial_states().iter().zip(bumps) {
                state[*index] += *bump;
            }
            let rest = plant.rest_mass(&state);
            if k == 0 {
                state[MASS] = plant.initial_mass(&state);
            } else {
                // a new window keeps the gas temperature and the memory of the motion
                let was = plant.rest_mass(&before);
                state[MASS] = rest * before[MASS] / was;
                memory = plant.advance_memory(
                    &memory,
                    plant.contraction(before[ANGLE]),
                    plant.contraction(state[ANGLE]),
                );
            }
        }
        check_state(plant, &state, k as f64 * dt)?;
        sink(k, state[output] + offset);
        if k + 1 == n {
            break;
        }
        let spool = plant.spool(measured.valve_command[k]);
        let h = 1.0 / timing.substeps as f64;
        for i in 0..timing.substeps {
            step(plant, &mut state, &mut memory, spool, timing.step(), simulated, |fraction, y| {
                drive(plant, measured, k, (i as f64 + fraction) * h, dt, simulated, y);
            });
        }
    }
    Ok(())
}
