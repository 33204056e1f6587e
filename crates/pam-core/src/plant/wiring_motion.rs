//! How the muscles, joints and bodies of a description fit together.

use super::parameters::Parameters;
use super::units::{BodyUnit, Coordinate, Group, LinkUnit, MOST_LINKS};
use crate::blocks::arm::planar::Stops;
use crate::blocks::joint::Joint;
use crate::description::{dotted, ArmSpec, JointSpec, LinkSpec, LoadSpec, RigSpec};
use crate::error::model;
use crate::key;
use crate::keys::Key;
use crate::muscle::{CompiledMuscle, Muscle};
use crate::Result;

pub(super) fn coordinates(spec: &RigSpec, table: &mut Parameters) -> Result<Vec<Coordinate>> {
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
        let stops = load_stops(load, rest);
        return Ok(vec![Coordinate { rest: 0.0, stops, spring: None, zero: None }]);
    }
    let named = |port: &str| spec.joints.iter().position(|j| dotted("joint", &j.name) == port);
    match &spec.arm {
        None if spec.joints.is_empty() && spec.muscles.is_empty() => Ok(Vec::new()),
        None if spec.joints.is_empty() => {
            model("a rig with [muscle] needs [joint] and [arm], or [load]")
        }
        None => model("a rig with [joint] needs [arm]"),
        Some(_) if spec.joints.is_empty() => model("a rig with [arm] needs [joint]"),
        Some(arm) if arm.kind == "one_link" => match spec.joints.as_slice() {
            [joint] => Ok(vec![coordinate(joint, table)?]),
            _ => model(format!(
                "a one-link arm has one joint, and the rig has {}",
                spec.joints.len()
            )),
        },
        Some(arm) => {
            let links = arm.links.len();
            if !(1..=MOST_LINKS).contains(&links) || links != spec.joints.len() {
                return model(format!(
                    "a planar arm has 1 to {MOST_LINKS} links and as many joints; the rig has \
                        {links} links and {} joints",
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
            order.iter().map(|k| coordinate(&spec.joints[*k], table)).collect()
        }
    }
}

/// A joint with its stops and its spring.
fn coordinate(joint: &JointSpec, table: &mut Parameters) -> Result<Coordinate> {
    let block = dotted("joint", &joint.name);
    let mut add = |key: &Key, value| table.add(&block, key, value);
    Ok(Coordinate {
        rest: joint.rest_angle,
        stops: Some(Stops {
            min_angle: joint.min_angle,
            max_angle: joint.max_angle,
            stiffness: joint.stop_stiffness,
            damping: joint.stop_damping,
        }),
        spring: Some([
            add(key!("joint", "stiffness"), joint.stiffness)?,
            add(key!("joint", "spring_angle"), joint.spring_angle)?,
        ]),
        zero: None,
    })
}

/// The coordinate that a joint's port names, in the order of the links.
pub(crate) fn coordinate_of(spec: &RigSpec, port: &str) -> Option<usize> {
    match &spec.arm {
        Some(arm) if arm.kind == "planar" => arm.links.iter().position(|l| l.joint == port),
        _ => spec.joints.iter().position(|j| dotted("joint", &j.name) == port),
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

pub(super) fn groups(
    spec: &RigSpec,
    known: &[Group],
    table: &mut Parameters,
) -> Result<Vec<Group>> {
    let mut units: Vec<Group> = Vec::new();
    for (k, group) in spec.muscles.iter().enumerate() {
        let block = dotted("muscle", &group.name);
        let chamber =
            spec.chambers.iter().position(|c| dotted("chamber", &c.name) == group.chamber);
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
            let Some(transmission) = group.transmission.as_ref().or(joint.transmission.as_ref())
            else {
                return model(format!(
                    "{block} has no transmission: neither [transmission] nor its joint says how it \
                        pulls"
                ));
            };
            (coordinate, Joint::new(transmission)?)
        };
        let again = known.get(k).and_then(|old| old.muscle.respecified(&group.muscle));
        let muscle = match again {
            Some(muscle) => muscle,
            None => match spec.muscles[..k].iter().position(|m| m.muscle == group.muscle) {
                Some(same) => units[same].muscle.clone(),
                None => CompiledMuscle::new(Muscle::new(&group.muscle)?)?,
            },
        };
        let own = &group.muscle;
        let mut add = |key: &Key, value| table.add(&block, key, value);
        units.push(Group {
            chamber,
            coordinate,
            joint,
            scale: add(key!("muscle", "modulus_scale"), own.modulus_scale)?,
            softening: add(key!("muscle", "softening"), own.softening)?,
            temperature: add(key!("muscle", "temperature"), own.temperature)?,
            reference_temperature: group.muscle.reference_temperature,
            count: f64::from(group.muscle.count),
            rest_length: group.muscle.rest_length,
            direction: muscle.has_direction(),
            muscle,
        });
    }
    if !spec.joints.is_empty() && units.is_empty() {
        return model("a rig with [joint] needs [muscle]");
    }
    Ok(units)
}

pub(super) fn body(spec: &RigSpec, table: &mut Parameters) -> Result<BodyUnit> {
    if let Some(load) = spec.load.as_ref().filter(|load| !load.is_frame()) {
        let mut add = |key: &Key, value| table.add("load", key, value);
        return Ok(BodyUnit::Mass {
            mass: add(key!("load", "mass"), load.mass)?,
            viscous: add(key!("load", "viscous"), load.viscous)?,
            coulomb: add(key!("load", "coulomb"), load.coulomb)?,
            coulomb_speed: load.coulomb_speed,
            gravity: load.gravity,
        });
    }
    let Some(arm) = &spec.arm else { return Ok(BodyUnit::Fixed) };
    if arm.kind == "planar" {
        return planar(arm, table);
    }
    let mut add = |key: &Key, value| table.add("arm", key, value);
    Ok(BodyUnit::OneLink {
        inertia: add(key!("arm", "inertia"), arm.inertia)?,
        first_moment: add(key!("arm", "first_moment"), arm.first_moment)?,
        payload: add(key!("arm", "payload"), arm.payload)?,
        viscous: add(key!("arm", "viscous"), arm.viscous)?,
        coulomb: add(key!("arm", "coulomb"), arm.coulomb)?,
        base_angle: add(key!("arm", "base_angle"), arm.base_angle)?,
        centre_angle: add(key!("arm", "centre_angle"), arm.centre_angle)?,
        length: arm.length,
        coulomb_speed: arm.coulomb_speed,
        gravity: arm.gravity,
    })
}

fn planar(arm: &ArmSpec, table: &mut Parameters) -> Result<BodyUnit> {
    let mut unit = |link: &LinkSpec| -> Result<LinkUnit> {
        let block = dotted("link", &link.name);
        let mut add = |key: &Key, value| table.add(&block, key, value);
        Ok(LinkUnit {
            length: add(key!("link", "length"), link.length)?,
            mass: add(key!("link", "mass"), link.mass)?,
            centre: add(key!("link", "centre"), link.centre)?,
            inertia: add(key!("link", "inertia"), link.inertia)?,
            payload: add(key!("link", "payload"), link.payload)?,
            viscous: add(key!("link", "viscous"), link.viscous)?,
            coulomb: add(key!("link", "coulomb"), link.coulomb)?,
            coulomb_speed: link.coulomb_speed,
        })
    };
    let links = arm.links.iter().map(&mut unit).collect::<Result<_>>()?;
    let base_angle = table.add("arm", key!("arm", "base_angle"), arm.base_angle)?;
    Ok(BodyUnit::Planar { gravity: arm.gravity, base_angle, links })
}
