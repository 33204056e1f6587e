//! What the muscles move, of any kind.

use super::units::{BodyUnit, Coordinate, LinkUnit};
use super::Values;
use crate::arm::linear::HangingMass;
use crate::arm::one_link::{OneLink, Stops};
use crate::arm::planar::{Link, PlanarArm};
use crate::scalar::{constant, Scalar};
use crate::Result;
use nalgebra::SVector;

/// A body with its parameters in a scalar type.
#[derive(Debug, Clone)]
pub(crate) enum Body<S> {
    Fixed,
    OneLink(OneLink<S>, Option<Stops>),
    Mass(HangingMass, Option<Stops>),
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
            BodyUnit::Mass(mass) => Self::Mass(*mass, stops),
            BodyUnit::OneLink {
                inertia,
                first_moment,
                payload,
                viscous,
                coulomb,
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
                },
                stops,
            ),
            BodyUnit::Planar { gravity, links } => match links.len() {
                1 => Self::Planar1(planar(*gravity, links, coordinates, values)?),
                2 => Self::Planar2(planar(*gravity, links, coordinates, values)?),
                3 => Self::Planar3(planar(*gravity, links, coordinates, values)?),
                _ => Self::Planar4(planar(*gravity, links, coordinates, values)?),
            },
        })
    }

    /// Whether it moves by itself.
    pub fn moves(&self) -> bool {
        !matches!(self, Self::Fixed)
    }

    /// Accelerations under torques (or the pull) of the muscles; NaN where a mass matrix is singular.
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

impl Body<f64> {
    /// The body's fastest rates [1/s]: of its damping, and on its stops and the springs that pull on each coordinate.
    pub fn fastest(&self, springs: &[f64]) -> f64 {
        let one = |inertia: f64, damping: f64, stops: Option<Stops>| {
            let (stiffness, stop) = stops.map_or((0.0, 0.0), |s| (s.stiffness, s.damping));
            let spring = springs.first().copied().unwrap_or(0.0);
            ((damping + stop) / inertia).max(((stiffness + spring) / inertia).sqrt())
        };
        match self {
            Self::Fixed => 0.0,
            Self::OneLink(arm, stops) => {
                one(arm.total_inertia(), arm.viscous + arm.coulomb / arm.coulomb_speed, *stops)
            }
            Self::Mass(load, stops) => {
                one(load.mass, load.viscous + load.coulomb / load.coulomb_speed, *stops)
            }
            Self::Planar1(arm) => planar_fastest(arm, springs),
            Self::Planar2(arm) => planar_fastest(arm, springs),
            Self::Planar3(arm) => planar_fastest(arm, springs),
            Self::Planar4(arm) => planar_fastest(arm, springs),
        }
    }
}

fn planar<S: Scalar, const N: usize>(
    gravity: f64,
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
        }
    });
    PlanarArm::new(links, gravity)
}

#[inline]
fn planar_accelerations<S: Scalar, const N: usize>(
    arm: &PlanarArm<S, N>,
    angle: &[S],
    rate: &[S],
    torque: &[S],
    out: &mut [S],
) {
    let vector = |values: &[S]| SVector::<S, N>::from_fn(|k, _| values[k]);
    match arm.acceleration(&vector(angle), &vector(rate), &vector(torque)) {
        Ok(acceleration) => out.copy_from_slice(acceleration.as_slice()),
        Err(_) => out.fill(constant(f64::NAN)),
    }
}

/// Over a grid of poses: the joints' damping, stops and springs against what each pose lets a torque on one joint move.
fn planar_fastest<const N: usize>(arm: &PlanarArm<f64, N>, springs: &[f64]) -> f64 {
    let mut fastest = 0.0_f64;
    for pose in 0..POSES.pow(N as u32) {
        let angle = SVector::<f64, N>::from_fn(|k, _| {
            let share = (pose / POSES.pow(k as u32) % POSES) as f64 / (POSES - 1) as f64;
            let (low, high) = arm.links()[k]
                .stops
                .map_or((-std::f64::consts::PI, std::f64::consts::PI), |s| (s.min_angle, s.max_angle));
            low + (high - low) * share
        });
        // No inverse: a mass matrix that is singular is refused where the rig is made.
        let Some(mobility) = arm.mass_matrix(&angle).try_inverse() else { return f64::INFINITY };
        // The joints together move faster than any alone: the sum of the diagonals bounds it.
        let (mut damping, mut stiffness) = (0.0, 0.0);
        for (k, link) in arm.links().iter().enumerate() {
            let (spring, stop) = link.stops.map_or((0.0, 0.0), |s| (s.stiffness, s.damping));
            damping += mobility[(k, k)] * (link.viscous + link.coulomb / link.coulomb_speed + stop);
            stiffness += mobility[(k, k)] * (spring + springs.get(k).copied().unwrap_or(0.0));
        }
        fastest = fastest.max(damping).max(stiffness.sqrt());
    }
    fastest
}
