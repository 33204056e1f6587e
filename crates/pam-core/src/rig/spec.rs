//! A rig as data: the description that a TOML file (read and unit-converted outside) comes down to.

use crate::error::check_range;
use crate::muscle::MuscleSpec;
use crate::{Error, Result};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Gas constants; pressures absolute [Pa], temperature [K].
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GasSpec {
    pub ambient_pressure: f64,
    pub temperature: f64,
    pub gas_constant: f64,
    pub heat_capacity_ratio: f64,
}

/// Supply tank; initial pressure gauge [Pa].
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupplySpec {
    pub volume: f64,
    pub initial_pressure: f64,
}

/// Proportional servo-valve.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ValveSpec {
    pub discharge_area_max: f64,
    pub null_voltage: f64,
    pub half_range: f64,
    pub opening: Vec<f64>,
    pub fraction: Vec<f64>,
}

/// Chamber: dead (or, without a muscle, total) volume and polytropic coefficients.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChamberSpec {
    pub dead_volume: f64,
    pub alpha_in: f64,
    pub alpha_out: f64,
    pub alpha: f64,
}

/// Joint with elastic stops; the lengths are those of its kind, see [`crate::joint::Joint`].
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointSpec {
    pub kind: String,
    #[serde(default)]
    pub upper_axial: f64,
    #[serde(default)]
    pub upper_offset: f64,
    #[serde(default)]
    pub lower_axial: f64,
    #[serde(default)]
    pub lower_offset: f64,
    #[serde(default)]
    pub radius: f64,
    #[serde(default)]
    pub coefficients: Vec<f64>,
    pub rest_angle: f64,
    pub min_angle: f64,
    pub max_angle: f64,
    pub stop_stiffness: f64,
    pub stop_damping: f64,
}

impl JointSpec {
    /// Read a joint on its own from JSON text.
    ///
    /// # Errors
    /// [`Error::Model`] for text that is not of this form (unknown keys included).
    pub fn from_json(text: &str) -> Result<Self> {
        serde_json::from_str(text).map_err(|e| Error::Model(format!("joint description: {e}")))
    }
}

/// One-link arm.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmSpec {
    pub inertia: f64,
    pub first_moment: f64,
    pub length: f64,
    pub payload: f64,
    pub viscous: f64,
    pub coulomb: f64,
    pub coulomb_speed: f64,
    pub gravity: f64,
}

/// Linear load on a muscle, in the place of joint and arm: a hanging `mass`, or a `frame` that prescribes the length.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadSpec {
    pub kind: String,
    #[serde(default)]
    pub mass: f64,
    #[serde(default)]
    pub viscous: f64,
    #[serde(default)]
    pub coulomb: f64,
    #[serde(default)]
    pub coulomb_speed: f64,
    #[serde(default)]
    pub gravity: f64,
    pub min_length: f64,
    pub max_length: f64,
    #[serde(default)]
    pub stop_stiffness: f64,
    #[serde(default)]
    pub stop_damping: f64,
}

impl LoadSpec {
    /// Whether the length is prescribed.
    #[must_use]
    pub fn is_frame(&self) -> bool {
        self.kind == "frame"
    }

    fn validate(&self) -> Result<()> {
        if !matches!(self.kind.as_str(), "mass" | "frame") {
            return Err(Error::Choice {
                name: "load.kind".into(),
                value: format!("\"{}\"", self.kind),
                allowed: "one of \"mass\", \"frame\"".into(),
            });
        }
        check_range("load.min_length", self.min_length, 1e-3, self.max_length, "m (below load.max_length)")?;
        check_range("load.max_length", self.max_length, self.min_length, 20.0, "m")?;
        if self.is_frame() {
            return Ok(());
        }
        check_range("load.mass", self.mass, 1e-6, 1e6, "kg")?;
        check_range("load.viscous", self.viscous, 0.0, 1e9, "N s/m")?;
        check_range("load.coulomb", self.coulomb, 0.0, 1e9, "N")?;
        check_range("load.coulomb_speed", self.coulomb_speed, 1e-9, 1e3, "m/s")?;
        check_range("load.gravity", self.gravity, -1e3, 1e3, "m/s2")?;
        check_range("load.stop_stiffness", self.stop_stiffness, 0.0, 1e12, "N/m")?;
        check_range("load.stop_damping", self.stop_damping, 0.0, 1e12, "N s/m")?;
        Ok(())
    }
}

/// Constant sensor errors: measured = true + zero.
#[allow(missing_docs)]
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorSpec {
    pub pressure_zero: f64,
    pub angle_zero: f64,
}

/// An effect that is switched on, with its parameters.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectSpec {
    /// Identifier, see [`crate::effects::EFFECTS`].
    pub id: String,
    /// Values by parameter name, SI.
    pub parameters: BTreeMap<String, f64>,
}

/// A rig: the chain supply - valve - chamber - muscle - joint - arm - sensors. SI units, radians.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigSpec {
    pub name: String,
    pub gas: GasSpec,
    pub supply: Option<SupplySpec>,
    pub valve: Option<ValveSpec>,
    pub chamber: ChamberSpec,
    pub muscle: Option<MuscleSpec>,
    pub joint: Option<JointSpec>,
    pub arm: Option<ArmSpec>,
    #[serde(default)]
    pub load: Option<LoadSpec>,
    pub sensors: SensorSpec,
    #[serde(default)]
    pub effects: Vec<EffectSpec>,
}

impl RigSpec {
    /// Read a specification from JSON text.
    ///
    /// # Errors
    /// [`Error::Model`] for text that is not of this form (unknown keys included), and as [`Self::validate`].
    pub fn from_json(text: &str) -> Result<Self> {
        let spec: Self =
            serde_json::from_str(text).map_err(|e| Error::Model(format!("rig description: {e}")))?;
        spec.validate()?;
        Ok(spec)
    }

    /// Check every value and that the blocks fit together.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the first impossible value; [`Error::Model`] for blocks that lack a neighbour.
    pub fn validate(&self) -> Result<()> {
        let range = |name: &str, value: f64, low: f64, high: f64, unit: &str| {
            check_range(name, value, low, high, unit).map(|_| ())
        };
        range("gas.ambient_pressure", self.gas.ambient_pressure, 1e3, 1e6, "Pa")?;
        range("gas.temperature", self.gas.temperature, 150.0, 500.0, "K")?;
        range("gas.gas_constant", self.gas.gas_constant, 10.0, 5000.0, "J/(kg K)")?;
        range("gas.heat_capacity_ratio", self.gas.heat_capacity_ratio, 1.01, 1.7, "")?;
        let vacuum = -self.gas.ambient_pressure;
        if let Some(supply) = &self.supply {
            range("supply.volume", supply.volume, 1e-7, 1e4, "m3")?;
            range("supply.initial_pressure", supply.initial_pressure, vacuum, 1e8, "Pa")?;
        }
        if let Some(valve) = &self.valve {
            range("valve.discharge_area_max", valve.discharge_area_max, 0.0, 1.0, "m2")?;
            range("valve.null_voltage", valve.null_voltage, -1e3, 1e3, "V")?;
            range("valve.half_range", valve.half_range, 1e-9, 1e3, "V")?;
        }
        let no_muscle = self.muscle.is_none();
        range(
            "chamber.dead_volume",
            self.chamber.dead_volume,
            if no_muscle { 1e-9 } else { 0.0 },
            1e4,
            "m3",
        )?;
        for (name, value) in [
            ("chamber.alpha_in", self.chamber.alpha_in),
            ("chamber.alpha_out", self.chamber.alpha_out),
            ("chamber.alpha", self.chamber.alpha),
        ] {
            range(name, value, 0.2, 3.0, "")?;
        }
        if let Some(muscle) = &self.muscle {
            muscle.validate()?;
        }
        if let Some(joint) = &self.joint {
            crate::joint::Joint::new(joint)?;
            range("joint.stop_stiffness", joint.stop_stiffness, 0.0, 1e9, "N m/rad")?;
            range("joint.stop_damping", joint.stop_damping, 0.0, 1e9, "N m s/rad")?;
            range("joint.min_angle", joint.min_angle, -7.0, joint.max_angle, "rad (below joint.max_angle)")?;
            range("joint.max_angle", joint.max_angle, joint.min_angle, 7.0, "rad")?;
        }
        if let Some(load) = &self.load {
            load.validate()?;
        }
        if let Some(arm) = &self.arm {
            range("arm.inertia", arm.inertia, 0.0, 1e6, "kg m2")?;
            range("arm.first_moment", arm.first_moment, -1e6, 1e6, "kg m")?;
            range("arm.length", arm.length, 0.0, 1e3, "m")?;
            range("arm.payload", arm.payload, 0.0, 1e6, "kg")?;
            range("arm.viscous", arm.viscous, 0.0, 1e6, "N m s/rad")?;
            range("arm.coulomb", arm.coulomb, 0.0, 1e6, "N m")?;
            range("arm.coulomb_speed", arm.coulomb_speed, 1e-9, 1e3, "rad/s")?;
            range("arm.gravity", arm.gravity, -1e3, 1e3, "m/s2")?;
            range(
                "arm.inertia + payload length^2",
                arm.inertia + arm.payload * arm.length.powi(2),
                1e-9,
                1e9,
                "kg m2",
            )?;
        }
        range("sensors.pressure_zero", self.sensors.pressure_zero, -1e7, 1e7, "Pa")?;
        range("sensors.angle_zero", self.sensors.angle_zero, -7.0, 7.0, "rad")?;
        self.check_chain()
    }

    fn check_chain(&self) -> Result<()> {
        let missing =
            |block: &str, needs: &str| Err(Error::Model(format!("a rig with [{block}] needs [{needs}]")));
        match (&self.supply, &self.valve) {
            (Some(_), None) => return missing("supply", "valve"),
            (None, Some(_)) => return missing("valve", "supply"),
            _ => {}
        }
        if self.load.is_some() {
            return match (&self.muscle, &self.joint, &self.arm) {
                (Some(_), None, None) => Ok(()),
                (None, ..) => missing("load", "muscle"),
                _ => Err(Error::Model("a rig has either [joint] and [arm] or [load], not both".into())),
            };
        }
        match (&self.muscle, &self.joint, &self.arm) {
            (Some(_), Some(_), Some(_)) | (None, None, None) => {}
            (_, None, Some(_)) => return missing("arm", "joint"),
            (None, Some(_), _) => return missing("joint", "muscle"),
            (_, Some(_), None) => return missing("joint", "arm"),
            (Some(_), None, None) => return missing("muscle", "joint] and [arm], or [load"),
        }
        Ok(())
    }
}

/// Read a muscle on its own from JSON text.
///
/// # Errors
/// [`Error::Model`] for text that is not of this form; [`Error::Parameter`] for an impossible value.
pub fn muscle_from_json(text: &str) -> Result<MuscleSpec> {
    let spec: MuscleSpec =
        serde_json::from_str(text).map_err(|e| Error::Model(format!("muscle description: {e}")))?;
    spec.validate()?;
    Ok(spec)
}
