//! Whether the values of a description are possible. How its blocks fit together is [`super::wiring`]'s.

use super::{dotted, ArmSpec, LinkSpec, LoadSpec, RigSpec};
use crate::blocks::joint::Joint;
use crate::error::check_range;
use crate::{Error, Result};

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
        for sensors in &self.sensors {
            let block = Block { kind: "sensors", name: &sensors.name };
            block.range("pressure_zero", sensors.pressure_zero, -1e7, 1e7, "Pa")?;
            block.range("angle_zero", sensors.angle_zero, -7.0, 7.0, "rad")?;
            block.range("length_zero", sensors.length_zero, -10.0, 10.0, "m")?;
        }
        Ok(())
    }

    fn check_air(&self, vacuum: f64) -> Result<()> {
        for supply in &self.supplies {
            let block = Block { kind: "supply", name: &supply.name };
            block.choice("kind", &supply.kind, &["tank", "constant", "regulator"])?;
            block.range("initial_pressure", supply.initial_pressure, vacuum, 1e8, "Pa")?;
            match supply.kind.as_str() {
                "tank" => block.range("volume", supply.volume, 1e-7, 1e4, "m3")?,
                "regulator" => {
                    block.range("time_constant", supply.time_constant, 1e-5, 1e3, "s")?;
                    block.range("droop", supply.droop, 0.0, 1e13, "Pa s/kg")?;
                }
                _ => {}
            }
        }
        for valve in &self.valves {
            let block = Block { kind: "valve", name: &valve.name };
            block.range("discharge_area_max", valve.discharge_area_max, 0.0, 1.0, "m2")?;
            block.range("null_voltage", valve.null_voltage, -1e3, 1e3, "V")?;
            block.range("half_range", valve.half_range, 1e-9, 1e3, "V")?;
        }
        for line in &self.lines {
            let block = Block { kind: "line", name: &line.name };
            block.choice("kind", &line.kind, &["tube", "orifice"])?;
            if line.kind == "tube" {
                block.range("length", line.length, 1e-4, 1e4, "m")?;
                block.range("diameter", line.diameter, 1e-5, 1.0, "m")?;
            } else {
                block.range("discharge_area", line.discharge_area, 0.0, 1.0, "m2")?;
            }
            block.range("inlet_volume", line.inlet_volume, 0.0, 1e3, "m3")?;
        }
        for chamber in &self.chambers {
            let block = Block { kind: "chamber", name: &chamber.name };
            let filled = self.muscles.iter().any(|m| m.chamber == dotted("chamber", &chamber.name));
            block.range("dead_volume", chamber.dead_volume, if filled { 0.0 } else { 1e-9 }, 1e4, "m3")?;
            block.range("initial_pressure", chamber.initial_pressure, vacuum, 1e8, "Pa")?;
            for (key, value) in
                [("alpha_in", chamber.alpha_in), ("alpha_out", chamber.alpha_out), ("alpha", chamber.alpha)]
            {
                block.range(key, value, 0.2, 3.0, "")?;
            }
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
        block.range("inertia", self.inertia, 0.0, 1e6, "kg m2")?;
        block.range("first_moment", self.first_moment, -1e6, 1e6, "kg m")?;
        block.range("length", self.length, 0.0, 1e3, "m")?;
        block.range("payload", self.payload, 0.0, 1e6, "kg")?;
        block.range("viscous", self.viscous, 0.0, 1e6, "N m s/rad")?;
        block.range("coulomb", self.coulomb, 0.0, 1e6, "N m")?;
        block.range("coulomb_speed", self.coulomb_speed, 1e-9, 1e3, "rad/s")?;
        let total = self.inertia + self.payload * self.length.powi(2);
        block.range("inertia + payload length^2", total, 1e-9, 1e9, "kg m2")
    }
}

impl LinkSpec {
    fn validate(&self) -> Result<()> {
        let block = Block { kind: "link", name: &self.name };
        block.range("length", self.length, 0.0, 1e3, "m")?;
        block.range("mass", self.mass, 0.0, 1e6, "kg")?;
        block.range("centre", self.centre, -1e3, 1e3, "m")?;
        block.range("inertia", self.inertia, 0.0, 1e6, "kg m2")?;
        block.range("payload", self.payload, 0.0, 1e6, "kg")?;
        block.range("viscous", self.viscous, 0.0, 1e6, "N m s/rad")?;
        block.range("coulomb", self.coulomb, 0.0, 1e6, "N m")?;
        block.range("coulomb_speed", self.coulomb_speed, 1e-9, 1e3, "rad/s")
    }
}

impl LoadSpec {
    fn validate(&self) -> Result<()> {
        let block = Block { kind: "load", name: "" };
        block.choice("kind", &self.kind, &["mass", "frame"])?;
        block.range("min_length", self.min_length, 1e-3, self.max_length, "m (below load.max_length)")?;
        block.range("max_length", self.max_length, self.min_length, 20.0, "m")?;
        if self.is_frame() {
            return Ok(());
        }
        block.range("mass", self.mass, 1e-6, 1e6, "kg")?;
        block.range("viscous", self.viscous, 0.0, 1e9, "N s/m")?;
        block.range("coulomb", self.coulomb, 0.0, 1e9, "N")?;
        block.range("coulomb_speed", self.coulomb_speed, 1e-9, 1e3, "m/s")?;
        block.range("gravity", self.gravity, -1e3, 1e3, "m/s2")?;
        block.range("stop_stiffness", self.stop_stiffness, 0.0, 1e12, "N/m")?;
        block.range("stop_damping", self.stop_damping, 0.0, 1e12, "N s/m")
    }
}
