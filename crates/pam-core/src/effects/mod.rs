//! Physics that a nominal model leaves out: one file each, plugged into a block.
//!
//! An effect that is absent costs the step loop one branch on a flag.

pub mod heat_transfer;
pub mod leak_muscle;
pub mod muscle_hysteresis;

/// Identifier, block and parameters (with their SI units) of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EffectInfo {
    /// Identifier, public API.
    pub id: &'static str,
    /// Block in which it acts.
    pub block: &'static str,
    /// Parameter names and SI units.
    pub parameters: &'static [(&'static str, &'static str)],
}

/// Every effect of the core.
pub const EFFECTS: &[EffectInfo] = &[leak_muscle::INFO, heat_transfer::INFO, muscle_hysteresis::INFO];
