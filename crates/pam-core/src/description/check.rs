//! Whether the words and fixed numbers of a description are possible. The bounds of a parameter
//! stand where it enters the table of parameters, and how blocks fit together is the wiring's: both
//! in [`crate::plant`].

use super::{dotted, ArmSpec, LinkSpec, LoadSpec, RigSpec};
use crate::blocks::joint::Joint;
use crate::error::check_range;
use crate::{Error, Result};

/// Most segments of a tube.
const MOST_SEGMENTS: usize = 256;

/// Checks one block's keys; names them in full only when there is something wrong.
struct Block<'a> {
    kind: &'a str,
    name: &'a str,
}

impl Block<'_> {
    fn range(&self, key: &str, value: f64, low: f64, high: f64, unit: &str) -> Result<()> {
        check_range(key, value, low, high, unit).map(|_| ()).or_else(|_| {
            let full = format!("{}.{key}", dotted(self.kind, self.name));
            check_range(&full, value, low, high, unit).map(|_| ())
        })
    }

    fn choice(&self, key: &str, value: &str, allowed: &[&str]) -> Result<()> {
        if allowed.contains(&value) {
            return Ok(());
        }
        let quoted: Vec<_> = allowed.iter().map(|a| format!("\"{a}\"")).collect();
        Err(Error::Choice {
            name: format!("{}.{key}", dotted(self.kind, self.name)),
            value: format!("\"{value}\""),
            allowed: format!("one of {}", quoted.join(", ")),
        })
    }
}

impl RigSpec {
    /// Check every value.
    ///
    /// # Errors
    /// [`Error::Parameter`] or [`Error::Choice`] naming the first impossible value.
    pub fn validate(&self) -> Result<()> {
        let gas = Block { kind: "gas", name: "" };
        gas.range("ambient_pressure", self.gas.ambient_pressure, 1e3, 1e6, "Pa")?;
        gas.range("temperature", self.gas.temperature, 150.0, 500.0, "K")?;
        gas.range("gas_constant", self.gas.gas_constant, 10.0, 5000.0, "J/(kg K)")?;
        gas.range("heat_capacity_ratio", self.gas.heat_capacity_ratio, 1.01, 1.7, "")?;
        self.check_air(-self.gas.ambient_pressure)?;
        for group in &self.muscles {
            group.muscle.validate()?;
            group.transmission.as_ref().map(Joint::new).transpose()?;
        }
        for joint in &self.joints {
            let block = Block { kind: "joint", name: &joint.name };
            joint.transmission.as_ref().map(Joint::new).transpose()?;
            block.range("stop_stiffness", joint.stop_stiffness, 0.0, 1e9, "N m/rad")?;
            block.range("stop_damping", joint.stop_damping, 0.0, 1e9, "N m s/rad")?;
            block.range("rest_angle", joint.rest_angle, -7.0, 7.0, "rad")?;
            let (low, high) = (joint.min_angle, joint.max_angle);
            block.range("min_angle", low, -7.0, high, "rad (below max_angle)")?;
            block.range("max_angle", high, low, 7.0, "rad")?;
        }
        if let Some(load) = &self.load {
            load.validate()?;
        }
        if let Some(arm) = &self.arm {
            arm.validate()?;
        }
        Ok(())
    }

    fn check_air(&self, vacuum: f64) -> Result<()> {
        for supply in &self.supplies {
            let block = Block { kind: "supply", name: &supply.name };
            block.choice("kind", &supply.kind, &["tank", "constant", "regulator"])?;
            block.range("initial_pressure", supply.initial_pressure, vacuum, 1e8, "Pa")?;
        }
        for valve in &self.valves {
            let block = Block { kind: "valve", name: &valve.name };
            block.choice("flow", &valve.flow, &["orifice", "iso_6358"])?;
            block.range("half_range", valve.half_range, 1e-9, 1e3, "V")?;
            block.choice("spool", &valve.spool, &["ideal", "second_order", "switching"])?;
            let closed = ["closed", "fill", "vent"];
            block.choice("without_current", &valve.without_current, &closed)?;
            valve.spool_form()?;
        }
        for line in &self.lines {
            let block = Block { kind: "line", name: &line.name };
            block.choice("kind", &line.kind, &["tube", "orifice"])?;
            let most = if line.kind == "tube" { MOST_SEGMENTS } else { 0 };
            block.range("segments", line.segments as f64, 0.0, most as f64, "")?;
        }
        for chamber in &self.chambers {
            let block = Block { kind: "chamber", name: &chamber.name };
            block.choice("gas", &chamber.gas, &["coefficients", "energy_balance"])?;
            block.range("initial_pressure", chamber.initial_pressure, vacuum, 1e8, "Pa")?;
        }
        Ok(())
    }
}

impl ArmSpec {
    fn validate(&self) -> Result<()> {
        let block = Block { kind: "arm", name: "" };
        block.choice("kind", &self.kind, &["one_link", "planar"])?;
        block.range("gravity", self.gravity, -1e3, 1e3, "m/s2")?;
        if self.kind == "planar" {
            return self.links.iter().try_for_each(LinkSpec::validate);
        }
        block.range("length", self.length, 0.0, 1e3, "m")?;
        block.range("coulomb_speed", self.coulomb_speed, 1e-9, 1e3, "rad/s")
    }
}

impl LinkSpec {
    fn validate(&self) -> Result<()> {
        let block = Block { kind: "link", name: &self.name };
        block.range("coulomb_speed", self.coulomb_speed, 1e-9, 1e3, "rad/s")
    }
}

impl LoadSpec {
    fn validate(&self) -> Result<()> {
        let block = Block { kind: "load", name: "" };
        block.choice("kind", &self.kind, &["mass", "frame"])?;
        block.range(
            "min_length",
            self.min_length,
            1e-3,
            self.max_length,
            "m (below load.max_length)",
        )?;
        block.range("max_length", self.max_length, self.min_length, 20.0, "m")?;
        if self.is_frame() {
            return Ok(());
        }
        block.range("coulomb_speed", self.coulomb_speed, 1e-9, 1e3, "m/s")?;
        block.range("gravity", self.gravity, -1e3, 1e3, "m/s2")?;
        block.range("stop_stiffness", self.stop_stiffness, 0.0, 1e12, "N/m")?;
        block.range("stop_damping", self.stop_damping, 0.0, 1e12, "N s/m")
    }
}
