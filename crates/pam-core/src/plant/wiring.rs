//! How the air and the effects of a description fit together: ports become indices, numbers become
//! parameters.

use super::parameters::{ParameterId, Parameters};
use super::plugs::switch_on;
use super::ports::Ports as EffectPorts;
use super::units::{
    Coordinate, GasLaw, GasUnit, Group, LineUnit, Node, Passes, Path, SupplyUnit, ValveUnit,
    WaveUnit,
};
use super::wired::Wiring;
use super::wiring_motion::{body, coordinates, groups};
use crate::blocks::valve::AreaTable;
use crate::description::{coordinate_names, dotted, RigSpec, SupplySpec, ValveSpec};
use crate::effects::{EffectInfo, Form};
use crate::error::model;
use crate::key;
use crate::keys::Key;
use crate::Result;

/// Finds ports.
struct Ports<'a> {
    spec: &'a RigSpec,
    /// Lines that have an inlet of their own.
    inlets: Vec<usize>,
}

impl<'a> Ports<'a> {
    fn new(spec: &'a RigSpec) -> Self {
        let own =
            |(k, line): (usize, &crate::description::LineSpec)| line.from.is_empty().then_some(k);
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
                None => model(format!(
                    "{owner} = \"{port}\" is not allowed: that line begins at \
                    \"{}\", it has no inlet for valves",
                    spec.lines[k].from
                )),
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
        supplies
            .chain(chambers)
            .chain(lines)
            .chain(["ambient".to_string()])
            .collect::<Vec<_>>()
            .join(", ")
    }
}

impl Wiring {
    /// Resolve a description whose words are checked, with the numbers of its blocks; `known` are
    /// compiled muscles to use again, `effects` all that there are.
    pub fn new(
        spec: &RigSpec,
        known: &[Group],
        effects: &[&'static EffectInfo],
    ) -> Result<(Self, Parameters)> {
        no_twins(spec)?;
        let ports = Ports::new(spec);
        let mut table = Parameters::default();
        let supplies = supplies(spec, &ports, &mut table)?;
        let supply_zeros = supply_zeros(spec, &mut table)?;
        let valves = valves(spec, &ports, &mut table)?;
        let (lines, inlets) = lines(spec, &ports, &valves, &mut table)?;
        let waves = waves(spec, &lines, inlets.len(), &mut table)?;
        let mut gases = gases(spec, &inlets, &waves, &lines, &mut table)?;
        for (k, line) in
            lines.iter().enumerate().filter(|(_, l)| matches!(l.path, Path::Tube { .. }))
        {
            for end in [line.from, line.to] {
                if let Node::Gas(gas) = end {
                    gases[gas].tubes.push(k);
                }
            }
        }
        for wave in &waves {
            for segment in 1..wave.segments {
                if let Node::Gas(gas) = wave.node(&lines, segment) {
                    gases[gas].tubes.extend([wave.line, wave.line]);
                }
            }
        }
        let coordinates = coordinates(spec, &mut table)?;
        let groups = groups(spec, known, &mut table)?;
        let body = body(spec, &mut table)?;
        sensors(spec, &mut table, &mut gases)?;
        let coordinates = zeros(spec, &table, coordinates);
        let force_gain = table.find("sensors.force_gain").ok();
        let mut wiring = Self {
            chambers: spec.chambers.len(),
            supplies,
            supply_zeros,
            gases,
            inlets,
            waves,
            valves,
            lines,
            groups,
            coordinates,
            force_gain,
            body,
            ports: EffectPorts::default(),
        };
        switch_on(spec, effects, &mut table, &mut wiring)?;
        Ok((wiring, table))
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

/// The supply in front of a regulator, if any.
fn inlet(spec: &RigSpec, ports: &Ports<'_>, supply: &SupplySpec) -> Result<Option<usize>> {
    if supply.inlet.is_empty() {
        return Ok(None);
    }
    let block = dotted("supply", &supply.name);
    let refused =
        |why: String| model(format!("{block}.inlet = \"{}\" is not allowed: {why}", supply.inlet));
    if supply.kind != "regulator" {
        return refused(format!("only a regulator has an inlet, {block} is a {}", supply.kind));
    }
    let Node::Supply(k) = ports.node(&format!("{block}.inlet"), &supply.inlet)? else {
        return refused("a supply is needed, a tank or a constant one".into());
    };
    let front = &spec.supplies[k];
    if front.name == supply.name {
        return refused("it is the regulator itself; another supply is needed".into());
    }
    if front.kind == "regulator" {
        return refused("it is a regulator; a tank or a constant supply is needed".into());
    }
    Ok(Some(k))
}

fn supplies(spec: &RigSpec, ports: &Ports<'_>, table: &mut Parameters) -> Result<Vec<SupplyUnit>> {
    let mut unit = |supply: &SupplySpec| {
        let block = dotted("supply", &supply.name);
        let inlet = inlet(spec, ports, supply)?;
        Ok(match supply.kind.as_str() {
            "tank" => {
                SupplyUnit::Tank(table.add(&block, key!("supply", "volume"), supply.volume)?)
            }
            "regulator" => SupplyUnit::Regulator {
                time_constant: table.add(
                    &block,
                    key!("supply", "time_constant"),
                    supply.time_constant,
                )?,
                droop: table.add(&block, key!("supply", "droop"), supply.droop)?,
                rise_limit: table.add(&block, key!("supply", "rise_limit"), supply.rise_limit)?,
                fall_limit: table.add(&block, key!("supply", "fall_limit"), supply.fall_limit)?,
                dead_time: table.add(&block, key!("supply", "dead_time"), supply.dead_time)?,
                dead_band: table.add(&block, key!("supply", "dead_band"), supply.dead_band)?,
                inlet,
            },
            _ => SupplyUnit::Constant,
        })
    };
    spec.supplies.iter().map(&mut unit).collect()
}

fn supply_zeros(spec: &RigSpec, table: &mut Parameters) -> Result<Vec<ParameterId>> {
    let mut zero = |supply: &SupplySpec| {
        let block = dotted("supply", &supply.name);
        table.add(&block, key!("supply", "pressure_zero"), supply.pressure_zero)
    };
    spec.supplies.iter().map(&mut zero).collect()
}

fn valves(spec: &RigSpec, ports: &Ports<'_>, table: &mut Parameters) -> Result<Vec<ValveUnit>> {
    let mut units = Vec::new();
    for valve in &spec.valves {
        let block = dotted("valve", &valve.name);
        let from = ports.node(&format!("{block}.from"), &valve.from)?;
        let to = ports.node(&format!("{block}.to"), &valve.to)?;
        let Node::Gas(to) = to else {
            return model(format!(
                "{block}.to = \"{}\" is not allowed: a valve feeds a chamber or the inlet of a \
                    line",
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
            passes: passes(valve, &block, table)?,
            null: table.add(&block, key!("valve", "null_voltage"), valve.null_voltage)?,
            half_range: valve.half_range,
            spool: spool(valve, &block, table)?,
        });
    }
    Ok(units)
}

/// What the spool of a valve does by itself.
fn spool(
    valve: &ValveSpec,
    block: &str,
    table: &mut Parameters,
) -> Result<Option<(&'static Form, Vec<ParameterId>)>> {
    let Some(form) = valve.spool_form()? else { return Ok(None) };
    let parameters = form.parameters.iter().map(|parameter| {
        let (name, value) = (format!("{block}.{}", parameter.name), valve.of_spool(parameter.name));
        table.add_between(name, value, (parameter.lower, parameter.upper, parameter.unit))
    });
    Ok(Some((form, parameters.collect::<Result<_>>()?)))
}

/// What a valve passes where it is wide open.
fn passes(valve: &ValveSpec, block: &str, table: &mut Parameters) -> Result<Passes> {
    let mut add = |key: &Key, value| table.add(block, key, value);
    if valve.flow == "orifice" {
        let area = add(key!("valve", "discharge_area_max"), valve.discharge_area_max)?;
        return Ok(Passes::Area(area));
    }
    Ok(Passes::Conductances([
        [
            add(key!("valve", "fill_conductance"), valve.fill_conductance)?,
            add(key!("valve", "fill_critical_ratio"), valve.fill_critical_ratio)?,
        ],
        [
            add(key!("valve", "vent_conductance"), valve.vent_conductance)?,
            add(key!("valve", "vent_critical_ratio"), valve.vent_critical_ratio)?,
        ],
    ]))
}

type Lines = (Vec<LineUnit>, Vec<(usize, Node)>);

fn lines(
    spec: &RigSpec,
    ports: &Ports<'_>,
    valves: &[ValveUnit],
    table: &mut Parameters,
) -> Result<Lines> {
    let (mut units, mut inlets) = (Vec::new(), Vec::new());
    for (k, line) in spec.lines.iter().enumerate() {
        let block = dotted("line", &line.name);
        let to = ports.node(&format!("{block}.to"), &line.to)?;
        let from = match line.from.as_str() {
            "" => Node::Gas(spec.chambers.len() + inlets.len()),
            port => ports.node(&format!("{block}.from"), port)?,
        };
        if from == to || from == Node::Ambient {
            return model(format!(
                "{block}.from = \"{}\" is not allowed: another end than \
                {block}.to, with gas in it, is needed",
                line.from
            ));
        }
        if line.from.is_empty() {
            if !valves.iter().any(|v| Node::Gas(v.to) == from) {
                return model(format!(
                    "{block}.from is missing: no valve feeds that line, and it begins nowhere"
                ));
            }
            inlets.push((k, to));
        }
        let path = if line.kind == "tube" {
            Path::Tube {
                length: table.add(&block, key!("line", "length"), line.length)?,
                diameter: table.add(&block, key!("line", "diameter"), line.diameter)?,
            }
        } else {
            Path::Orifice(table.add(&block, key!("line", "discharge_area"), line.discharge_area)?)
        };
        units.push(LineUnit { from, to, path, segments: line.segments });
    }
    Ok((units, inlets))
}

/// The tubes that carry waves, with places for their gases and flows.
fn waves(
    spec: &RigSpec,
    lines: &[LineUnit],
    inlets: usize,
    table: &mut Parameters,
) -> Result<Vec<WaveUnit>> {
    let (mut gas, mut flow) = (spec.chambers.len() + inlets, 0);
    let mut units = Vec::new();
    for (k, (line, unit)) in spec.lines.iter().zip(lines).enumerate() {
        let (Path::Tube { length, diameter }, true) = (unit.path, line.segments > 0) else {
            continue;
        };
        let (block, segments) = (dotted("line", &line.name), line.segments);
        let alpha = table.add(&block, key!("line", "alpha"), line.alpha)?;
        units.push(WaveUnit { line: k, length, diameter, alpha, segments, gas, flow });
        (gas, flow) = (gas + segments - 1, flow + segments);
    }
    Ok(units)
}

fn gases(
    spec: &RigSpec,
    inlets: &[(usize, Node)],
    waves: &[WaveUnit],
    lines: &[LineUnit],
    table: &mut Parameters,
) -> Result<Vec<GasUnit>> {
    let mut units = Vec::new();
    let plain = |volume, law, initial_pressure| GasUnit {
        volume,
        law,
        initial_pressure,
        tubes: Vec::new(),
        pressure_zero: None,
    };
    let begins = |end: Node| match end {
        Node::Gas(gas) => spec.chambers.get(gas).map_or(0.0, |c| c.initial_pressure),
        Node::Supply(supply) => spec.supplies[supply].initial_pressure,
        Node::Ambient => 0.0,
    };
    for chamber in &spec.chambers {
        let block = dotted("chamber", &chamber.name);
        let volume = table.add(&block, key!("chamber", "dead_volume"), chamber.dead_volume)?;
        let law = if chamber.gas == "energy_balance" {
            let key = key!("chamber", "heat_transfer_coefficient");
            GasLaw::Energy(table.add(&block, key, chamber.heat_transfer_coefficient)?)
        } else {
            GasLaw::Coefficients([
                table.add(&block, key!("chamber", "alpha_in"), chamber.alpha_in)?,
                table.add(&block, key!("chamber", "alpha_out"), chamber.alpha_out)?,
                table.add(&block, key!("chamber", "alpha"), chamber.alpha)?,
            ])
        };
        units.push(plain(Some(volume), law, chamber.initial_pressure));
    }
    for (k, end) in inlets {
        let line = &spec.lines[*k];
        let block = dotted("line", &line.name);
        let volume = table.add(&block, key!("line", "inlet_volume"), line.inlet_volume)?;
        let zero = table.add(&block, key!("line", "pressure_zero"), line.pressure_zero)?;
        let wave = waves.iter().find(|wave| wave.line == *k);
        let law = wave.map_or(GasLaw::Isothermal, |wave| GasLaw::Alike(wave.alpha));
        let inlet = plain(Some(volume), law, begins(*end));
        units.push(GasUnit { pressure_zero: Some(zero), ..inlet });
    }
    for wave in waves {
        let gas = plain(None, GasLaw::Alike(wave.alpha), begins(lines[wave.line].to));
        units.extend(std::iter::repeat_n(gas, wave.segments - 1));
    }
    Ok(units)
}

fn sensors(spec: &RigSpec, table: &mut Parameters, gases: &mut [GasUnit]) -> Result<()> {
    for sensor in &spec.sensors {
        let block = dotted("sensors", &sensor.name);
        let mut add = |key: &Key, value| table.add(&block, key, value);
        let pressure = add(key!("sensors", "pressure_zero"), sensor.pressure_zero)?;
        add(key!("sensors", "angle_zero"), sensor.angle_zero)?;
        if spec.load.is_some() && sensor.name.is_empty() {
            add(key!("sensors", "length_zero"), sensor.length_zero)?;
            add(key!("sensors", "force_gain"), sensor.force_gain)?;
        }
        let chambers = spec.chambers.iter().map(|c| &c.name);
        let known =
            chambers.clone().chain(spec.joints.iter().map(|j| &j.name)).any(|n| *n == sensor.name);
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
    if spec.load.as_ref().is_some_and(|load| !load.is_frame()) {
        coordinates[0].zero = table.find("sensors.length_zero").ok();
        return coordinates;
    }
    for (coordinate, name) in coordinates.iter_mut().zip(coordinate_names(spec)) {
        let own = |name: &str| table.find(&format!("{}.angle_zero", dotted("sensors", name))).ok();
        coordinate.zero = own(&name).or_else(|| own(""));
    }
    coordinates
}
