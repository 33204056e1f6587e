//! The equations of a plant a second time, in the vector lanes of the processor: one plant in each,
//! or the columns of one plant's muscles side by side. Which rigs can run so is their [`Plan`].

mod blocks;
mod curves;
mod num;
mod plan;
mod rates;
mod reads;
mod rk4;
mod slopes;
mod solo;

pub(crate) use num::{in_fours, side_by_side, Num, Pair, Registers, Single, MOST_LANES, PAIR};
pub(crate) use plan::Plan;
pub(crate) use rates::{opening, Lanes, Shape};
pub(crate) use reads::{needs_sums, Read, Wanted};
pub(crate) use rk4::Rk4;
pub(crate) use solo::Solo;
