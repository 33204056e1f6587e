//! Laws of the core, in the binary of its unit tests: the core is compiled once for both.

mod batch;
mod effect_forms;
mod every_effect;
mod fuzz;
mod input;
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
