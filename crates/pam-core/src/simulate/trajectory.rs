//! What a simulation leaves: its channels and what happened on the way.

use super::events::Event;
use crate::plant::Rig;
use crate::vector::Wanted;

/// Rows that room is made for at once.
const MOST_ROOM: usize = 65_536;

/// Simulated channels, all in the order of [`crate::plant::Names::channels`] or those that are
/// wanted in theirs, one row per sample; row 0 is the initial state. SI, pressures gauge and as the
/// sensors read them (zeros included). And what happened on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// One vector for each channel.
    pub channels: Vec<Vec<f64>>,
    /// In the order of time.
    pub events: Vec<Event>,
    /// The channels that are kept; all where it is not said.
    pub(super) wanted: Option<Wanted>,
}

impl Trajectory {
    /// Without rows.
    #[must_use]
    pub fn new(rig: &Rig, rows: usize) -> Self {
        let channels = rig.names.channels.iter().map(|_| room(rows)).collect();
        Self { channels, ..Self::blind() }
    }

    /// Without channels: events alone.
    #[must_use]
    pub fn blind() -> Self {
        Self { channels: Vec::new(), events: Vec::new(), wanted: None }
    }

    /// The channel of a name, where all are kept.
    #[must_use]
    pub fn get(&self, rig: &Rig, name: &str) -> Option<&[f64]> {
        if self.wanted.is_some() {
            return None;
        }
        let k = rig.names.channels.iter().position(|(n, _)| n == name)?;
        self.channels.get(k).map(Vec::as_slice)
    }
}

/// Room for the rows of a channel.
pub(super) fn room(rows: usize) -> Vec<f64> {
    Vec::with_capacity(rows.min(MOST_ROOM))
}
