//! A rig as data: the description that a TOML file (read and unit-converted outside) comes down to.

mod check;

pub use crate::blocks::joint::TransmissionSpec;
use crate::blocks::supply::FASTEST;
use crate::effects::{spool, Form};
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

/// Where a flow begins or ends, as a description names it: `supply`, `chamber.flexor`,
/// `line.flexor`, `ambient`.
pub type Port = String;

/// Supply of air; initial pressure gauge [Pa].
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupplySpec {
    #[serde(default)]
    pub name: String,
    /// `tank`, `constant`, `regulator`, or `measured`: its pressure is given, or stays.
    pub kind: String,
    #[serde(default)]
    pub volume: f64,
    pub initial_pressure: f64,
    #[serde(default)]
    pub time_constant: f64,
    #[serde(default)]
    pub droop: f64,
    #[serde(default)]
    pub dead_time: f64,
    #[serde(default = "no_limit")]
    pub rise_limit: f64,
    #[serde(default = "no_limit")]
    pub fall_limit: f64,
    #[serde(default)]
    pub dead_band: f64,
    /// What its gauge reads too much.
    #[serde(default)]
    pub pressure_zero: f64,
    /// The supply in front of a regulator, empty where nothing limits it.
    #[serde(default)]
    pub inlet: Port,
}

fn no_limit() -> f64 {
    FASTEST
}

/// Valve from a supply (or a chamber: a manifold) to a chamber or the inlet of a line, and from
/// there to the ambient.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ValveSpec {
    #[serde(default)]
    pub name: String,
    pub from: Port,
    pub to: Port,
    /// `orifice` (one area) or `iso_6358` (conductance and critical ratio of either path).
    #[serde(default = "default_flow")]
    pub flow: String,
    #[serde(default)]
    pub discharge_area_max: f64,
    #[serde(default)]
    pub fill_conductance: f64,
    #[serde(default)]
    pub fill_critical_ratio: f64,
    #[serde(default)]
    pub vent_conductance: f64,
    #[serde(default)]
    pub vent_critical_ratio: f64,
    pub null_voltage: f64,
    pub half_range: f64,
    pub opening: Vec<f64>,
    pub fraction: Vec<f64>,
    /// `ideal` (it is where the command says), `second_order` or `switching`.
    #[serde(default = "default_spool")]
    pub spool: String,
    #[serde(default)]
    pub natural_frequency: f64,
    #[serde(default)]
    pub damping_ratio: f64,
    /// What is open with current where it switches: `fill`, `vent`, `closed`, or `either` of two
    /// coils.
    #[serde(default = "default_with_current")]
    pub with_current: String,
    /// What is open without.
    #[serde(default = "default_without_current")]
    pub without_current: String,
    #[serde(default)]
    pub opening_delay: f64,
    #[serde(default)]
    pub closing_delay: f64,
    #[serde(default)]
    pub carrier_frequency: f64,
    #[serde(default)]
    pub carrier_phase: f64,
}

impl ValveSpec {
    /// What the spool does by itself, if anything.
    ///
    /// # Errors
    /// [`Error::Choice`] for a valve that switches between two positions that no valve has.
    pub(crate) fn spool_form(&self) -> Result<Option<&'static Form>> {
        let (with, without) = (&self.with_current, &self.without_current);
        match self.spool.as_str() {
            "ideal" => Ok(None),
            "switching" => {
                spool::INFO.form(&format!("{with}_{without}")).map(Some).ok_or_else(|| {
                    let others: Vec<_> = (spool::INFO.forms.iter())
                        .filter_map(|form| form.name.strip_suffix(without.as_str()))
                        .filter_map(|with| with.strip_suffix('_'))
                        .map(|with| format!("\"{with}\""))
                        .collect();
                    Error::Choice {
                        name: format!("{}.with_current", dotted("valve", &self.name)),
                        value: format!("\"{with}\""),
                        allowed: format!(
                            "where without_current = \"{without}\" one of {}",
                            others.join(", ")
                        ),
                    }
                })
            }
            other => Ok(spool::INFO.form(other)),
        }
    }

    /// The value of a parameter of its spool.
    pub(crate) fn of_spool(&self, key: &str) -> f64 {
        match key {
            "natural_frequency" => self.natural_frequency,
            "damping_ratio" => self.damping_ratio,
            "opening_delay" => self.opening_delay,
            "closing_delay" => self.closing_delay,
            "carrier_frequency" => self.carrier_frequency,
            "carrier_phase" => self.carrier_phase,
            _ => f64::NAN,
        }
    }
}

fn default_spool() -> String {
    "ideal".into()
}

fn default_with_current() -> String {
    "fill".into()
}

fn default_without_current() -> String {
    "closed".into()
}

fn default_flow() -> String {
    "orifice".into()
}

/// Tube or orifice; an empty `from` means that valves feed an inlet node of its own. A tube of some
/// segments holds gas and carries waves: [`crate::blocks::wave`].
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineSpec {
    #[serde(default)]
    pub name: String,
    /// `tube` or `orifice`.
    pub kind: String,
    #[serde(default)]
    pub from: Port,
    pub to: Port,
    #[serde(default)]
    pub length: f64,
    #[serde(default)]
    pub diameter: f64,
    #[serde(default)]
    pub discharge_area: f64,
    #[serde(default)]
    pub inlet_volume: f64,
    /// What the gauge at its inlet reads too much.
    #[serde(default)]
    pub pressure_zero: f64,
    #[serde(default)]
    pub segments: usize,
    #[serde(default = "one")]
    pub alpha: f64,
}

/// Chamber: dead (or, without a muscle, total) volume; polytropic coefficients, or an energy balance
/// with heat from the wall; initial pressure gauge [Pa].
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChamberSpec {
    #[serde(default)]
    pub name: String,
    pub dead_volume: f64,
    #[serde(default)]
    pub initial_pressure: f64,
    /// `coefficients` or `energy_balance`.
    #[serde(default = "default_gas")]
    pub gas: String,
    #[serde(default = "one")]
    pub alpha_in: f64,
    #[serde(default = "one")]
    pub alpha_out: f64,
    #[serde(default = "one")]
    pub alpha: f64,
    #[serde(default)]
    pub heat_transfer_coefficient: f64,
}

fn default_gas() -> String {
    "coefficients".into()
}

fn one() -> f64 {
    1.0
}

/// Muscles of one kind that share a chamber and pull on one joint (`joint.elbow`, or `load`).
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MuscleGroupSpec {
    #[serde(default)]
    pub name: String,
    pub chamber: Port,
    pub joint: Port,
    /// In place of the joint's own.
    #[serde(default)]
    pub transmission: Option<TransmissionSpec>,
    pub muscle: MuscleSpec,
}

/// Joint with elastic stops, and how muscles pull on it that have no transmission of their own.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointSpec {
    #[serde(default)]
    pub name: String,
    #[serde(default)]
    pub transmission: Option<TransmissionSpec>,
    pub rest_angle: f64,
    pub min_angle: f64,
    pub max_angle: f64,
    pub stop_stiffness: f64,
    pub stop_damping: f64,
    /// Of a spring across the joint, and the angle at which it is at rest.
    #[serde(default)]
    pub stiffness: f64,
    #[serde(default)]
    pub spring_angle: f64,
}

/// Arm: `one_link` about the only joint, or `planar` links in series, base first.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmSpec {
    pub kind: String,
    #[serde(default)]
    pub inertia: f64,
    #[serde(default)]
    pub first_moment: f64,
    #[serde(default)]
    pub length: f64,
    #[serde(default)]
    pub payload: f64,
    #[serde(default)]
    pub viscous: f64,
    #[serde(default)]
    pub coulomb: f64,
    #[serde(default = "default_coulomb_speed")]
    pub coulomb_speed: f64,
    pub gravity: f64,
    /// Of the first link from the direction of gravity, where its joint's angle is zero.
    #[serde(default)]
    pub base_angle: f64,
    /// Of the centre of mass off the line from the joint to the payload.
    #[serde(default)]
    pub centre_angle: f64,
    #[serde(default)]
    pub links: Vec<LinkSpec>,
}

fn default_coulomb_speed() -> f64 {
    0.02
}

/// One link of a planar arm with the joint at its base.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkSpec {
    #[serde(default)]
    pub name: String,
    pub joint: Port,
    pub length: f64,
    pub mass: f64,
    pub centre: f64,
    pub inertia: f64,
    pub payload: f64,
    pub viscous: f64,
    pub coulomb: f64,
    pub coulomb_speed: f64,
}

/// Linear load on a muscle, in the place of joint and arm: a hanging `mass`, or a `frame` that
/// prescribes the length.
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
}

/// Constant sensor errors: measured = true + zero, of the force on a load measured = gain * true; of
/// the chamber or joint of its name, of all (and of a load) without a name. Supplies and inlets of lines have those of their gauges themselves.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorSpec {
    #[serde(default)]
    pub name: String,
    pub pressure_zero: f64,
    pub angle_zero: f64,
    #[serde(default)]
    pub length_zero: f64,
    #[serde(default = "one")]
    pub force_gain: f64,
}

/// An effect that is switched on, with its parameters.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectSpec {
    /// Identifier, see [`crate::effects::EFFECTS`].
    pub id: String,
    /// Name of the one block that it acts on; empty for every block of its kind.
    #[serde(default)]
    pub at: String,
    /// Its form; empty for the first one.
    #[serde(default)]
    pub form: String,
    /// Values by parameter name, SI.
    pub parameters: BTreeMap<String, f64>,
}

/// A rig: blocks and what joins them. SI units, radians.
#[allow(missing_docs)]
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigSpec {
    pub name: String,
    pub gas: GasSpec,
    #[serde(default)]
    pub supplies: Vec<SupplySpec>,
    #[serde(default)]
    pub valves: Vec<ValveSpec>,
    #[serde(default)]
    pub lines: Vec<LineSpec>,
    pub chambers: Vec<ChamberSpec>,
    #[serde(default)]
    pub muscles: Vec<MuscleGroupSpec>,
    #[serde(default)]
    pub joints: Vec<JointSpec>,
    pub arm: Option<ArmSpec>,
    pub load: Option<LoadSpec>,
    #[serde(default)]
    pub sensors: Vec<SensorSpec>,
    #[serde(default)]
    pub effects: Vec<EffectSpec>,
    /// What chambers and muscles bear [Pa, gauge], where it is known.
    #[serde(default)]
    pub max_pressure: Option<f64>,
}

impl RigSpec {
    /// Read a specification from JSON text.
    ///
    /// # Errors
    /// [`Error::Model`] for text that is not of this form (unknown keys included), and as
    /// [`Self::validate`].
    pub fn from_json(text: &str) -> Result<Self> {
        let spec: Self = serde_json::from_str(text)
            .map_err(|e| Error::Model(format!("rig description: {e}")))?;
        spec.validate()?;
        Ok(spec)
    }
}

/// `valve.flexor`, or `valve` for a block without a name.
#[must_use]
pub fn dotted(block: &str, name: &str) -> String {
    if name.is_empty() {
        block.into()
    } else {
        format!("{block}.{name}")
    }
}

/// Names of the coordinates (joints), in their order.
pub(crate) fn coordinate_names(spec: &RigSpec) -> Vec<String> {
    match &spec.arm {
        Some(arm) if arm.kind == "planar" => {
            let bare = |port: &str| {
                port.split_once('.').map_or(String::new(), |(_, name)| name.to_string())
            };
            arm.links.iter().map(|l| bare(&l.joint)).collect()
        }
        _ => spec.joints.iter().map(|j| j.name.clone()).collect(),
    }
}

/// Read a muscle on its own from JSON text.
///
/// # Errors
/// [`Error::Model`] for text that is not of this form; [`Error::Parameter`] for an impossible
/// value.
pub fn muscle_from_json(text: &str) -> Result<MuscleSpec> {
    let spec: MuscleSpec =
        serde_json::from_str(text).map_err(|e| Error::Model(format!("muscle description: {e}")))?;
    spec.validate()?;
    Ok(spec)
}
