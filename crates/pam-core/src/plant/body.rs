//! What the muscles move, of any kind.

use super::units::{BodyUnit, Coordinate, LinkUnit};
use super::Values;
use crate::blocks::arm::linear::HangingMass;
use crate::blocks::arm::one_link::{Mounting, OneLink, Spring, Stops};
use crate::blocks::arm::planar::{Link, PlanarArm};
use crate::scalar::{constant, Scalar};
use crate::Result;
use nalgebra::SVector;

/// A body with its parameters in a scalar type.
#[derive(Debug, Clone)]
pub(crate) enum Body<S> {
    Fixed,
    OneLink(OneLink<S>, Option<Stops>),
    Mass(HangingMass<S>, Option<Stops>),
    Planar1(PlanarArm<S, 1>),
    Planar2(PlanarArm<S, 2>),
    Planar3(PlanarArm<S, 3>),
    Planar4(PlanarArm<S, 4>),
}

/// Angles of each joint in the grid of poses that an arm's fastest rate is looked for on.
const POSES: usize = 9;

impl<S: Scalar> Body<S> {
    pub fn new(unit: &BodyUnit, coordinates: &[Coordinate], values: &Values<S>) -> Result<Self> {
        let stops = coordinates.first().and_then(|c| c.stops);
        Ok(match unit {
            BodyUnit::Fixed => Self::Fixed,
            BodyUnit::Mass { mass, viscous, coulomb, coulomb_speed, gravity } => Self::Mass(
                HangingMass {
                    mass: values[*mass],
                    viscous: values[*viscous],
                    coulomb: values[*coulomb],
                    coulomb_speed: *coulomb_speed,
                    gravity: *gravity,
                },
                stops,
            ),
            BodyUnit::OneLink {
                inertia,
                first_moment,
                payload,
                viscous,
                coulomb,
                base_angle,
                centre_angle,
                length,
                coulomb_speed,
                gravity,
            } => Self::OneLink(
                OneLink {
                    inertia: values[*inertia],
                    first_moment: values[*first_moment],
                    length: *length,
                    payload: values[*payload],
                    viscous: values[*viscous],
                    coulomb: values[*coulomb],
                    coulomb_speed: *coulomb_speed,
                    gravity: *gravity,
                    spring: spring(coordinates.first(), values),
                    mounting: Mounting::new(values[*base_angle], values[*centre_angle]),
                },
                stops,
            ),
            BodyUnit::Planar { gravity, base_angle, links } => {
                let mounted = (*gravity, values[*base_angle]);
                match links.len() {
                    1 => Self::Planar1(planar(mounted, links, coordinates, values)?),
                    2 => Self::Planar2(planar(mounted, links, coordinates, values)?),
                    3 => Self::Planar3(planar(mounted, links, coordinates, values)?),
                    _ => Self::Planar4(planar(mounted, links, coordinates, values)?),
                }
            }
        })
    }

    /// Whether it moves by itself.
    pub fn moves(&self) -> bool {
        !matches!(self, Self::Fixed)
    }

    /// Accelerations under torques (or the pull) of the muscles; NaN where a mass matrix is
    /// singular.
    #[inline]
    pub fn accelerations(&self, angle: &[S], rate: &[S], torque: &[S], out: &mut [S]) {
        match self {
            Self::Fixed => out.fill(constant(0.0)),
            Self::OneLink(arm, stops) => {
                let stop = stops.map_or(constant(0.0), |s| s.torque(angle[0], rate[0]));
                out[0] = arm.acceleration(angle[0], rate[0], torque[0], stop);
            }
            Self::Mass(load, stops) => {
                let stop = stops.map_or(constant(0.0), |s| s.torque(angle[0], rate[0]));
                out[0] = load.acceleration(rate[0], torque[0], stop);
            }
            Self::Planar1(arm) => planar_accelerations(arm, angle, rate, torque, out),
            Self::Planar2(arm) => planar_accelerations(arm, angle, rate, torque, out),
            Self::Planar3(arm) => planar_accelerations(arm, angle, rate, torque, out),
            Self::Planar4(arm) => planar_accelerations(arm, angle, rate, torque, out),
        }
    }
}

impl<S: Scalar> Body<S> {
    /// Friction, spring and stop of a coordinate [N m].
    pub fn passive(&self, k: usize, angle: S, rate: S) -> S {
        let stop = |stops: Option<Stops>| stops.map_or(constant(0.0), |s| s.torque(angle, rate));
        match self {
            Self::Fixed => constant(0.0),
            Self::OneLink(arm, stops) => {
                stop(*stops) + arm.spring.torque(angle) - arm.friction(rate)
            }
            Self::Mass(load, stops) => stop(*stops) - load.friction(rate),
            Self::Planar1(arm) => planar_passive(arm, k, angle, rate),
            Self::Planar2(arm) => planar_passive(arm, k, angle, rate),
            Self::Planar3(arm) => planar_passive(arm, k, angle, rate),
            Self::Planar4(arm) => planar_passive(arm, k, angle, rate),
        }
    }

    /// Torque on the first joint that holds the arm against gravity [N m].
    pub fn weight(&self, angle: &[S]) -> S {
        match self {
            Self::Fixed | Self::Mass(..) => constant(0.0),
            Self::OneLink(arm, _) => arm.weight(angle[0]),
            Self::Planar1(arm) => arm.gravity_torque(&vector(angle))[0],
            Self::Planar2(arm) => arm.gravity_torque(&vector(angle))[0],
            Self::Planar3(arm) => arm.gravity_torque(&vector(angle))[0],
            Self::Planar4(arm) => arm.gravity_torque(&vector(angle))[0],
        }
    }

    /// Torque of gravity on the joint of a link [N m] where the link is level: its own weight, its
    /// payload's and that of the links behind it.
    pub fn level_weight(&self, link: usize) -> S {
        match self {
            Self::Fixed | Self::Mass(..) => constant(0.0),
            Self::OneLink(arm, _) => arm.level_weight(),
            Self::Planar1(arm) => arm.level_weight(link),
            Self::Planar2(arm) => arm.level_weight(link),
            Self::Planar3(arm) => arm.level_weight(link),
            Self::Planar4(arm) => arm.level_weight(link),
        }
    }

    /// Gravity [m/s2].
    pub fn gravity(&self) -> f64 {
        match self {
            Self::Fixed => 0.0,
            Self::OneLink(arm, _) => arm.gravity,
            Self::Mass(load, _) => load.gravity,
            Self::Planar1(arm) => arm.gravity(),
            Self::Planar2(arm) => arm.gravity(),
            Self::Planar3(arm) => arm.gravity(),
            Self::Planar4(arm) => arm.gravity(),
        }
    }

    /// Payload at the end of a link, or the hanging mass [kg].
    pub fn payload(&self, link: usize) -> S {
        match self {
            Self::Fixed => constant(0.0),
            Self::OneLink(arm, _) => arm.payload,
            Self::Mass(load, _) => load.mass,
            Self::Planar1(arm) => arm.links()[link].payload,
            Self::Planar2(arm) => arm.links()[link].payload,
            Self::Planar3(arm) => arm.links()[link].payload,
            Self::Planar4(arm) => arm.links()[link].payload,
        }
    }

    /// The same with another payload.
    pub fn with_payload(&self, link: usize, payload: S) -> Self {
        match self {
            Self::Fixed => Self::Fixed,
            Self::OneLink(arm, stops) => Self::OneLink(OneLink { payload, ..*arm }, *stops),
            Self::Mass(load, stops) => Self::Mass(HangingMass { mass: payload, ..*load }, *stops),
            Self::Planar1(arm) => Self::Planar1(arm.with_payload(link, payload)),
            Self::Planar2(arm) => Self::Planar2(arm.with_payload(link, payload)),
            Self::Planar3(arm) => Self::Planar3(arm.with_payload(link, payload)),
            Self::Planar4(arm) => Self::Planar4(arm.with_payload(link, payload)),
        }
    }

    /// Accelerations by torques alone; NaN where a mass matrix is singular.
    pub fn response(&self, angle: &[S], torque: &[S]) -> Vec<S> {
        match self {
            Self::Fixed => torque.iter().map(|_| constant(0.0)).collect(),
            Self::OneLink(arm, _) => vec![torque[0] / arm.total_inertia()],
            Self::Mass(load, _) => vec![torque[0] / load.mass],
            Self::Planar1(arm) => planar_response(arm, angle, torque),
            Self::Planar2(arm) => planar_response(arm, angle, torque),
            Self::Planar3(arm) => planar_response(arm, angle, torque),
            Self::Planar4(arm) => planar_response(arm, angle, torque),
        }
    }

    /// End of a link: by how much each coordinate moves it, across and up [m], and how it
    /// accelerates by their rates alone [m/s2].
    pub fn end(&self, link: usize, angle: &[S], rate: &[S]) -> (Vec<[S; 2]>, [S; 2]) {
        let mut sides = vec![[constant(0.0); 2]; angle.len()];
        let mut own = [constant::<S>(0.0); 2];
        let (mut direction, mut turn) = (self.base_angle(), constant::<S>(0.0));
        for i in 0..=link.min(angle.len().saturating_sub(1)) {
            direction += angle[i];
            turn += rate[i];
            let (sin, cos) = direction.sin_cos();
            let length = self.length(i);
            for side in &mut sides[..=i] {
                side[0] += length * cos;
                side[1] += length * sin;
            }
            let inwards = length * turn * turn;
            own[0] -= inwards * sin;
            own[1] += inwards * cos;
        }
        (sides, own)
    }

    /// Angle of the first link from the gravity vector where its joint's is zero [rad].
    pub fn base_angle(&self) -> S {
        match self {
            Self::Fixed | Self::Mass(..) => constant(0.0),
            Self::OneLink(arm, _) => arm.mounting.base_angle(),
            Self::Planar1(arm) => arm.base_angle(),
            Self::Planar2(arm) => arm.base_angle(),
            Self::Planar3(arm) => arm.base_angle(),
            Self::Planar4(arm) => arm.base_angle(),
        }
    }

    fn length(&self, link: usize) -> S {
        match self {
            Self::Fixed | Self::Mass(..) => constant(0.0),
            Self::OneLink(arm, _) => constant(arm.length),
            Self::Planar1(arm) => arm.links()[link].length,
            Self::Planar2(arm) => arm.links()[link].length,
            Self::Planar3(arm) => arm.links()[link].length,
            Self::Planar4(arm) => arm.links()[link].length,
        }
    }
}

impl Body<f64> {
    /// The body's fastest rates [1/s]: of its damping and of its stops, with damping and stiffness
    /// beside its own on each coordinate, and a base that a torque on the first one moves by so
    /// much [1/(kg m2)].
    pub fn fastest(&self, loads: &[(f64, f64)], base: f64) -> f64 {
        let one = |inertia: f64, damping: f64, spring: f64, stops: Option<Stops>| {
            let (stiffness, stop) = stops.map_or((0.0, 0.0), |s| (s.stiffness, s.damping));
            let stiffness = stiffness + spring;
            let (more, stiffer) = loads.first().copied().unwrap_or_default();
            let inertia = if base > 0.0 { 1.0 / (1.0 / inertia + base) } else { inertia };
            ((damping + stop + more) / inertia).max(((stiffness + stiffer) / inertia).sqrt())
        };
        match self {
            Self::Fixed => 0.0,
            Self::OneLink(arm, stops) => {
                let damping = arm.viscous + arm.coulomb / arm.coulomb_speed;
                one(arm.total_inertia(), damping, arm.spring.stiffness, *stops)
            }
            Self::Mass(load, stops) => {
                one(load.mass, load.viscous + load.coulomb / load.coulomb_speed, 0.0, *stops)
            }
            Self::Planar1(arm) => planar_fastest(arm, loads, base),
            Self::Planar2(arm) => planar_fastest(arm, loads, base),
            Self::Planar3(arm) => planar_fastest(arm, loads, base),
            Self::Planar4(arm) => planar_fastest(arm, loads, base),
        }
    }

    /// How much a force at the end of a link accelerates it at most [1/kg]: a bound over the
    /// directions, stretched out.
    pub fn end_mobility(&self, link: usize) -> f64 {
        let reach: f64 = (0..=link).map(|k| self.length(k)).sum();
        match self {
            Self::OneLink(arm, _) => reach * reach / arm.total_inertia(),
            Self::Planar1(arm) => planar_mobility(arm, link),
            Self::Planar2(arm) => planar_mobility(arm, link),
            Self::Planar3(arm) => planar_mobility(arm, link),
            Self::Planar4(arm) => planar_mobility(arm, link),
            _ => 0.0,
        }
    }
}

#[inline]
fn vector<S: Scalar, const N: usize>(values: &[S]) -> SVector<S, N> {
    SVector::from_fn(|k, _| values[k])
}

fn planar_passive<S: Scalar, const N: usize>(
    arm: &PlanarArm<S, N>,
    k: usize,
    angle: S,
    rate: S,
) -> S {
    let link = &arm.links()[k];
    let friction = link.viscous * rate + link.coulomb * (rate / link.coulomb_speed).tanh();
    let stop = link.stops.map_or(constant(0.0), |s| s.torque(angle, rate));
    stop + link.spring.torque(angle) - friction
}

/// The spring across a joint; none on a load.
fn spring<S: Scalar>(coordinate: Option<&Coordinate>, values: &Values<S>) -> Spring<S> {
    match coordinate.and_then(|c| c.spring) {
        Some([stiffness, angle]) => Spring { stiffness: values[stiffness], angle: values[angle] },
        None => Spring::none(),
    }
}

fn planar_response<S: Scalar, const N: usize>(
    arm: &PlanarArm<S, N>,
    angle: &[S],
    torque: &[S],
) -> Vec<S> {
    match arm.response(&vector(angle), &vector(torque)) {
        Ok(acceleration) => acceleration.as_slice().to_vec(),
        Err(_) => vec![constant(f64::NAN); N],
    }
}

fn planar<S: Scalar, const N: usize>(
    (gravity, base_angle): (f64, S),
    units: &[LinkUnit],
    coordinates: &[Coordinate],
    values: &Values<S>,
) -> Result<PlanarArm<S, N>> {
    let links = std::array::from_fn(|k| {
        let (unit, coordinate) = (&units[k.min(units.len() - 1)], coordinates.get(k));
        Link {
            length: values[unit.length],
            mass: values[unit.mass],
            centre: values[unit.centre],
            inertia: values[unit.inertia],
            payload: values[unit.payload],
            viscous: values[unit.viscous],
            coulomb: values[unit.coulomb],
            coulomb_speed: unit.coulomb_speed,
            stops: coordinate.and_then(|c| c.stops),
            spring: spring(coordinate, values),
        }
    });
    Ok(PlanarArm::new(links, gravity)?.tilted(base_angle))
}

#[inline]
fn planar_accelerations<S: Scalar, const N: usize>(
    arm: &PlanarArm<S, N>,
    angle: &[S],
    rate: &[S],
    torque: &[S],
    out: &mut [S],
) {
    match arm.acceleration(&vector(angle), &vector(rate), &vector(torque)) {
        Ok(acceleration) => out.copy_from_slice(acceleration.as_slice()),
        Err(_) => out.fill(constant(f64::NAN)),
    }
}

/// Over a grid of poses: the joints' damping and stops against what each pose lets a torque on one
/// joint move.
fn planar_fastest<const N: usize>(arm: &PlanarArm<f64, N>, loads: &[(f64, f64)], base: f64) -> f64 {
    let mut fastest = 0.0_f64;
    for pose in 0..POSES.pow(N as u32) {
        let angle = SVector::<f64, N>::from_fn(|k, _| {
            let share = (pose / POSES.pow(k as u32) % POSES) as f64 / (POSES - 1) as f64;
            let (low, high) =
                arm.links()[k].stops.map_or((-std::f64::consts::PI, std::f64::consts::PI), |s| {
                    (s.min_angle, s.max_angle)
                });
            low + (high - low) * share
        });
        // No inverse: a mass matrix that is singular is refused where the rig is made.
        let Some(mobility) = arm.mass_matrix(&angle).try_inverse() else { return f64::INFINITY };
        // The joints together move faster than any alone: the sum of the diagonals bounds it.
        let (mut damping, mut stiffness) = (0.0, 0.0);
        for (k, link) in arm.links().iter().enumerate() {
            let (spring, stop) = link.stops.map_or((0.0, 0.0), |s| (s.stiffness, s.damping));
            let (more, stiffer) = loads.get(k).copied().unwrap_or_default();
            let moves = mobility[(k, k)] + if k == 0 { base } else { 0.0 };
            damping += moves * (link.viscous + link.coulomb / link.coulomb_speed + stop + more);
            stiffness += moves * (spring + link.spring.stiffness + stiffer);
        }
        fastest = fastest.max(damping).max(stiffness.sqrt());
    }
    fastest
}

/// Over the same grid: the trace of what a force at the end of a link moves it by.
fn planar_mobility<const N: usize>(arm: &PlanarArm<f64, N>, link: usize) -> f64 {
    let mut largest = 0.0_f64;
    for pose in 0..POSES.pow(N as u32) {
        let angle = SVector::<f64, N>::from_fn(|k, _| {
            let share = (pose / POSES.pow(k as u32) % POSES) as f64 / (POSES - 1) as f64;
            std::f64::consts::PI * (2.0 * share - 1.0)
        });
        let Some(mobility) = arm.mass_matrix(&angle).try_inverse() else { return f64::INFINITY };
        let (mut sides, mut direction) = ([SVector::<f64, N>::zeros(); 2], 0.0);
        for i in 0..=link.min(N - 1) {
            direction += angle[i];
            let (sin, cos) = direction.sin_cos();
            for (side, part) in sides.iter_mut().zip([cos, sin]) {
                side.rows_mut(0, i + 1).add_scalar_mut(arm.links()[i].length * part);
            }
        }
        largest = largest.max(sides.iter().map(|s| (mobility * s).dot(s)).sum());
    }
    largest
}
