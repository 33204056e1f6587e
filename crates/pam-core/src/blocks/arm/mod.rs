//! Arms: the load that a joint moves.

pub mod linear;
pub mod one_link;
pub mod planar;
