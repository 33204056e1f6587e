//! The blocks of a rig with their ports resolved to indices and their numbers to parameters.

use super::parameters::{ParameterId, Values};
use crate::blocks::arm::planar::Stops;
use crate::blocks::joint::Joint;
use crate::blocks::valve::AreaTable;
use crate::effects::Form;
use crate::muscle::spec::softened;
use crate::muscle::CompiledMuscle;
use crate::scalar::Scalar;

/// Most links of a planar arm.
pub const MOST_LINKS: usize = 4;

/// An end of a flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Node {
    Ambient,
    Supply(usize),
    /// A chamber; behind all chambers the inlet of a line; behind these what lies inside a tube.
    Gas(usize),
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum SupplyUnit {
    Tank(ParameterId),
    Constant,
    Regulator {
        time_constant: ParameterId,
        droop: ParameterId,
        rise_limit: ParameterId,
        fall_limit: ParameterId,
        dead_time: ParameterId,
        dead_band: ParameterId,
        /// The supply in front of it.
        inlet: Option<usize>,
    },
}

/// What a valve passes where it is wide open.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Passes {
    /// The same area on both paths.
    Area(ParameterId),
    /// Conductance and critical ratio where it fills, and where it vents.
    Conductances([[ParameterId; 2]; 2]),
}

#[derive(Debug, Clone)]
pub(crate) struct ValveUnit {
    pub from: Node,
    pub to: usize,
    pub table: AreaTable,
    pub passes: Passes,
    pub null: ParameterId,
    pub half_range: f64,
    /// What its spool does by itself, with the parameters of that.
    pub spool: Option<(&'static Form, Vec<ParameterId>)>,
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
    /// Segments of a tube that carries waves; 0 of any other line.
    pub segments: usize,
}

/// Where a tube that carries waves has its gas and its flows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WaveUnit {
    pub line: usize,
    pub length: ParameterId,
    pub diameter: ParameterId,
    pub alpha: ParameterId,
    pub segments: usize,
    /// The first of the gases between its segments, one less than these.
    pub gas: usize,
    /// The first of its flows, one through each segment.
    pub flow: usize,
}

impl WaveUnit {
    /// The node in front of a segment; behind the last one, the end of the line.
    #[inline]
    pub fn node(&self, lines: &[LineUnit], segment: usize) -> Node {
        let line = &lines[self.line];
        match segment {
            0 => line.from,
            k if k == self.segments => line.to,
            k => Node::Gas(self.gas + k - 1),
        }
    }
}

/// What gives the pressure of a gas.
#[derive(Debug, Clone, Copy)]
pub(crate) enum GasLaw {
    /// Coefficients of inflow, outflow and volume change.
    Coefficients([ParameterId; 3]),
    /// All wall, as an inlet.
    Isothermal,
    /// One coefficient for all that happens to it, as along a tube that carries waves.
    Alike(ParameterId),
    /// An energy balance with a heat transfer coefficient.
    Energy(ParameterId),
}

/// Volume of gas: a chamber, the rigid inlet of a line, or what lies inside a tube.
#[derive(Debug, Clone)]
pub(crate) struct GasUnit {
    /// Fixed volume [m3], none inside a tube.
    pub volume: Option<ParameterId>,
    /// Lines of which half the tube's volume, or half of that of a segment, is here.
    pub tubes: Vec<usize>,
    pub law: GasLaw,
    pub pressure_zero: Option<ParameterId>,
    /// Gauge [Pa]; a line's gas begins at the pressure of the line's end.
    pub initial_pressure: f64,
}

/// Muscles of one kind that share a chamber and a joint.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    pub chamber: usize,
    pub coordinate: usize,
    pub joint: Joint,
    pub muscle: CompiledMuscle,
    pub scale: ParameterId,
    pub softening: ParameterId,
    pub temperature: ParameterId,
    pub reference_temperature: f64,
    pub count: f64,
    pub rest_length: f64,
    pub direction: bool,
}

impl Group {
    /// Factor on every modulus of the muscles at their temperature [1].
    pub fn elastic_scale<S: Scalar>(&self, values: &Values<S>) -> S {
        let [softening, temperature] = [self.softening, self.temperature].map(|id| values[id]);
        values[self.scale] * softened(softening, temperature, self.reference_temperature)
    }
}

/// What moves: a joint angle, or the shortening of a linear load.
#[derive(Debug, Clone)]
pub(crate) struct Coordinate {
    pub rest: f64,
    pub stops: Option<Stops>,
    /// Stiffness of a spring across a joint, and the angle at which it is at rest.
    pub spring: Option<[ParameterId; 2]>,
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
        base_angle: ParameterId,
        centre_angle: ParameterId,
        length: f64,
        coulomb_speed: f64,
        gravity: f64,
    },
    Planar {
        gravity: f64,
        base_angle: ParameterId,
        links: Vec<LinkUnit>,
    },
    Mass {
        mass: ParameterId,
        viscous: ParameterId,
        coulomb: ParameterId,
        coulomb_speed: f64,
        gravity: f64,
    },
}

impl GasUnit {
    /// Whether an energy balance gives its pressure.
    pub fn has_energy(&self) -> bool {
        matches!(self.law, GasLaw::Energy(_))
    }
}

impl SupplyUnit {
    /// The supply in front of a regulator.
    #[inline]
    pub fn inlet(&self) -> Option<usize> {
        match self {
            Self::Regulator { inlet, .. } => *inlet,
            _ => None,
        }
    }
}
