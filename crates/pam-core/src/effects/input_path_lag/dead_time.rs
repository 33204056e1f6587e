//! `dead_time`: the valve sees its command a time later, every edge as sharp as it was.
//!
//! What a bus, a driver or a sampled controller does to a command. In a step in which the command
//! that is seen changes the valve passes the mean of the flows before and after, so that a shift of
//! less than a step counts and has a slope. Three lags in its place, as `lag_and_delay` has them,
//! round every edge over a time as long as the delay itself.

use super::{DELAY, LAG_AND_DELAY};
use crate::blocks::gas::Gas;
use crate::effects::{Effect, Form, Port};
use crate::made_by;
use crate::scalar::Scalar;

pub(super) const FORM: Form = Form {
    name: "dead_time",
    parameters: &[DELAY],
    states: &[],
    ports: &[Port::Late],
    make: made_by!(make),
    ..LAG_AND_DELAY
};

/// A command that is seen later.
#[derive(Debug, Clone, Copy)]
struct Late<S>(S);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Late(values[0]))
}

impl<S: Scalar> Effect<S> for Late<S> {
    fn late(&self) -> S {
        self.0
    }
}
