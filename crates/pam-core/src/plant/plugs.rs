//! Which effect acts where: each is plugged into the ports of the blocks that it was put on.

use super::parameters::Parameters;
use super::ports::{Acting, Flow, Instance, MusclePorts, Place, Ports};
use super::units::{BodyUnit, Node, Path, SupplyUnit};
use super::wired::Wiring;
use crate::description::{coordinate_names, dotted, EffectSpec, RigSpec};
use crate::effects::{spool, EffectInfo, Port, Role};
use crate::error::model;
use crate::Result;

/// Name of a block, empty where it has none.
fn block_name(spec: &RigSpec, wiring: &Wiring, place: Place) -> String {
    match place {
        Place::Supply(k) => spec.supplies[k].name.clone(),
        Place::Valve(k) => spec.valves[k].name.clone(),
        Place::Line(k) => spec.lines[k].name.clone(),
        Place::Gas(k) if k < wiring.chambers => spec.chambers[k].name.clone(),
        Place::Gas(k) => spec.lines[wiring.inlets[k - wiring.chambers].0].name.clone(),
        Place::Group(k) => spec.muscles[k].name.clone(),
        Place::Joint(k) => coordinate_names(spec).get(k).cloned().unwrap_or_default(),
        Place::Whole => String::new(),
    }
}

/// Switch on every effect of a description; `known` are all that there are.
pub(super) fn switch_on(
    spec: &RigSpec,
    known: &[&'static EffectInfo],
    table: &mut Parameters,
    wiring: &mut Wiring,
) -> Result<()> {
    let mut ports = Ports {
        command: vec![Vec::new(); wiring.valves.len()],
        late: vec![Vec::new(); wiring.valves.len()],
        switching: vec![None; wiring.valves.len()],
        area: vec![None; wiring.valves.len()],
        passage: vec![None; wiring.valves.len()],
        law: vec![None; wiring.lines.len()],
        feed: vec![Vec::new(); wiring.supplies.len()],
        balance: vec![None; wiring.gases.len()],
        reading: vec![None; wiring.gases.len()],
        thermometer: vec![None; wiring.gases.len()],
        tap: vec![None; wiring.gases.len()],
        muscles: vec![MusclePorts::default(); wiring.groups.len()],
        torque: vec![Vec::new(); wiring.coordinates.len()],
        push: vec![Vec::new(); wiring.coordinates.len()],
        weight: vec![Vec::new(); wiring.coordinates.len()],
        encoder: vec![None; wiring.coordinates.len()],
        gauge_zero: vec![None; wiring.gases.len()],
        ..Ports::default()
    };
    let mut places = Vec::new();
    for effect in &spec.effects {
        let info = find(known, &effect.id)?;
        let instance = instance(spec, effect, info, table)?;
        places.push(acted_on(spec, wiring, effect, info)?);
        ports.effects.push(instance);
    }
    twice(spec, wiring, &ports.effects, &places)?;
    for (k, valve) in wiring.valves.iter().enumerate() {
        if let Some((form, parameters)) = &valve.spool {
            let (name, parameters) = (spool::INFO.id.to_string(), parameters.clone());
            ports.effects.push(Instance { info: &spool::INFO, form, name, parameters });
            places.push(vec![Place::Valve(k)]);
        }
    }
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by_key(|k| ports.effects[*k].info.order);
    for effect in order {
        for place in &places[effect] {
            let count = ports.effects[effect].form.states.len();
            let acting = Acting { effect, first: ports.states, count };
            ports.states += count;
            ports.all.push((*place, acting));
            for port in ports.effects[effect].form.ports {
                ports.plug(*port, *place, acting, wiring, spec)?;
            }
        }
    }
    wiring.ports = ports;
    Ok(())
}

fn find(known: &[&'static EffectInfo], id: &str) -> Result<&'static EffectInfo> {
    match known.iter().find(|e| e.id == id) {
        Some(info) => Ok(info),
        None => {
            let ids: Vec<_> = known.iter().map(|e| e.id).collect();
            model(format!("no effect '{id}'; there are: {}", ids.join(", ")))
        }
    }
}

/// An effect with its values among the parameters of the rig.
fn instance(
    spec: &RigSpec,
    effect: &EffectSpec,
    info: &'static EffectInfo,
    table: &mut Parameters,
) -> Result<Instance> {
    let Some(form) = info.form(&effect.form) else {
        let names: Vec<_> = info.forms.iter().map(|f| format!("\"{}\"", f.name)).collect();
        let (form, names) = (&effect.form, names.join(", "));
        return model(format!("effect '{}' has no form \"{form}\"; one of {names}", effect.id));
    };
    let alone = spec.effects.iter().filter(|e| e.id == effect.id).count() == 1;
    let full = dotted(&effect.id, &effect.at);
    let name = if alone { effect.id.clone() } else { full.clone() };
    let mut parameters = Vec::new();
    for parameter in form.parameters {
        let (key, unit) = (parameter.name, parameter.unit);
        let Some(value) = effect.parameters.get(key).copied() else {
            return model(format!("effect '{}' lacks its parameter '{key}' [{unit}]", effect.id));
        };
        let id = table.add_between(
            format!("{name}.{key}"),
            value,
            (parameter.lower, parameter.upper, unit),
        )?;
        table.also(format!("{full}.{key}"), id);
        parameters.push(id);
    }
    if let Some(unknown) =
        effect.parameters.keys().find(|k| form.parameters.iter().all(|p| p.name != *k))
    {
        return model(format!("effect '{}' has no parameter '{unknown}'", effect.id));
    }
    Ok(Instance { info, form, name, parameters })
}

/// The blocks that an effect acts on.
fn acted_on(
    spec: &RigSpec,
    wiring: &Wiring,
    effect: &EffectSpec,
    info: &EffectInfo,
) -> Result<Vec<Place>> {
    let names = names(spec, info.at);
    if !has(wiring, info, &names) {
        return model(lacking(wiring, info));
    }
    if info.at.is_empty() {
        if !effect.at.is_empty() {
            return model(format!(
                "effect '{}' acts at '{}', and it acts on the whole rig",
                effect.id, effect.at
            ));
        }
        return Ok(vec![Place::Whole]);
    }
    if !effect.at.is_empty() && !names.contains(&effect.at) {
        return model(format!(
            "effect '{}' acts at '{}', and the rig has no {} of that name",
            effect.id, effect.at, info.at
        ));
    }
    let here = |k: &usize| match (effect.at.is_empty(), info.last_only) {
        (true, true) => *k + 1 == names.len(),
        (true, false) => true,
        (false, _) => names[*k] == effect.at,
    };
    // A load has no joint of a name, and an effect on its mass acts there.
    let blocks = names.len().max(usize::from(info.on_loads));
    let chosen = (0..blocks).filter(|k| names.is_empty() || here(k));
    let fits =
        |k: &usize| info.supplies.is_empty() || fits_supply(&wiring.supplies[*k], info.supplies);
    let own_energy = |k: &usize| info.frees_mass && wiring.gases[*k].has_energy();
    let places: Vec<Place> = chosen
        .filter(|k| info.at != "supply" || fits(k))
        .filter(|k| info.at != "line" || matches!(wiring.lines[*k].path, Path::Orifice(_)))
        .filter(|k| !own_energy(k))
        .map(|k| place(info.at, k))
        .collect();
    if places.is_empty() && info.frees_mass {
        return model(format!(
            "effect '{}' acts on a chamber of the kind coefficients, and what it would act on has \
            an energy balance of its own: its heat_transfer_coefficient is a parameter",
            effect.id
        ));
    }
    if places.is_empty() && info.at == "line" {
        let id = effect.id.as_str();
        return model(format!(
            "effect '{id}' acts on a line of the kind orifice, and none is here"
        ));
    }
    if places.is_empty() {
        return model(other_supplies(spec, wiring, info, &effect.at));
    }
    Ok(places)
}

/// That the rig has no block of the kind that an effect acts on.
fn lacking(wiring: &Wiring, info: &EffectInfo) -> String {
    let place = match info {
        _ if info.on_loads => "a joint or the mass of a load",
        _ if info.block == "arm" => "an arm",
        _ => &format!("a {}", info.at),
    };
    let there = match wiring.body {
        _ if !(info.on_loads || info.block == "arm" || info.block == "joint") => "has none",
        BodyUnit::Mass { .. } => "has a load instead",
        _ => "has nothing that moves",
    };
    format!("effect '{}' acts on {place}, and the rig {there}", info.id)
}

/// That no supply, or not the one of a name, is of a kind that an effect acts on.
fn other_supplies(spec: &RigSpec, wiring: &Wiring, info: &EffectInfo, at: &str) -> String {
    let there: Vec<_> = (spec.supplies.iter().zip(&wiring.supplies))
        .filter(|(supply, _)| at.is_empty() || supply.name == at)
        .map(|(supply, unit)| {
            format!("{} is a {}", dotted("supply", &supply.name), supply_kind(unit))
        })
        .collect();
    let (kinds, there) = (info.supplies.join(" or "), there.join(", "));
    format!("effect '{}' acts on a supply of the kind {kinds}, and {there}", info.id)
}

fn supply_kind(supply: &SupplyUnit) -> &'static str {
    match supply {
        SupplyUnit::Tank(_) => "tank",
        SupplyUnit::Constant => "constant",
        SupplyUnit::Regulator { .. } => "regulator",
    }
}

fn fits_supply(supply: &SupplyUnit, kinds: &[&str]) -> bool {
    kinds.contains(&supply_kind(supply))
}

/// The supply or gas at a place.
fn node(place: Place) -> Node {
    match place {
        Place::Supply(k) => Node::Supply(k),
        Place::Gas(k) => Node::Gas(k),
        _ => Node::Ambient,
    }
}

fn place(kind: &str, k: usize) -> Place {
    match kind {
        "supply" => Place::Supply(k),
        "valve" => Place::Valve(k),
        "line" => Place::Line(k),
        "chamber" => Place::Gas(k),
        "muscle" => Place::Group(k),
        _ => Place::Joint(k),
    }
}

/// Whether the rig has anything that an effect can act on.
fn has(wiring: &Wiring, info: &EffectInfo, names: &[String]) -> bool {
    let arm = matches!(wiring.body, BodyUnit::OneLink { .. } | BodyUnit::Planar { .. });
    match info.block {
        _ if info.on_loads => !matches!(wiring.body, BodyUnit::Fixed),
        "arm" | "joint" => arm,
        _ => info.at.is_empty() || !names.is_empty(),
    }
}

/// Names of the blocks of a kind; joints in the order of the coordinates.
fn names(spec: &RigSpec, kind: &str) -> Vec<String> {
    match kind {
        "supply" => spec.supplies.iter().map(|b| b.name.clone()).collect(),
        "valve" => spec.valves.iter().map(|b| b.name.clone()).collect(),
        "line" => spec.lines.iter().map(|b| b.name.clone()).collect(),
        "chamber" => spec.chambers.iter().map(|b| b.name.clone()).collect(),
        "muscle" => spec.muscles.iter().map(|b| b.name.clone()).collect(),
        "joint" => coordinate_names(spec),
        _ => Vec::new(),
    }
}

/// One effect must not act on a block twice.
fn twice(
    spec: &RigSpec,
    wiring: &Wiring,
    effects: &[Instance],
    places: &[Vec<Place>],
) -> Result<()> {
    for (k, (one, here)) in effects.iter().zip(places).enumerate() {
        let others =
            effects.iter().zip(places).take(k).filter(|(other, _)| other.info.id == one.info.id);
        for (_, there) in others {
            if let Some(place) = here.iter().find(|place| there.contains(place)) {
                let (id, block) = (one.info.id, block_name(spec, wiring, *place));
                let block =
                    dotted(if one.info.at.is_empty() { "rig" } else { one.info.at }, &block);
                return model(format!(
                    "effect '{id}' acts on {block} twice: one of them is needed"
                ));
            }
        }
    }
    Ok(())
}

impl Ports {
    /// Names of the states of all effects, with what they are to a linear model.
    pub fn state_names(&self, spec: &RigSpec, wiring: &Wiring) -> Vec<(String, Role)> {
        let mut names = vec![(String::new(), Role::Keeps); self.states];
        for (place, acting) in &self.all {
            let instance = &self.effects[acting.effect];
            let block = block_name(spec, wiring, *place);
            for (k, state) in instance.form.states.iter().enumerate().take(acting.count) {
                let own = dotted(instance.info.id, state.name);
                names[acting.first + k] = (dotted(&own, &block), state.role);
            }
        }
        names
    }

    /// Plug an effect into a port of a block.
    fn plug(
        &mut self,
        port: Port,
        place: Place,
        acting: Acting,
        wiring: &Wiring,
        spec: &RigSpec,
    ) -> Result<()> {
        self.needs_states(port, acting)?;
        let taken = match (port, place) {
            (Port::Command, Place::Valve(k)) => push(&mut self.command[k], acting),
            (Port::Late, Place::Valve(k)) => push(&mut self.late[k], acting),
            (Port::Switching, Place::Valve(k)) => self.switching[k].replace(acting),
            (Port::Area, Place::Valve(k)) => self.area[k].replace(acting),
            (Port::Passage, Place::Valve(k)) => {
                let gas = wiring.valves[k].to;
                self.tap[gas] = self.tap[gas].or(Some((k, acting)));
                self.passage[k].replace(acting)
            }
            (Port::Exhaust, Place::Valve(k)) => self.passage[k].replace(acting),
            (Port::Law, Place::Line(k)) => self.law[k].replace(acting),
            (Port::Clearance, Place::Valve(k)) => {
                push(&mut self.flows, (Flow::Clearance(k), acting))
            }
            (Port::Leak, Place::Supply(_) | Place::Gas(_)) => {
                push(&mut self.flows, (Flow::Leak(node(place)), acting))
            }
            (Port::Inflow, Place::Supply(_) | Place::Gas(_)) => {
                push(&mut self.flows, (Flow::Inflow(node(place)), acting))
            }
            (Port::Feed, Place::Supply(k)) => push(&mut self.feed[k], acting),
            (Port::Balance, Place::Gas(k)) => self.balance[k].replace(acting),
            (Port::Reading, Place::Gas(k)) => self.reading[k].replace(acting),
            (Port::Thermometer, Place::Gas(k)) => self.thermometer[k].replace(acting),
            (Port::Gauge | Port::Bladder | Port::Force, Place::Group(k)) => {
                self.muscles[k].some = true;
                let at = &mut self.muscles[k];
                push(
                    match port {
                        Port::Gauge => &mut at.gauge,
                        Port::Bladder => &mut at.bladder,
                        _ => &mut at.force,
                    },
                    acting,
                )
            }
            (Port::Give, Place::Group(k)) => self.muscles[k].give.replace(acting),
            (Port::Torque, Place::Joint(k)) => push(&mut self.torque[k], acting),
            (Port::Push, Place::Joint(k)) => push(&mut self.push[k], acting),
            (Port::Weight, Place::Joint(k)) => push(&mut self.weight[k], acting),
            (Port::Payload, Place::Joint(k)) => push(&mut self.payload, (k, acting)),
            (Port::Hanging, Place::Joint(k)) => self.hang(k, acting, wiring, spec)?,
            (Port::Mounting, Place::Whole) => self.mounting.replace(acting),
            (Port::Encoder, Place::Joint(k)) => self.encoder[k].replace(acting),
            (Port::Zero, Place::Gas(k)) => self.gauge_zero[k].replace(acting),
            (Port::Zero, Place::Whole) => self.cell_zero.replace(acting),
            (Port::Clock, Place::Whole) => push(&mut self.clock, acting),
            _ => {
                let id = self.effects[acting.effect].info.id;
                return model(format!("effect '{id}' acts at a port that its block does not have"));
            }
        };
        match taken {
            None => Ok(()),
            Some(other) => {
                let [one, other] = [acting, other].map(|a| self.effects[a.effect].info.id);
                let block = block_name(spec, wiring, place);
                let place = dotted(self.effects[acting.effect].info.at, &block);
                model(format!(
                    "the effects '{other}' and '{one}' cannot both act on {place}: one of them is \
                        needed"
                ))
            }
        }
    }

    /// A port may need a certain number of states.
    fn needs_states(&self, port: Port, acting: Acting) -> Result<()> {
        match port.states() {
            Some(needed) if needed != acting.count => model(format!(
                "effect '{}' has {} states, and what acts at the port {port:?} has {needed}",
                self.effects[acting.effect].info.id, acting.count
            )),
            _ => Ok(()),
        }
    }

    /// Hang a mass on a link; an error that names both joints where one hangs already.
    fn hang(
        &mut self,
        link: usize,
        acting: Acting,
        wiring: &Wiring,
        spec: &RigSpec,
    ) -> Result<Option<Acting>> {
        let Some(other) = self.hanging.replace((link, acting)) else { return Ok(None) };
        let [one, two] = [other, (link, acting)].map(|(link, acting)| {
            let joint = dotted("joint", &block_name(spec, wiring, Place::Joint(link)));
            format!("'{}' at {joint}", self.effects[acting.effect].info.id)
        });
        model(format!("only one mass of an arm can hang, and {one} and {two} make two"))
    }
}

/// Append; nothing had to go.
fn push<T>(list: &mut Vec<T>, item: T) -> Option<Acting> {
    list.push(item);
    None
}
