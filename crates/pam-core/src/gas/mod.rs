//! Gas flow and storage: orifice, tube, servo-valve, supply, chamber.

pub mod chamber;
pub mod orifice;
pub mod supply;
pub mod tube;
pub mod valve;
