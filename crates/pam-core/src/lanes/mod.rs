//! Many plants of one structure, side by side in the vector lanes of the processor.
//!
//! Rigs without effects whose arm is one link or a hanging mass run in lanes ([`crate::vector`]): one
//! plant in each, two registers of 8, 4, 2 or 1 as the processor has, chosen when the program runs.
//! All other rigs, and plants that leave the range of the lanes' curves, run one by one as in
//! [`crate::simulate`]. What happens to a row depends on its own numbers only: neighbours, threads
//! and the number of lanes change no bit.

mod flight;
pub(crate) mod group;
mod grouped;
mod queue;
mod reads;
mod reduce;
mod request;
mod run;
mod steps;

pub use group::Spent;
pub(crate) use grouped::grouped;
pub use reduce::{Reduce, Reduction};
pub use request::{Outcome, Request, Signal};
pub use run::simulate;
