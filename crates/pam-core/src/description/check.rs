//! Whether the words and fixed numbers of a description are possible, by [`crate::keys`]. What a fit
//! may move is checked where it enters the table of parameters, and how blocks fit together is the wiring's: both
//! in [`crate::plant`].

use super::{dotted, ArmSpec, LinkSpec, LoadSpec, RigSpec};
use crate::blocks::joint::Joint;
use crate::error::check_range;
use crate::keys::Key;
use crate::{key, Result};

/// Checks one block's keys; names them in full only when there is something wrong.
struct Block<'a> {
    kind: &'a str,
    name: &'a str,
}

impl Block<'_> {
    fn full(&self, key: &Key) -> String {
        format!("{}.{}", dotted(self.kind, self.name), key.name)
    }

    fn number(&self, key: &Key, value: f64) -> Result<()> {
        key.check(key.name, value).or_else(|_| key.check(&self.full(key), value)).map(|_| ())
    }

    /// A number between limits that another value sets, besides the bounds of its key.
    fn within(&self, key: &Key, value: f64, low: f64, high: f64, note: &str) -> Result<()> {
        let (least, most, unit) = key.bounds();
        let (low, high) = (low.max(least), high.min(most));
        check_range(&self.full(key), value, low, high, &format!("{unit}{note}")).map(|_| ())
    }

    fn word(&self, key: &Key, value: &str) -> Result<()> {
        key.check_word(key.name, value).or_else(|_| key.check_word(&self.full(key), value))
    }
}

impl RigSpec {
    /// Check every value.
    ///
    /// # Errors
    /// [`Error::Parameter`] or [`Error::Choice`] naming the first impossible value.
    pub fn validate(&self) -> Result<()> {
        let gas = Block { kind: "gas", name: "" };
        gas.number(key!("gas", "ambient_pressure"), self.gas.ambient_pressure)?;
        gas.number(key!("gas", "temperature"), self.gas.temperature)?;
        gas.number(key!("gas", "gas_constant"), self.gas.gas_constant)?;
        gas.number(key!("gas", "heat_capacity_ratio"), self.gas.heat_capacity_ratio)?;
        self.check_air(-self.gas.ambient_pressure)?;
        for group in &self.muscles {
            group.muscle.validate()?;
            group.transmission.as_ref().map(Joint::new).transpose()?;
        }
        for joint in &self.joints {
            let block = Block { kind: "joint", name: &joint.name };
            joint.transmission.as_ref().map(Joint::new).transpose()?;
            block.number(key!("joint", "stop_stiffness"), joint.stop_stiffness)?;
            block.number(key!("joint", "stop_damping"), joint.stop_damping)?;
            block.number(key!("joint", "rest_angle"), joint.rest_angle)?;
            let (low, high) = (joint.min_angle, joint.max_angle);
            let below = " (below max_angle)";
            block.within(key!("joint", "min_angle"), low, f64::NEG_INFINITY, high, below)?;
            block.within(key!("joint", "max_angle"), high, low, f64::INFINITY, "")?;
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
            block.word(key!("supply", "kind"), &supply.kind)?;
            block.number(key!("supply", "initial_pressure"), supply.initial_pressure)?;
        }
        for valve in &self.valves {
            let block = Block { kind: "valve", name: &valve.name };
            block.word(key!("valve", "flow"), &valve.flow)?;
            block.number(key!("valve", "half_range"), valve.half_range)?;
            block.word(key!("valve", "spool"), &valve.spool)?;
            block.word(key!("valve", "without_current"), &valve.without_current)?;
            valve.spool_form()?;
        }
        for line in &self.lines {
            let block = Block { kind: "line", name: &line.name };
            block.word(key!("line", "kind"), &line.kind)?;
            let most = if line.kind == "tube" { f64::INFINITY } else { 0.0 };
            block.within(key!("line", "segments"), line.segments as f64, 0.0, most, "")?;
        }
        for chamber in &self.chambers {
            let block = Block { kind: "chamber", name: &chamber.name };
            block.word(key!("chamber", "gas"), &chamber.gas)?;
            let (initial, most) = (chamber.initial_pressure, f64::INFINITY);
            block.within(key!("chamber", "initial_pressure"), initial, vacuum, most, "")?;
        }
        Ok(())
    }
}

impl ArmSpec {
    fn validate(&self) -> Result<()> {
        let block = Block { kind: "arm", name: "" };
        block.word(key!("arm", "kind"), &self.kind)?;
        block.number(key!("arm", "gravity"), self.gravity)?;
        if self.kind == "planar" {
            return self.links.iter().try_for_each(LinkSpec::validate);
        }
        block.number(key!("arm", "length"), self.length)?;
        block.number(key!("arm", "coulomb_speed"), self.coulomb_speed)
    }
}

impl LinkSpec {
    fn validate(&self) -> Result<()> {
        let block = Block { kind: "link", name: &self.name };
        block.number(key!("link", "coulomb_speed"), self.coulomb_speed)
    }
}

impl LoadSpec {
    fn validate(&self) -> Result<()> {
        let block = Block { kind: "load", name: "" };
        block.word(key!("load", "kind"), &self.kind)?;
        let (low, high, below) = (self.min_length, self.max_length, " (below load.max_length)");
        block.within(key!("load", "min_length"), low, f64::NEG_INFINITY, high, below)?;
        block.within(key!("load", "max_length"), high, low, f64::INFINITY, "")?;
        if self.is_frame() {
            return Ok(());
        }
        block.number(key!("load", "coulomb_speed"), self.coulomb_speed)?;
        block.number(key!("load", "gravity"), self.gravity)?;
        block.number(key!("load", "stop_stiffness"), self.stop_stiffness)?;
        block.number(key!("load", "stop_damping"), self.stop_damping)
    }
}
