//! Effects that are switched on: their parameters, and the blocks on which they act.

use super::parameters::ParameterId as Id;
use crate::effects::{closure_flow, closure_supply, closure_torque};

/// Parameters of the effects that are switched on, in the order of [`crate::effects::EFFECTS`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct EffectUnits {
    pub supply_leak: Option<[Id; 1]>,
    pub compressor: Option<[Id; 3]>,
    pub dead_band: Option<[Id; 1]>,
    pub dead_zone: Option<[Id; 1]>,
    pub play: Option<[Id; 1]>,
    pub centre_leak: Option<[Id; 2]>,
    pub path: Option<[Id; 2]>,
    pub restriction: Option<[Id; 2]>,
    pub leak: Option<[Id; 2]>,
    pub heat: Option<[Id; 3]>,
    pub hysteresis: Option<[Id; 3]>,
    pub creep: Option<[Id; 2]>,
    pub damping: Option<[Id; 3]>,
    pub activation: Option<[Id; 1]>,
    pub softening: Option<[Id; 2]>,
    pub crowding: Option<[Id; 4]>,
    pub stribeck: Option<[Id; 2]>,
    pub stop: Option<[Id; 5]>,
    pub swing: Option<[Id; 3]>,
    pub payload: Option<[Id; 2]>,
    pub torque: Option<[Id; 10]>,
    pub base: Option<[Id; 3]>,
    pub pressure_lag: Option<[Id; 1]>,
    pub clock: Option<[Id; 3]>,
    pub closure_supply: Option<[Id; closure_supply::PARAMETERS]>,
    pub closure_flow: Option<[Id; closure_flow::PARAMETERS]>,
    pub closure_torque: Option<[Id; closure_torque::PARAMETERS]>,
}

impl EffectUnits {
    /// Some effect acts on a supply.
    pub fn on_supplies(&self) -> bool {
        self.supply_leak.is_some() || self.compressor.is_some() || self.dead_band.is_some()
    }

    /// Some effect acts on joints, arm or load.
    pub fn on_motion(&self) -> bool {
        self.stribeck.is_some() || self.stop.is_some() || self.closure_torque.is_some() || self.on_arm()
    }

    fn on_arm(&self) -> bool {
        self.swing.is_some() || self.payload.is_some() || self.torque.is_some() || self.base.is_some()
    }

    /// A closure acts somewhere on the air.
    pub fn closes_air(&self) -> bool {
        self.closure_flow.is_some() || self.closure_supply.is_some()
    }

    /// Spools move within a sample.
    pub fn moves_spools(&self) -> bool {
        self.path.is_some() || self.play.is_some()
    }

    /// Controls are not the same at every stage of a step: moving spools, or a time that an effect asks for.
    pub fn staged(&self) -> bool {
        self.moves_spools() || self.payload.is_some() || self.torque.is_some()
    }

    /// Something happens between steps.
    pub fn between_steps(&self) -> bool {
        self.moves_spools() || self.compressor.is_some() || self.reads()
    }

    /// Some reading of a pressure may not be that of the gas.
    fn reads(&self) -> bool {
        self.pressure_lag.is_some() || self.restriction.is_some()
    }
}

/// Effects on a supply.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SupplyEffects {
    pub leak: bool,
    /// Its relay among the extras.
    pub compressor: Option<usize>,
    pub dead_band: bool,
    /// What its closure remembers, among the extras.
    pub closure: Option<usize>,
}

/// Effects on a valve.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ValveEffects {
    pub dead_zone: bool,
    pub play: bool,
    pub centre_leak: bool,
    pub path: bool,
    pub restriction: bool,
    /// First of its [`SPOOL_EXTRAS`] among the extras.
    pub spool: Option<usize>,
}

/// Extras of a valve with a moving spool: whether it has begun, the four positions of its path, the spool behind its play.
pub(crate) const SPOOL_EXTRAS: usize = 6;

/// Effects on a group of muscles.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MuscleEffects {
    /// Any of them.
    pub some: bool,
    pub hysteresis: bool,
    /// The damper's length among the extras.
    pub creep: Option<usize>,
    pub damping: bool,
    pub activation: bool,
    pub softening: bool,
    pub crowding: bool,
}

/// Effects on a joint.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct JointEffects {
    pub stribeck: bool,
    pub stop: bool,
    pub torque: bool,
    /// First of what its closure remembers, among the extras.
    pub closure: Option<usize>,
}

/// Effects on the arm.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ArmEffects {
    /// Link that carries a swinging payload, its angle and rate among the extras.
    pub swing: Option<(usize, usize)>,
    /// Link whose payload changes.
    pub payload: Option<usize>,
    /// Angle and rate of the base among the extras.
    pub base: Option<usize>,
}
