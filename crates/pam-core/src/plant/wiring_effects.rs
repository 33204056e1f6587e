//! How the effects of a description fit into the blocks: which one acts where, and the numbers that it needs behind the states.

use super::parameters::ParameterId;
use super::units::{BodyUnit, SupplyUnit, Wiring};
use super::units_effects::{EffectUnits, SPOOL_EXTRAS};
use super::wiring::model;
use super::wiring_motion::coordinate_names;
use crate::description::{EffectSpec, RigSpec};
use crate::effects::{closure_flow, closure_torque, EffectInfo, EFFECTS};
use crate::{Error, Result};

/// Switch on every effect of a description.
pub(super) fn switch_on(spec: &RigSpec, wiring: &mut Wiring) -> Result<()> {
    for effect in &spec.effects {
        let Some(info) = EFFECTS.iter().find(|e| e.id == effect.id) else {
            let ids: Vec<_> = EFFECTS.iter().map(|e| e.id).collect();
            return model(format!("no effect '{}'; there are: {}", effect.id, ids.join(", ")));
        };
        if !has(spec, wiring, info) {
            return model(format!(
                "effect '{}' acts in the {}, and the rig has none",
                effect.id,
                info.at_or_arm()
            ));
        }
        let ids = parameters(effect, info, wiring)?;
        let place = Place { names: names(spec, info.at), effect };
        if !units(&mut wiring.effects, info.id, &ids) {
            return model(format!("effect '{}' is not in this build", effect.id));
        }
        if info.at.is_empty() && !effect.at.is_empty() {
            return model(format!(
                "effect '{}' acts at '{}', and it acts on the whole rig",
                effect.id, effect.at
            ));
        }
        if !info.at.is_empty() && !effect.at.is_empty() && !place.names.contains(&effect.at) {
            return model(format!(
                "effect '{}' acts at '{}', and the rig has no {} of that name",
                effect.id, effect.at, info.at
            ));
        }
        place.mark(info.id, wiring)?;
    }
    check_payload(wiring)
}

impl EffectInfo {
    fn at_or_arm(&self) -> &str {
        if self.at.is_empty() || self.block == "arm" {
            self.block
        } else {
            self.at
        }
    }
}

/// Whether the rig has anything that an effect can act on.
fn has(spec: &RigSpec, wiring: &Wiring, info: &EffectInfo) -> bool {
    match (info.id, info.block) {
        ("payload_change", _) => !matches!(wiring.body, BodyUnit::Fixed),
        (_, "arm" | "joint") => matches!(wiring.body, BodyUnit::OneLink { .. } | BodyUnit::Planar { .. }),
        _ => info.at.is_empty() || !names(spec, info.at).is_empty(),
    }
}

/// Names of the blocks of a kind; joints in the order of the coordinates.
fn names(spec: &RigSpec, kind: &str) -> Vec<String> {
    match kind {
        "supply" => spec.supplies.iter().map(|b| b.name.clone()).collect(),
        "valve" => spec.valves.iter().map(|b| b.name.clone()).collect(),
        "chamber" => spec.chambers.iter().map(|b| b.name.clone()).collect(),
        "muscle" => spec.muscles.iter().map(|b| b.name.clone()).collect(),
        "joint" => coordinate_names(spec),
        _ => Vec::new(),
    }
}

fn parameters(effect: &EffectSpec, info: &EffectInfo, wiring: &mut Wiring) -> Result<Vec<ParameterId>> {
    let mut ids = Vec::new();
    for parameter in info.parameters {
        let (name, unit) = (parameter.name, parameter.unit);
        let Some(value) = effect.parameters.get(name).copied() else {
            return model(format!("effect '{}' lacks its parameter '{name}' [{unit}]", effect.id));
        };
        let full = format!("{}.{name}", effect.id);
        if !(value.is_finite() && (parameter.lower..=parameter.upper).contains(&value)) {
            let allowed = match (parameter.lower, parameter.upper) {
                (0.0, f64::MAX) => format!("finite and not negative {unit}"),
                (lower, upper) => format!("from {lower} to {upper} {unit}"),
            };
            return Err(Error::parameter(full, value, allowed));
        }
        ids.push(wiring.parameters.add(full, value));
    }
    if let Some(unknown) = effect.parameters.keys().find(|k| info.parameters.iter().all(|p| p.name != *k)) {
        return model(format!("effect '{}' has no parameter '{unknown}'", effect.id));
    }
    Ok(ids)
}

/// Note the parameters of an effect; false for one that is not known here.
fn units(units: &mut EffectUnits, id: &str, ids: &[ParameterId]) -> bool {
    fn set<const N: usize>(slot: &mut Option<[ParameterId; N]>, ids: &[ParameterId]) -> bool {
        *slot = ids.try_into().ok();
        slot.is_some()
    }
    match id {
        "supply_leak" => set(&mut units.supply_leak, ids),
        "compressor_cut_in" => set(&mut units.compressor, ids),
        "supply_regulator_deadband" => set(&mut units.dead_band, ids),
        "valve_dead_zone" => set(&mut units.dead_zone, ids),
        "valve_hysteresis" => set(&mut units.play, ids),
        "valve_centre_leakage" => set(&mut units.centre_leak, ids),
        "input_path_lag" => set(&mut units.path, ids),
        "tube_flow_restriction" => set(&mut units.restriction, ids),
        "leak_muscle" => set(&mut units.leak, ids),
        "heat_transfer" => set(&mut units.heat, ids),
        "muscle_hysteresis" => set(&mut units.hysteresis, ids),
        "muscle_creep" => set(&mut units.creep, ids),
        "muscle_rate_damping" => set(&mut units.damping, ids),
        "activation_pressure" => set(&mut units.activation, ids),
        "mullins_softening" => set(&mut units.softening, ids),
        "pam_crowding_contact" => set(&mut units.crowding, ids),
        "joint_coulomb_stribeck" => set(&mut units.stribeck, ids),
        "joint_end_stop" => set(&mut units.stop, ids),
        "payload_swing" => set(&mut units.swing, ids),
        "payload_change" => set(&mut units.payload, ids),
        "external_torque" => set(&mut units.torque, ids),
        "base_flexibility" => set(&mut units.base, ids),
        "pressure_lag" => set(&mut units.pressure_lag, ids),
        "clock_skew" => set(&mut units.clock, ids),
        "closure_supply" => set(&mut units.closure_supply, ids),
        "closure_flow" => set(&mut units.closure_flow, ids),
        "closure_torque" => set(&mut units.closure_torque, ids),
        _ => false,
    }
}

/// Where one effect acts.
struct Place<'a> {
    names: Vec<String>,
    effect: &'a EffectSpec,
}

impl Place<'_> {
    fn here(&self, name: &str) -> bool {
        self.effect.at.is_empty() || name == self.effect.at
    }

    /// Link at whose end the payload is that an effect acts on: the one of the joint that it names, else the last.
    fn link(&self) -> usize {
        let last = self.names.len().saturating_sub(1);
        let named = self.names.iter().position(|name| *name == self.effect.at && !name.is_empty());
        named.unwrap_or(last)
    }

    /// Mark the blocks on which an effect acts, and give it the numbers that it needs.
    fn mark(&self, id: &str, wiring: &mut Wiring) -> Result<()> {
        let mut extras = wiring.extras;
        let mut take = |count: usize| {
            extras += count;
            extras - count
        };
        let mut found = true;
        match id {
            "supply_leak" | "compressor_cut_in" | "supply_regulator_deadband" | "closure_supply" => {
                let blocks = wiring.supply_effects.iter_mut().zip(&wiring.supplies).zip(&self.names);
                found = false;
                for ((unit, supply), _) in blocks.filter(|(_, name)| self.here(name)) {
                    let fits = match (id, supply) {
                        ("compressor_cut_in", SupplyUnit::Tank(_)) => {
                            unit.compressor = Some(take(1));
                            true
                        }
                        ("supply_regulator_deadband", SupplyUnit::Regulator { .. }) => {
                            unit.dead_band = true;
                            true
                        }
                        ("supply_leak", _) => {
                            unit.leak = true;
                            true
                        }
                        ("closure_supply", _) => {
                            unit.closure = Some(take(1));
                            true
                        }
                        _ => false,
                    };
                    found |= fits || self.effect.at.is_empty();
                }
            }
            "valve_dead_zone"
            | "valve_hysteresis"
            | "valve_centre_leakage"
            | "input_path_lag"
            | "tube_flow_restriction" => {
                let blocks = wiring.valves.iter_mut().zip(&self.names).enumerate();
                for (k, (valve, _)) in blocks.filter(|(_, (_, name))| self.here(name)) {
                    let unit = &mut valve.effects;
                    match id {
                        "valve_dead_zone" => unit.dead_zone = true,
                        "valve_hysteresis" => unit.play = true,
                        "valve_centre_leakage" => unit.centre_leak = true,
                        "input_path_lag" => unit.path = true,
                        _ => {
                            unit.restriction = true;
                            let tap = &mut wiring.gases[valve.to].tap;
                            *tap = tap.or_else(|| Some((k, take(1))));
                        }
                    }
                    if (unit.play || unit.path) && unit.spool.is_none() {
                        unit.spool = Some(take(SPOOL_EXTRAS));
                    }
                }
            }
            "leak_muscle" | "heat_transfer" | "pressure_lag" | "closure_flow" => {
                for (gas, _) in wiring.gases.iter_mut().zip(&self.names).filter(|(_, name)| self.here(name)) {
                    match id {
                        "leak_muscle" => gas.leak = true,
                        "heat_transfer" => gas.heat = true,
                        "closure_flow" => gas.closure = Some(take(closure_flow::STATES)),
                        _ => gas.lag = Some(take(1)),
                    }
                }
            }
            "muscle_hysteresis"
            | "muscle_creep"
            | "muscle_rate_damping"
            | "activation_pressure"
            | "mullins_softening"
            | "pam_crowding_contact" => {
                let blocks = wiring.groups.iter_mut().zip(&self.names).filter(|(_, name)| self.here(name));
                for (group, _) in blocks {
                    let unit = &mut group.effects;
                    unit.some = true;
                    match id {
                        "muscle_hysteresis" => unit.hysteresis = true,
                        "muscle_creep" => unit.creep = Some(take(1)),
                        "muscle_rate_damping" => unit.damping = true,
                        "activation_pressure" => unit.activation = true,
                        "mullins_softening" => unit.softening = true,
                        _ => unit.crowding = true,
                    }
                }
            }
            "joint_coulomb_stribeck" | "joint_end_stop" | "external_torque" | "closure_torque" => {
                let blocks =
                    wiring.coordinates.iter_mut().zip(&self.names).filter(|(_, name)| self.here(name));
                for (coordinate, _) in blocks {
                    match id {
                        "joint_coulomb_stribeck" => coordinate.effects.stribeck = true,
                        "joint_end_stop" => coordinate.effects.stop = true,
                        "closure_torque" => coordinate.effects.closure = Some(take(closure_torque::STATES)),
                        _ => coordinate.effects.torque = true,
                    }
                }
            }
            "payload_swing" => wiring.arm_effects.swing = Some((self.link(), take(2))),
            "payload_change" => wiring.arm_effects.payload = Some(self.link()),
            "base_flexibility" => wiring.arm_effects.base = Some(take(2)),
            _ => {}
        }
        wiring.extras = extras;
        if !found {
            return model(format!(
                "effect '{id}' acts at '{}', a supply of a kind that it does not act on",
                self.effect.at
            ));
        }
        Ok(())
    }
}

/// A payload must not become negative.
fn check_payload(wiring: &Wiring) -> Result<()> {
    let (Some([change, _]), Some(link)) = (wiring.effects.payload, wiring.arm_effects.payload) else {
        return Ok(());
    };
    let (now, least) = match &wiring.body {
        BodyUnit::OneLink { payload, .. } => (wiring.parameters.value(*payload), 0.0),
        BodyUnit::Planar { links, .. } => {
            (links.get(link).map_or(0.0, |l| wiring.parameters.value(l.payload)), 0.0)
        }
        BodyUnit::Mass { mass, .. } => (wiring.parameters.value(*mass), 1e-6),
        BodyUnit::Fixed => return Ok(()),
    };
    let value = wiring.parameters.value(change);
    if now + value < least {
        let allowed = format!("at least {} kg: no more can be taken away than is there", least - now);
        return Err(Error::parameter("payload_change.mass_change", value, allowed));
    }
    Ok(())
}
