//! A rig: blocks in a chain, described by data, composed into one state equation.

pub mod parameters;
pub mod plant;
pub mod spec;

pub use parameters::{ParameterId, Values};
pub use plant::Plant;
pub use spec::RigSpec;

use crate::effects;
use crate::gas::orifice::Gas;
use crate::gas::valve::AreaTable;
use crate::joint::Joint;
use crate::muscle::{CompiledMuscle, Muscle};
use crate::{Error, Result};

/// A rig ready to be simulated: muscles compiled to a table, derived constants in place. Immutable.
#[derive(Debug, Clone)]
pub struct Rig {
    spec: RigSpec,
    pub(crate) gas: Gas,
    pub(crate) valve: Option<AreaTable>,
    pub(crate) muscle: Option<CompiledMuscle>,
    pub(crate) joint: Option<Joint>,
    pub(crate) values: Values<f64>,
    pub(crate) active: Active,
}

/// Which effects are switched on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Active {
    /// `leak_muscle`.
    pub leak: bool,
    /// `heat_transfer`.
    pub heat: bool,
    /// `muscle_hysteresis`.
    pub hysteresis: bool,
    /// The muscle's own force depends on the direction of motion.
    pub direction: bool,
}

impl Rig {
    /// Compile a rig from its description.
    ///
    /// # Errors
    /// As [`RigSpec::validate`]; [`Error::Model`] for an unknown effect or effect parameter.
    pub fn new(spec: RigSpec) -> Result<Self> {
        spec.validate()?;
        let muscle = spec.muscle.as_ref().map(|m| CompiledMuscle::new(Muscle::new(m)?)).transpose()?;
        Self::with_muscle(spec, muscle)
    }

    fn with_muscle(spec: RigSpec, muscle: Option<CompiledMuscle>) -> Result<Self> {
        let g = &spec.gas;
        let gas = Gas::new(g.ambient_pressure, g.temperature, g.gas_constant, g.heat_capacity_ratio);
        let valve = spec.valve.as_ref().map(|v| AreaTable::new(&v.opening, &v.fraction)).transpose()?;
        let joint = match (&spec.joint, &spec.load) {
            (Some(joint), _) => Some(Joint::new(joint)?),
            (None, Some(_)) => Some(Joint::Direct),
            (None, None) => None,
        };
        let (values, mut active) = collect_values(&spec)?;
        active.direction = muscle.as_ref().is_some_and(CompiledMuscle::has_direction);
        let rig = Self { gas, valve, muscle, joint, values, active, spec };
        rig.check_reach()?;
        rig.check_lengths()?;
        Ok(rig)
    }

    /// The joint's whole range must be within the reach of its tendon and of the muscle's table.
    fn check_reach(&self) -> Result<()> {
        if let (Some(joint), Some(muscle), Some(spec)) = (&self.joint, &self.muscle, &self.spec.joint) {
            for (name, angle) in [("joint.min_angle", spec.min_angle), ("joint.max_angle", spec.max_angle)] {
                if !joint.reaches(angle) {
                    return Err(Error::parameter(
                        name,
                        angle,
                        "an angle that the tendon reaches (it is too short)",
                    ));
                }
                let contraction = joint.eval(angle).shortening / muscle.exact.spec.rest_length;
                if !muscle.table.contains(contraction) {
                    let (low, high) = (muscle.table.e_min, muscle.table.e_max);
                    let allowed = format!("an angle that keeps the muscle's contraction ratio ({contraction:.4} here) from {low:.4} to {high:.4}");
                    return Err(Error::parameter(name, angle, allowed));
                }
            }
        }
        Ok(())
    }

    /// A linear load's whole range must be within the muscle's table.
    fn check_lengths(&self) -> Result<()> {
        if let (Some(load), Some(muscle)) = (&self.spec.load, &self.muscle) {
            let rest = muscle.exact.spec.rest_length;
            for (name, length) in [("load.min_length", load.min_length), ("load.max_length", load.max_length)]
            {
                if !muscle.table.contains(1.0 - length / rest) {
                    let (short, long) =
                        (rest * (1.0 - muscle.table.e_max), rest * (1.0 - muscle.table.e_min));
                    let allowed =
                        format!("a length that the muscle can have, from {short:.5} to {long:.5} m");
                    return Err(Error::parameter(name, length, allowed));
                }
            }
        }
        Ok(())
    }

    /// The same rig with other parameter values and effects; the muscle table is kept when the muscle's
    /// geometry and moduli are the same.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn respecified(&self, spec: RigSpec) -> Result<Self> {
        spec.validate()?;
        let tables =
            self.muscle.as_ref().zip(spec.muscle.as_ref()).and_then(|(old, new)| old.respecified(new));
        match tables {
            Some(muscle) => Self::with_muscle(spec, Some(muscle)),
            None => Self::new(spec),
        }
    }

    /// The description it was made from.
    pub fn spec(&self) -> &RigSpec {
        &self.spec
    }

    /// Effects that are switched on.
    pub fn active(&self) -> Active {
        self.active
    }

    /// The muscle with its compiled table, if the rig has one.
    pub fn muscle(&self) -> Option<&CompiledMuscle> {
        self.muscle.as_ref()
    }

    /// Values of all scalar parameters.
    pub fn values(&self) -> &Values<f64> {
        &self.values
    }
}

fn collect_values(spec: &RigSpec) -> Result<(Values<f64>, Active)> {
    use ParameterId as P;
    let mut values = Values::zero();
    if let Some(s) = &spec.supply {
        values.set(P::SupplyVolume, s.volume);
    }
    if let Some(v) = &spec.valve {
        values.set(P::DischargeArea, v.discharge_area_max);
        values.set(P::NullVoltage, v.null_voltage);
    }
    values.set(P::DeadVolume, spec.chamber.dead_volume);
    values.set(P::AlphaIn, spec.chamber.alpha_in);
    values.set(P::AlphaOut, spec.chamber.alpha_out);
    values.set(P::Alpha, spec.chamber.alpha);
    if let Some(m) = &spec.muscle {
        values.set(P::ModulusScale, m.modulus_scale);
    }
    if let Some(a) = &spec.arm {
        values.set(P::Inertia, a.inertia);
        values.set(P::FirstMoment, a.first_moment);
        values.set(P::Payload, a.payload);
        values.set(P::Viscous, a.viscous);
        values.set(P::Coulomb, a.coulomb);
    }
    values.set(P::PressureZero, spec.sensors.pressure_zero);
    values.set(P::AngleZero, spec.sensors.angle_zero);
    let mut active = Active::default();
    for effect in &spec.effects {
        let info = effects::EFFECTS.iter().find(|e| e.id == effect.id).ok_or_else(|| {
            let ids: Vec<_> = effects::EFFECTS.iter().map(|e| e.id).collect();
            Error::Model(format!("no effect '{}'; there are: {}", effect.id, ids.join(", ")))
        })?;
        if info.block == "muscle" && spec.muscle.is_none() {
            return Err(Error::Model(format!(
                "effect '{}' acts in the muscle, and the rig has none",
                effect.id
            )));
        }
        for (name, unit) in info.parameters {
            let value = effect.parameters.get(*name).copied().ok_or_else(|| {
                Error::Model(format!("effect '{}' lacks its parameter '{name}' [{unit}]", effect.id))
            })?;
            let dotted = format!("{}.{name}", effect.id);
            let id = ParameterId::from_name(&dotted)?;
            let positive = id == P::Presliding;
            if !value.is_finite() || value < 0.0 || (positive && value < 1e-9) {
                let allowed = if positive { "at least 1e-9" } else { "finite and not negative" };
                return Err(Error::parameter(dotted, value, format!("{allowed} {unit}")));
            }
            values.set(id, value);
        }
        if let Some(unknown) = effect.parameters.keys().find(|k| info.parameters.iter().all(|(n, _)| n != k))
        {
            return Err(Error::Model(format!("effect '{}' has no parameter '{unknown}'", effect.id)));
        }
        match info.id {
            "leak_muscle" => active.leak = true,
            "heat_transfer" => active.heat = true,
            _ => active.hysteresis = true,
        }
    }
    Ok((values, active))
}
