//! The scalar parameters of a rig as one table, so that any of them can carry a derivative.

use crate::scalar::{constant, Scalar};
use crate::{Error, Result};
use nalgebra::Const;
use num_dual::{Derivative, DualSVec64};

macro_rules! parameters {
    ($($variant:ident = $name:literal),+ $(,)?) => {
        /// A scalar parameter of a rig.
        #[allow(missing_docs)]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum ParameterId { $($variant),+ }

        impl ParameterId {
            /// Every parameter, in the order of the table.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// Dotted name, for example `arm.payload`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }
        }
    };
}

parameters! {
    SupplyVolume = "supply.volume",
    DischargeArea = "valve.discharge_area_max",
    NullVoltage = "valve.null_voltage",
    DeadVolume = "chamber.dead_volume",
    AlphaIn = "chamber.alpha_in",
    AlphaOut = "chamber.alpha_out",
    Alpha = "chamber.alpha",
    ModulusScale = "muscle.modulus_scale",
    Inertia = "arm.inertia",
    FirstMoment = "arm.first_moment",
    Payload = "arm.payload",
    Viscous = "arm.viscous",
    Coulomb = "arm.coulomb",
    PressureZero = "sensors.pressure_zero",
    AngleZero = "sensors.angle_zero",
    LeakConductance = "leak_muscle.conductance",
    LeakLaminarShare = "leak_muscle.laminar_share",
    HeatCoefficient = "heat_transfer.heat_transfer_coefficient",
    InitialTemperatureRise = "heat_transfer.initial_temperature_rise",
    FrictionConstant = "muscle_hysteresis.friction_constant",
    FrictionPressure = "muscle_hysteresis.friction_pressure",
    Presliding = "muscle_hysteresis.presliding",
}

impl ParameterId {
    /// The parameter of a dotted name.
    ///
    /// # Errors
    /// [`Error::Model`] that lists the names when there is none.
    pub fn from_name(name: &str) -> Result<Self> {
        Self::ALL.iter().copied().find(|p| p.name() == name).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|p| p.name()).collect();
            Error::Model(format!(
                "no scalar parameter '{name}' that can vary; there are: {}",
                names.join(", ")
            ))
        })
    }
}

/// Number of parameters in the table.
pub const COUNT: usize = ParameterId::ALL.len();

/// Values of all parameters.
#[derive(Debug, Clone, Copy)]
pub struct Values<S> {
    values: [S; COUNT],
}

impl Values<f64> {
    /// All parameters zero.
    pub fn zero() -> Self {
        Self { values: [0.0; COUNT] }
    }

    /// Set one value.
    pub fn set(&mut self, id: ParameterId, value: f64) {
        self.values[id as usize] = value;
    }

    /// Plain numbers as constants of another scalar type.
    pub fn lift<S: Scalar>(&self) -> Values<S> {
        Values { values: self.values.map(constant) }
    }
}

impl<const N: usize> Values<DualSVec64<N>> {
    /// Give a parameter the unit derivative in one lane.
    pub fn seed(&mut self, id: ParameterId, lane: usize) {
        self.values[id as usize].eps = unit(lane);
    }
}

/// Unit derivative in one lane (none when the lane does not exist).
pub fn unit<const N: usize>(lane: usize) -> Derivative<f64, Const<N>, Const<1>> {
    let mut gradient = nalgebra::SVector::<f64, N>::zeros();
    if let Some(entry) = gradient.get_mut(lane) {
        *entry = 1.0;
    }
    Derivative::some(gradient)
}

impl<S: Scalar> std::ops::Index<ParameterId> for Values<S> {
    type Output = S;

    #[inline(always)]
    fn index(&self, id: ParameterId) -> &S {
        &self.values[id as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_unknown_names_are_errors() {
        for id in ParameterId::ALL {
            assert_eq!(ParameterId::from_name(id.name()).unwrap(), *id);
        }
        assert!(ParameterId::from_name("arm.weight").unwrap_err().to_string().contains("arm.payload"));
    }

    #[test]
    fn effect_parameters_stand_in_the_table() {
        for effect in crate::effects::EFFECTS {
            for (parameter, _) in effect.parameters {
                assert!(ParameterId::from_name(&format!("{}.{parameter}", effect.id)).is_ok());
            }
        }
    }
}
