//! A rig: blocks joined by ports, described by data, composed into one state equation.

mod air;
mod body;
mod compile;
mod discrete;
mod encoder;
mod kinks;
pub mod layout;
pub mod linear;
pub mod memory;
mod motion;
mod muscle_force;
pub mod parameters;
mod plugs;
mod ports;
pub mod rates;
mod rig;
mod stops;
mod switching;
mod tap;
mod units;
mod views;
mod wired;
mod wiring;
mod wiring_motion;

pub(crate) use air::Pressure;
pub(crate) use body::Body as OneBody;
pub use layout::{Channel, Layout, Names, StatePlace, StateRole, BALANCE, HEAT_BALANCE};
pub use linear::{LinearModel, Side};
pub use memory::Memory;
pub use parameters::{ParameterId, Parameters, Values};
pub(crate) use ports::{Acting, Place};
pub(crate) use rates::{Controls, InputPort, Line, Plant, Scratch, Simulated};
pub use rig::Rig;
pub(crate) use switching::{Switch, Switches};
pub(crate) use units::{BodyUnit, Group, Node, Passes, Path};
