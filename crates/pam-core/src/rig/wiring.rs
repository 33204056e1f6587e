//! How the blocks of a description fit together: ports become indices, numbers become parameters.

use super::parameters::{ParameterId, Parameters};
use super::spec::{dotted, ArmSpec, EffectSpec, LinkSpec, LoadSpec, RigSpec};
use crate::arm::linear::HangingMass;
use crate::arm::planar::Stops;
use crate::effects;
use crate::gas::valve::AreaTable;
use crate::joint::Joint;
use crate::muscle::{CompiledMuscle, Muscle};
use crate::{Error, Result};

/// Most links of a planar arm.
pub const MOST_LINKS: usize = 4;

/// An end of a flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Node {
    Ambient,
    Supply(usize),
    /// A chamber, or behind all chambers the inlet of a line.
    Gas(usize),
}

impl Node {
    /// Place of its pressure among the states.
    pub fn place(self, layout: &super::Layout) -> Option<usize> {
        match self {
            Self::Ambient => None,
            Self::Supply(k) => Some(layout.supply(k)),
            Self::Gas(k) => Some(layout.pressure(k)),
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum SupplyUnit {
    Tank(ParameterId),
    Constant,
    Regulator { time_constant: ParameterId, droop: ParameterId },
}

#[derive(Debug, Clone)]
pub(crate) struct ValveUnit {
    pub from: Node,
    pub to: usize,
    pub table: AreaTable,
    pub area: ParameterId,
    pub null: ParameterId,
    pub half_range: f64,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Path {
    Orifice(ParameterId),
    Tube { length: ParameterId, diameter: ParameterId },
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct LineUnit {
    pub from: Node,
    pub to: Node,
    pub path: Path,
}

/// Volume of gas: a chamber, or the rigid inlet of a line.
#[derive(Debug, Clone)]
pub(crate) struct GasUnit {
    /// Fixed volume [m3].
    pub volume: ParameterId,
    /// Lines of which half the tube's volume is here.
    pub tubes: Vec<usize>,
    /// Inflow, outflow, volume change; an inlet, all wall, is isothermal.
    pub alphas: Option<[ParameterId; 3]>,
    pub pressure_zero: Option<ParameterId>,
    /// Gauge [Pa]; an inlet begins at the pressure of the line's end.
    pub initial_pressure: f64,
    pub leak: bool,
    pub heat: bool,
}

/// Muscles of one kind that share a chamber and a joint.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    pub chamber: usize,
    pub coordinate: usize,
    pub joint: Joint,
    pub muscle: CompiledMuscle,
    pub scale: ParameterId,
    pub count: f64,
    pub rest_length: f64,
    pub direction: bool,
    pub hysteresis: bool,
}

/// What moves: a joint angle, or the shortening of a linear load.
#[derive(Debug, Clone)]
pub(crate) struct Coordinate {
    pub rest: f64,
    pub stops: Option<Stops>,
    pub zero: Option<ParameterId>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct LinkUnit {
    pub length: ParameterId,
    pub mass: ParameterId,
    pub centre: ParameterId,
    pub inertia: ParameterId,
    pub payload: ParameterId,
    pub viscous: ParameterId,
    pub coulomb: ParameterId,
    pub coulomb_speed: f64,
}

#[derive(Debug, Clone)]
pub(crate) enum BodyUnit {
    /// Nothing moves by itself.
    Fixed,
    OneLink {
        inertia: ParameterId,
        first_moment: ParameterId,
        payload: ParameterId,
        viscous: ParameterId,
        coulomb: ParameterId,
        length: f64,
        coulomb_speed: f64,
        gravity: f64,
    },
    Planar {
        gravity: f64,
        links: Vec<LinkUnit>,
    },
    Mass(HangingMass),
}

/// Parameters of the effects that are switched on.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct EffectUnits {
    pub leak: Option<[ParameterId; 2]>,
    pub heat: Option<[ParameterId; 2]>,
    pub hysteresis: Option<[ParameterId; 3]>,
}

/// A whole rig, resolved.
#[derive(Debug, Clone)]
pub(crate) struct Wiring {
    pub parameters: Parameters,
    pub supplies: Vec<SupplyUnit>,
    pub gases: Vec<GasUnit>,
    /// The first `chambers` of `gases` are chambers, the rest inlets of lines.
    pub chambers: usize,
    /// Line and end of line of each inlet.
    pub inlets: Vec<(usize, Node)>,
    pub valves: Vec<ValveUnit>,
    pub lines: Vec<LineUnit>,
    pub groups: Vec<Group>,
    pub coordinates: Vec<Coordinate>,
    pub body: BodyUnit,
    pub effects: EffectUnits,
}

fn model<T>(text: impl Into<String>) -> Result<T> {
    Err(Error::Model(text.into()))
}

/// Finds ports.
struct Ports<'a> {
    spec: &'a RigSpec,
    /// Lines that have an inlet of their own.
    inlets: Vec<usize>,
}

impl<'a> Ports<'a> {
    fn new(spec: &'a RigSpec) -> Self {
        let own = |(k, line): (usize, &super::spec::LineSpec)| line.from.is_empty().then_some(k);
        Self { spec, inlets: spec.lines.iter().enumerate().filter_map(own).collect() }
    }

    fn node(&self, owner: &str, port: &str) -> Result<Node> {
        let spec = self.spec;
        if port == "ambient" {
            return Ok(Node::Ambient);
        }
        if let Some(k) = spec.supplies.iter().position(|s| dotted("supply", &s.name) == port) {
            return Ok(Node::Supply(k));
        }
        if let Some(k) = spec.chambers.iter().position(|c| dotted("chamber", &c.name) == port) {
            return Ok(Node::Gas(k));
        }
        if let Some(k) = spec.lines.iter().position(|l| dotted("line", &l.name) == port) {
            return match self.inlets.iter().position(|line| *line == k) {
                Some(inlet) => Ok(Node::Gas(spec.chambers.len() + inlet)),
                None => model(format!("{owner} = \"{port}\" is not allowed: that line begins at \"{}\", it has no inlet for valves", spec.lines[k].from)),
            };
        }
        if port.is_empty() {
            return model(format!("{owner} is missing: a port is needed, one of {}", self.names()));
        }
        model(format!(
            "{owner} = \"{port}\" is not allowed: the rig has no such block; one of {}",
            self.names()
        ))
    }

    fn names(&self) -> String {
        let spec = self.spec;
        let supplies = spec.supplies.iter().map(|s| dotted("supply", &s.name));
        let chambers = spec.chambers.iter().map(|c| dotted("chamber", &c.name));
        let lines = self.inlets.iter().map(|k| dotted("line", &spec.lines[*k].name));
        supplies.chain(chambers).chain(lines).chain(["ambient".to_string()]).collect::<Vec<_>>().join(", ")
    }
}

impl Wiring {
    /// Resolve a description whose values are checked; `known` are compiled muscles to use again.
    pub fn new(spec: &RigSpec, known: &[Group]) -> Result<Self> {
        no_twins(spec)?;
        let ports = Ports::new(spec);
        let mut table = Parameters::default();
        let supplies = supplies(spec, &mut table);
        let valves = valves(spec, &ports, &mut table)?;
        let (lines, inlets) = lines(spec, &ports, &valves, &mut table)?;
        let mut gases = gases(spec, &inlets, &mut table);
        for (k, line) in lines.iter().enumerate().filter(|(_, l)| matches!(l.path, Path::Tube { .. })) {
            for end in [line.from, line.to] {
                if let Node::Gas(gas) = end {
                    gases[gas].tubes.push(k);
                }
            }
        }
        let coordinates = coordinates(spec, &mut table)?;
        let mut groups = groups(spec, known, &mut table)?;
        let body = body(spec, &mut table)?;
        sensors(spec, &mut table, &mut gases)?;
        let coordinates = zeros(spec, &table, coordinates);
        let effects = effect_units(spec, &mut table, &mut gases, &mut groups)?;
        Ok(Self {
            parameters: table,
            chambers: spec.chambers.len(),
            supplies,
            gases,
            inlets,
            valves,
            lines,
            groups,
            coordinates,
            body,
            effects,
        })
    }
}

/// Two blocks of one kind must not have one name.
fn no_twins(spec: &RigSpec) -> Result<()> {
    if spec.chambers.is_empty() {
        return model("a rig needs at least one chamber");
    }
    fn twins<'a>(kind: &str, names: impl Iterator<Item = &'a String>) -> Result<()> {
        let mut seen: Vec<&String> = Vec::new();
        for name in names {
            if seen.contains(&name) {
                return model(format!("[{}] is there twice", dotted(kind, name)));
            }
            seen.push(name);
        }
        Ok(())
    }
    twins("supply", spec.supplies.iter().map(|b| &b.name))?;
    twins("valve", spec.valves.iter().map(|b| &b.name))?;
    twins("line", spec.lines.iter().map(|b| &b.name))?;
    twins("chamber", spec.chambers.iter().map(|b| &b.name))?;
    twins("muscle", spec.muscles.iter().map(|b| &b.name))?;
    twins("joint", spec.joints.iter().map(|b| &b.name))?;
    twins("sensors", spec.sensors.iter().map(|b| &b.name))
}

fn supplies(spec: &RigSpec, table: &mut Parameters) -> Vec<SupplyUnit> {
    let unit = |supply: &super::spec::SupplySpec| {
        let name = |key: &str| format!("{}.{key}", dotted("supply", &supply.name));
        match supply.kind.as_str() {
            "tank" => SupplyUnit::Tank(table.add(name("volume"), supply.volume)),
            "regulator" => SupplyUnit::Regulator {
                time_constant: table.add(name("time_constant"), supply.time_constant),
                droop: table.add(name("droop"), supply.droop),
            },
            _ => SupplyUnit::Constant,
        }
    };
    spec.supplies.iter().map(unit).collect()
}

fn valves(spec: &RigSpec, ports: &Ports<'_>, table: &mut Parameters) -> Result<Vec<ValveUnit>> {
    let mut units = Vec::new();
    for valve in &spec.valves {
        let block = dotted("valve", &valve.name);
        let from = ports.node(&format!("{block}.from"), &valve.from)?;
        let to = ports.node(&format!("{block}.to"), &valve.to)?;
        let Node::Gas(to) = to else {
            return model(format!(
                "{block}.to = \"{}\" is not allowed: a valve feeds a chamber or the inlet of a line",
                valve.to
            ));
        };
        if from == Node::Ambient || from == Node::Gas(to) {
            return model(format!(
                "{block}.from = \"{}\" is not allowed: a supply or another chamber is needed",
                valve.from
            ));
        }
        units.push(ValveUnit {
            from,
            to,
            table: AreaTable::new(&valve.opening, &valve.fraction)?,
            area: table.add(format!("{block}.discharge_area_max"), valve.discharge_area_max),
            null: table.add(format!("{block}.null_voltage"), valve.null_voltage),
            half_range: valve.half_range,
        });
    }
    Ok(units)
}

type Lines = (Vec<LineUnit>, Vec<(usize, Node)>);

fn lines(spec: &RigSpec, ports: &Ports<'_>, valves: &[ValveUnit], table: &mut Parameters) -> Result<Lines> {
    let (mut units, mut inlets) = (Vec::new(), Vec::new());
    for (k, line) in spec.lines.iter().enumerate() {
        let block = dotted("line", &line.name);
        let to = ports.node(&format!("{block}.to"), &line.to)?;
        let from = match line.from.as_str() {
            "" => Node::Gas(spec.chambers.len() + inlets.len()),
            port => ports.node(&format!("{block}.from"), port)?,
        };
        if from == to || from == Node::Ambient {
            return model(format!("{block}.from = \"{}\" is not allowed: another end than {block}.to, with gas in it, is needed", line.from));
        }
        if line.from.is_empty() {
            if !valves.iter().any(|v| Node::Gas(v.to) == from) {
                return model(format!(
                    "{block}.from is missing: no valve feeds that line, and it begins nowhere"
                ));
            }
            inlets.push((k, to));
        }
        let name = |key: &str| format!("{block}.{key}");
        let path = if line.kind == "tube" {
            Path::Tube {
                length: table.add(name("length"), line.length),
                diameter: table.add(name("diameter"), line.diameter),
            }
        } else {
            Path::Orifice(table.add(name("discharge_area"), line.discharge_area))
        };
        units.push(LineUnit { from, to, path });
    }
    Ok((units, inlets))
}

fn gases(spec: &RigSpec, inlets: &[(usize, Node)], table: &mut Parameters) -> Vec<GasUnit> {
    let mut units = Vec::new();
    let plain = |volume, alphas, initial_pressure| GasUnit {
        volume,
        alphas,
        initial_pressure,
        tubes: Vec::new(),
        pressure_zero: None,
        leak: false,
        heat: false,
    };
    for chamber in &spec.chambers {
        let name = |key: &str| format!("{}.{key}", dotted("chamber", &chamber.name));
        let volume = table.add(name("dead_volume"), chamber.dead_volume);
        let alphas = [
            table.add(name("alpha_in"), chamber.alpha_in),
            table.add(name("alpha_out"), chamber.alpha_out),
            table.add(name("alpha"), chamber.alpha),
        ];
        units.push(plain(volume, Some(alphas), chamber.initial_pressure));
    }
    for (k, end) in inlets {
        let line = &spec.lines[*k];
        let volume = table.add(format!("{}.inlet_volume", dotted("line", &line.name)), line.inlet_volume);
        let pressure = match end {
            Node::Gas(gas) => spec.chambers.get(*gas).map_or(0.0, |c| c.initial_pressure),
            Node::Supply(supply) => spec.supplies[*supply].initial_pressure,
            Node::Ambient => 0.0,
        };
        units.push(plain(volume, None, pressure));
    }
    units
}

fn coordinates(spec: &RigSpec, _table: &mut Parameters) -> Result<Vec<Coordinate>> {
    if let Some(load) = &spec.load {
        if !spec.joints.is_empty() || spec.arm.is_some() {
            return model("a rig has either [joint] and [arm] or [load], not both");
        }
        let Some(first) = spec.muscles.first() else {
            return model("a rig with [load] needs [muscle]");
        };
        let rest = first.muscle.rest_length;
        if spec.muscles.iter().any(|m| m.muscle.rest_length != rest) {
            return model("muscles on one load must have the same rest_length");
        }
        return Ok(vec![Coordinate { rest: 0.0, stops: load_stops(load, rest), zero: None }]);
    }
    let coordinate = |joint: &super::spec::JointSpec| Coordinate {
        rest: joint.rest_angle,
        stops: Some(Stops {
            min_angle: joint.min_angle,
            max_angle: joint.max_angle,
            stiffness: joint.stop_stiffness,
            damping: joint.stop_damping,
        }),
        zero: None,
    };
    let named = |port: &str| spec.joints.iter().position(|j| dotted("joint", &j.name) == port);
    match &spec.arm {
        None if spec.joints.is_empty() && spec.muscles.is_empty() => Ok(Vec::new()),
        None if spec.joints.is_empty() => model("a rig with [muscle] needs [joint] and [arm], or [load]"),
        None => model("a rig with [joint] needs [arm]"),
        Some(_) if spec.joints.is_empty() => model("a rig with [arm] needs [joint]"),
        Some(arm) if arm.kind == "one_link" => match spec.joints.as_slice() {
            [joint] => Ok(vec![coordinate(joint)]),
            _ => model(format!("a one-link arm has one joint, and the rig has {}", spec.joints.len())),
        },
        Some(arm) => {
            let links = arm.links.len();
            if !(1..=MOST_LINKS).contains(&links) || links != spec.joints.len() {
                return model(format!(
                    "a planar arm has 1 to {MOST_LINKS} links and as many joints; the rig has {links} links and {} joints",
                    spec.joints.len()
                ));
            }
            let mut order = Vec::new();
            for link in &arm.links {
                let Some(k) = named(&link.joint).filter(|k| !order.contains(k)) else {
                    return model(format!(
                        "{}.joint = \"{}\" is not allowed: a joint of its own is needed",
                        dotted("link", &link.name),
                        link.joint
                    ));
                };
                order.push(k);
            }
            Ok(order.iter().map(|k| coordinate(&spec.joints[*k])).collect())
        }
    }
}

/// The coordinate that a joint's port names, in the order of the links.
pub(crate) fn coordinate_of(spec: &RigSpec, port: &str) -> Option<usize> {
    match &spec.arm {
        Some(arm) if arm.kind == "planar" => arm.links.iter().position(|l| l.joint == port),
        _ => spec.joints.iter().position(|j| dotted("joint", &j.name) == port),
    }
}

/// Names of the coordinates (joints), in their order.
pub(crate) fn coordinate_names(spec: &RigSpec) -> Vec<String> {
    match &spec.arm {
        Some(arm) if arm.kind == "planar" => {
            let bare = |port: &str| port.split_once('.').map_or(String::new(), |(_, name)| name.to_string());
            arm.links.iter().map(|l| bare(&l.joint)).collect()
        }
        _ => spec.joints.iter().map(|j| j.name.clone()).collect(),
    }
}

fn load_stops(load: &LoadSpec, rest: f64) -> Option<Stops> {
    (!load.is_frame()).then_some(Stops {
        min_angle: rest - load.max_length,
        max_angle: rest - load.min_length,
        stiffness: load.stop_stiffness,
        damping: load.stop_damping,
    })
}

fn groups(spec: &RigSpec, known: &[Group], table: &mut Parameters) -> Result<Vec<Group>> {
    let mut units = Vec::new();
    for (k, group) in spec.muscles.iter().enumerate() {
        let block = dotted("muscle", &group.name);
        let chamber = spec.chambers.iter().position(|c| dotted("chamber", &c.name) == group.chamber);
        let Some(chamber) = chamber else {
            return model(format!(
                "{block}.chamber = \"{}\" is not allowed: the rig has no such chamber",
                group.chamber
            ));
        };
        let (coordinate, joint) = if spec.load.is_some() {
            if group.joint != "load" {
                return model(format!(
                    "{block}.joint = \"{}\" is not allowed: the rig has a load, \"load\" is needed",
                    group.joint
                ));
            }
            (0, Joint::Direct)
        } else {
            let found = coordinate_of(spec, &group.joint)
                .zip(spec.joints.iter().find(|j| dotted("joint", &j.name) == group.joint));
            let Some((coordinate, joint)) = found else {
                return model(format!(
                    "{block}.joint = \"{}\" is not allowed: the rig has no such joint",
                    group.joint
                ));
            };
            let Some(transmission) = group.transmission.as_ref().or(joint.transmission.as_ref()) else {
                return model(format!(
                    "{block} has no transmission: neither [transmission] nor its joint says how it pulls"
                ));
            };
            (coordinate, Joint::new(transmission)?)
        };
        let again = known.get(k).and_then(|old| old.muscle.respecified(&group.muscle));
        let muscle = match again {
            Some(muscle) => muscle,
            None => match spec.muscles[..k].iter().position(|m| m.muscle == group.muscle) {
                Some(same) => Group::clone(&units[same]).muscle,
                None => CompiledMuscle::new(Muscle::new(&group.muscle)?)?,
            },
        };
        units.push(Group {
            chamber,
            coordinate,
            joint,
            scale: table.add(format!("{block}.modulus_scale"), group.muscle.modulus_scale),
            count: f64::from(group.muscle.count),
            rest_length: group.muscle.rest_length,
            direction: muscle.has_direction(),
            hysteresis: false,
            muscle,
        });
    }
    if !spec.joints.is_empty() && units.is_empty() {
        return model("a rig with [joint] needs [muscle]");
    }
    Ok(units)
}

fn body(spec: &RigSpec, table: &mut Parameters) -> Result<BodyUnit> {
    if let Some(load) = spec.load.as_ref().filter(|load| !load.is_frame()) {
        return Ok(BodyUnit::Mass(HangingMass {
            mass: load.mass,
            viscous: load.viscous,
            coulomb: load.coulomb,
            coulomb_speed: load.coulomb_speed,
            gravity: load.gravity,
        }));
    }
    let Some(arm) = &spec.arm else { return Ok(BodyUnit::Fixed) };
    if arm.kind == "planar" {
        return Ok(planar(arm, table));
    }
    Ok(BodyUnit::OneLink {
        inertia: table.add("arm.inertia".into(), arm.inertia),
        first_moment: table.add("arm.first_moment".into(), arm.first_moment),
        payload: table.add("arm.payload".into(), arm.payload),
        viscous: table.add("arm.viscous".into(), arm.viscous),
        coulomb: table.add("arm.coulomb".into(), arm.coulomb),
        length: arm.length,
        coulomb_speed: arm.coulomb_speed,
        gravity: arm.gravity,
    })
}

fn planar(arm: &ArmSpec, table: &mut Parameters) -> BodyUnit {
    let mut unit = |link: &LinkSpec| {
        let mut add = |key: &str, value| table.add(format!("{}.{key}", dotted("link", &link.name)), value);
        LinkUnit {
            length: add("length", link.length),
            mass: add("mass", link.mass),
            centre: add("centre", link.centre),
            inertia: add("inertia", link.inertia),
            payload: add("payload", link.payload),
            viscous: add("viscous", link.viscous),
            coulomb: add("coulomb", link.coulomb),
            coulomb_speed: link.coulomb_speed,
        }
    };
    BodyUnit::Planar { gravity: arm.gravity, links: arm.links.iter().map(&mut unit).collect() }
}

fn sensors(spec: &RigSpec, table: &mut Parameters, gases: &mut [GasUnit]) -> Result<()> {
    for sensor in &spec.sensors {
        let name = |key: &str| format!("{}.{key}", dotted("sensors", &sensor.name));
        let pressure = table.add(name("pressure_zero"), sensor.pressure_zero);
        table.add(name("angle_zero"), sensor.angle_zero);
        let chambers = spec.chambers.iter().map(|c| &c.name);
        let known = chambers.clone().chain(spec.joints.iter().map(|j| &j.name)).any(|n| *n == sensor.name);
        if !sensor.name.is_empty() && !known {
            return model(format!(
                "[sensors.{}] is not allowed: the rig has no chamber and no joint of that name",
                sensor.name
            ));
        }
        for (gas, chamber) in gases.iter_mut().zip(chambers) {
            // One of its own wins over the common one.
            if *chamber == sensor.name || (sensor.name.is_empty() && gas.pressure_zero.is_none()) {
                gas.pressure_zero = Some(pressure);
            }
        }
    }
    Ok(())
}

fn zeros(spec: &RigSpec, table: &Parameters, mut coordinates: Vec<Coordinate>) -> Vec<Coordinate> {
    for (coordinate, name) in coordinates.iter_mut().zip(coordinate_names(spec)) {
        let own = |name: &str| table.find(&format!("{}.angle_zero", dotted("sensors", name))).ok();
        coordinate.zero = own(&name).or_else(|| own(""));
    }
    coordinates
}

fn effect_units(
    spec: &RigSpec,
    table: &mut Parameters,
    gases: &mut [GasUnit],
    groups: &mut [Group],
) -> Result<EffectUnits> {
    let mut units = EffectUnits::default();
    for effect in &spec.effects {
        let Some(info) = effects::EFFECTS.iter().find(|e| e.id == effect.id) else {
            let ids: Vec<_> = effects::EFFECTS.iter().map(|e| e.id).collect();
            return model(format!("no effect '{}'; there are: {}", effect.id, ids.join(", ")));
        };
        if info.block == "muscle" && groups.is_empty() {
            return model(format!("effect '{}' acts in the muscle, and the rig has none", effect.id));
        }
        let ids = effect_parameters(effect, info, table)?;
        let mut found = false;
        let mut here = |name: &String| {
            let here = effect.at.is_empty() || *name == effect.at;
            found |= here;
            here
        };
        let (chambers, muscles) =
            (spec.chambers.iter().map(|c| &c.name), spec.muscles.iter().map(|m| &m.name));
        match (info.id, ids.as_slice()) {
            ("leak_muscle", [conductance, share]) => {
                units.leak = Some([*conductance, *share]);
                gases.iter_mut().zip(chambers).for_each(|(gas, name)| gas.leak = here(name));
            }
            ("heat_transfer", [coefficient, rise]) => {
                units.heat = Some([*coefficient, *rise]);
                gases.iter_mut().zip(chambers).for_each(|(gas, name)| gas.heat = here(name));
            }
            ("muscle_hysteresis", [constant, pressure, presliding]) => {
                units.hysteresis = Some([*constant, *pressure, *presliding]);
                groups.iter_mut().zip(muscles).for_each(|(group, name)| group.hysteresis = here(name));
            }
            _ => return model(format!("effect '{}' is not in this build", effect.id)),
        }
        if !found {
            return model(format!(
                "effect '{}' acts at '{}', and the rig has no {} of that name",
                effect.id, effect.at, info.block
            ));
        }
    }
    Ok(units)
}

fn effect_parameters(
    effect: &EffectSpec,
    info: &effects::EffectInfo,
    table: &mut Parameters,
) -> Result<Vec<ParameterId>> {
    let mut ids = Vec::new();
    for (name, unit) in info.parameters {
        let Some(value) = effect.parameters.get(*name).copied() else {
            return model(format!("effect '{}' lacks its parameter '{name}' [{unit}]", effect.id));
        };
        let full = format!("{}.{name}", effect.id);
        let positive = *name == "presliding";
        if !value.is_finite() || value < 0.0 || (positive && value < 1e-9) {
            let allowed = if positive { "at least 1e-9" } else { "finite and not negative" };
            return Err(Error::parameter(full, value, format!("{allowed} {unit}")));
        }
        ids.push(table.add(full, value));
    }
    if let Some(unknown) = effect.parameters.keys().find(|k| info.parameters.iter().all(|(n, _)| n != k)) {
        return model(format!("effect '{}' has no parameter '{unknown}'", effect.id));
    }
    Ok(ids)
}
