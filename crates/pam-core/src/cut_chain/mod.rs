//! Cut-chain simulation: measured signals drive a block, whose own output is predicted.
//!
//! Wherever a channel between two blocks was measured the chain is cut there (analytical
//! redundancy), so that each block has a residual of its own. Integrating blocks run over windows
//! that start from the (smoothed) measurement; the derivative with respect to the window's initial
//! state comes along, so that its error can be projected out.

mod block;
mod boundary;
mod clock;
mod measured;
mod sensitivity;
mod window;

pub use self::block::Block;
pub use self::measured::{Measured, Signal};
pub use self::sensitivity::{closure_terms, predict, Prediction};
