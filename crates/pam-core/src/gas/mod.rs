//! Gas flow and storage: orifice, servo-valve, chamber.

pub mod chamber;
pub mod orifice;
pub mod valve;
