//! Joints: how a muscle's shortening turns a link.
//!
//! Every joint gives the muscle's shortening `d(theta)` and its slope, the moment arm `dd/dtheta`;
//! the torque of a pull `F` is `F dd/dtheta`, so that `tau dtheta = F dd`: what the muscle gives,
//! the link gets. Only the printed tendon joint ([`tendon::Torque::Published`]) gives less.

mod point;
pub mod polynomial;
pub mod pulley;
mod spec;
pub mod tendon;

pub use self::point::JointPoint;
pub use self::polynomial::Polynomial;
pub use self::pulley::Pulley;
pub use self::spec::TransmissionSpec;
pub use self::tendon::TendonJoint;
use crate::error::{Error, Result};
use crate::key;
use crate::scalar::{chained, constant, Scalar};

/// A joint of any kind.
#[derive(Debug, Clone, PartialEq)]
pub enum Joint {
    /// Four-parameter tendon.
    Tendon(TendonJoint),
    /// Constant radius.
    Pulley(Pulley),
    /// Polynomial of the angle.
    Polynomial(Polynomial),
    /// No joint: the coordinate is the shortening itself, of a linear load.
    Direct,
}

impl Joint {
    /// Names in descriptions.
    pub const NAMES: [&'static str; 4] = ["tendon", "published", "pulley", "polynomial"];

    /// The joint of a description.
    ///
    /// # Errors
    /// [`Error::Choice`] for an unknown kind, [`Error::Parameter`] for an impossible length.
    pub fn new(spec: &TransmissionSpec) -> Result<Self> {
        let rest = spec.rest_angle;
        match spec.kind.as_str() {
            "tendon" | "published" => {
                let torque = if spec.kind == "tendon" {
                    tendon::Torque::Power
                } else {
                    tendon::Torque::Published
                };
                let [upper_axial, upper_offset, lower_axial, lower_offset] = [
                    (key!("joint", "upper_axial"), spec.upper_axial),
                    (key!("joint", "upper_offset"), spec.upper_offset),
                    (key!("joint", "lower_axial"), spec.lower_axial),
                    (key!("joint", "lower_offset"), spec.lower_offset),
                ]
                .map(|(key, value)| key.check_all("joint", &[value]).map(|()| value));
                let joint = TendonJoint::new(
                    upper_axial?,
                    upper_offset?,
                    lower_axial?,
                    lower_offset?,
                    rest,
                )?;
                Ok(Self::Tendon(joint.with_torque(torque)))
            }
            "pulley" => Ok(Self::Pulley(Pulley::new(spec.radius, rest)?)),
            "polynomial" => Ok(Self::Polynomial(Polynomial::new(&spec.coefficients, rest)?)),
            other => {
                let names: Vec<_> = Self::NAMES.iter().map(|n| format!("\"{n}\"")).collect();
                Err(Error::Choice {
                    name: "joint.kind".into(),
                    value: format!("\"{other}\""),
                    allowed: format!("one of {}", names.join(", ")),
                })
            }
        }
    }

    /// Whether the joint can have an angle [rad].
    #[must_use]
    pub fn reaches(&self, angle: f64) -> bool {
        match self {
            Self::Tendon(joint) => joint.reaches(angle),
            Self::Pulley(_) | Self::Polynomial(_) | Self::Direct => true,
        }
    }

    /// Shortening and moment arms at a joint angle [rad].
    #[inline]
    pub fn eval<S: Scalar>(&self, angle: S) -> JointPoint<S> {
        match self {
            Self::Tendon(joint) if S::DERIVATIVES > 0 => {
                let [shortening, moment_arm, torque_arm] = chained(angle, |angle| {
                    let point = joint.eval(angle);
                    [point.shortening, point.moment_arm, point.torque_arm]
                });
                JointPoint { shortening, moment_arm, torque_arm }
            }
            Self::Tendon(joint) => joint.eval(angle),
            Self::Pulley(joint) => joint.eval(angle),
            Self::Polynomial(joint) => joint.eval(angle),
            Self::Direct => {
                let one = constant(1.0);
                JointPoint { shortening: angle, moment_arm: one, torque_arm: one }
            }
        }
    }
}
