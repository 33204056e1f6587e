//! Laws of the core, in one binary: each further one would be compiled and linked anew.

mod batch;
mod effect_forms;
mod every_effect;
mod fuzz;
mod instances;
mod joint;
mod lanes;
mod linear;
mod load;
mod models;
mod muscle;
mod network;
mod planar;
mod plant;
mod rigs;
mod thermometer;
mod toy_effect;
#[path = "../toy/toy_spring.rs"]
mod toy_spring;
mod waves;
mod work;

// What `toy_spring` takes from the crate that it belongs to.
use pam_core::{blocks, effects, made_by, scalar};
