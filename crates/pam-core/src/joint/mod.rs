//! Joints: how a muscle's shortening turns a link.

pub mod tendon;
