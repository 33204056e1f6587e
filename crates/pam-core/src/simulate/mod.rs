//! Fixed-step simulation: commands are held over each sample, RK4 steps fill it.

mod advance;
pub mod drive;
pub mod events;
mod initial;
pub mod integrate;
mod progress;
mod row;
pub mod run;
mod stepper;
pub(crate) mod team;
mod timing;
mod trajectory;

pub use self::advance::simulate;
pub use self::initial::Initial;
pub use self::progress::Progress;
pub use self::row::{of_row, Failure};
pub(crate) use self::stepper::{check_state, Stepper};
pub use self::timing::Timing;
pub use self::trajectory::Trajectory;
