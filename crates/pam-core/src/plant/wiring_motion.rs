//! How the muscles, joints and bodies of a description fit together.

use super::parameters::Parameters;
use super::units::{BodyUnit, Coordinate, Group, LinkUnit, MOST_LINKS};
use super::units_effects::{JointEffects, MuscleEffects};
use super::wiring::model;
use crate::blocks::arm::planar::Stops;
use crate::blocks::joint::Joint;
use crate::description::{dotted, ArmSpec, LinkSpec, LoadSpec, RigSpec};
use crate::muscle::{CompiledMuscle, Muscle};
use crate::Result;

pub(super) fn coordinates(spec: &RigSpec) -> Result<Vec<Coordinate>> {
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
        return Ok(vec![Coordinate {
            rest: 0.0,
            stops: load_stops(load, rest),
            zero: None,
            effects: JointEffects::default(),
        }]);
    }
    let coordinate = |joint: &crate::description::JointSpec| Coordinate {
        rest: joint.rest_angle,
        stops: Some(Stops {
            min_angle: joint.min_angle,
            max_angle: joint.max_angle,
            stiffness: joint.stop_stiffness,
            damping: joint.stop_damping,
        }),
        zero: None,
        effects: JointEffects::default(),
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

pub(super) fn groups(spec: &RigSpec, known: &[Group], table: &mut Parameters) -> Result<Vec<Group>> {
    let mut units: Vec<Group> = Vec::new();
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
                Some(same) => units[same].muscle.clone(),
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
            effects: MuscleEffects::default(),
            muscle,
        });
    }
    if !spec.joints.is_empty() && units.is_empty() {
        return model("a rig with [joint] needs [muscle]");
    }
    Ok(units)
}

pub(super) fn body(spec: &RigSpec, table: &mut Parameters) -> BodyUnit {
    if let Some(load) = spec.load.as_ref().filter(|load| !load.is_frame()) {
        return BodyUnit::Mass {
            mass: table.add("load.mass".into(), load.mass),
            viscous: table.add("load.viscous".into(), load.viscous),
            coulomb: table.add("load.coulomb".into(), load.coulomb),
            coulomb_speed: load.coulomb_speed,
            gravity: load.gravity,
        };
    }
    let Some(arm) = &spec.arm else { return BodyUnit::Fixed };
    if arm.kind == "planar" {
        return planar(arm, table);
    }
    BodyUnit::OneLink {
        inertia: table.add("arm.inertia".into(), arm.inertia),
        first_moment: table.add("arm.first_moment".into(), arm.first_moment),
        payload: table.add("arm.payload".into(), arm.payload),
        viscous: table.add("arm.viscous".into(), arm.viscous),
        coulomb: table.add("arm.coulomb".into(), arm.coulomb),
        length: arm.length,
        coulomb_speed: arm.coulomb_speed,
        gravity: arm.gravity,
    }
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
