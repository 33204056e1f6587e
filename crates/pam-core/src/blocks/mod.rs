//! The blocks of a rig: the way of the air (gas, supply, valve, tube, chamber) and that of the
//! force (joint, arm).

pub mod arm;
pub mod chamber;
pub mod gas;
pub mod joint;
pub mod pipe;
pub mod spool;
pub mod supply;
pub mod tube;
pub mod valve;
pub mod wave;
