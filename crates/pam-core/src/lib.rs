//! Pneumatic artificial muscles (McKibben muscles) and the arms they drive.
//!
//! The physics of R. M. Robinson's dissertation (University of Maryland, 2014) with its printed
//! errors corrected: muscle geometry and force, supplies, valves, tubes and gas, joints, arms;
//! fixed-step integration, and *cut-chain* simulation, in which measured signals drive each block
//! so that a mismatch with a recording is located in one of them. Every equation is written once,
//! generic over [`scalar::Scalar`], and is read as plain numbers or as dual numbers for exact
//! sensitivities.
//!
//! SI units, radians; pressures are gauge in force equations and absolute in gas equations. Nothing
//! in this crate panics on bad input, prints, or knows Python.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod batch;
pub mod blocks;
pub mod braid;
mod chebyshev;
mod clock;
pub mod cut_chain;
pub mod description;
pub mod dual;
pub mod effects;
pub mod error;
pub mod keys;
pub mod lanes;
pub mod muscle;
pub mod plant;
mod room;
pub mod scalar;
pub mod simulate;
mod vector;

// The laws name the crate as its users do.
#[cfg(test)]
extern crate self as pam_core;
#[cfg(test)]
#[path = "../tests/laws/main.rs"]
mod laws;

pub use description::RigSpec;
pub use error::{Error, Result};
pub use plant::Rig;
