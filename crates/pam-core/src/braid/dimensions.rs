//! What a muscle measures at rest, and which profile it has.

use crate::error::{named, Result};

/// Constants of the braid and the bladder at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Braid {
    /// Rest length `L0` [m].
    pub rest_length: f64,
    /// Rest outer radius `R0` [m].
    pub rest_radius: f64,
    /// Rest wall thickness `t0` [m].
    pub rest_thickness: f64,
    /// Fibre length `B` [m].
    pub fibre_length: f64,
    /// Turns `N` of one fibre.
    pub turns: f64,
    /// Rubber volume `VB` [m3].
    pub bladder_volume: f64,
}

/// Dimensions of one muscle at rest, checked by whoever states them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dimensions {
    /// Rest length between the fittings [m].
    pub rest_length: f64,
    /// Rest outer diameter [m].
    pub rest_diameter: f64,
    /// Braid angle at rest from the circumferential plane [rad].
    pub braid_angle: f64,
    /// Rest wall thickness of the bladder [m].
    pub wall_thickness: f64,
    /// Elliptic ends.
    pub ends: EndRatio,
    /// Smallest outer radius in extension as a fraction of the rest radius [1].
    pub neck_floor: f64,
    /// Outer profile.
    pub profile: Profile,
}

/// Axis ratio of the elliptic ends, `k = k0 - slope e`, one slope for each direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndRatio {
    /// Axis ratio at rest.
    pub k0: f64,
    /// Slope in contraction.
    pub contraction_slope: f64,
    /// Slope in extension.
    pub extension_slope: f64,
}

/// Which outer profile a muscle has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// Toroidal ends of elliptic section and a cylindrical middle.
    Elliptic,
    /// The same ends with the literal printed choices, for comparison: the fibre's arc over `pi/3`,
    /// and the radius that brings its length nearest to the fibre's where none meets it.
    EllipticPublished,
    /// One radius over the whole length.
    Cylinder,
}

impl Profile {
    /// Names in descriptions.
    pub const NAMES: [(&'static str, Self); 3] = [
        ("cylinder", Self::Cylinder),
        ("elliptic", Self::Elliptic),
        ("elliptic_published", Self::EllipticPublished),
    ];

    /// The profile of a name.
    ///
    /// # Errors
    /// [`Error::Choice`] that lists the names.
    pub fn from_name(name: &str) -> Result<Self> {
        named("muscle.geometry", name, &Self::NAMES)
    }
}
