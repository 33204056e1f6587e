//! Rows in groups by the way in which each runs.

use super::flight;
use super::group::{Group, Rigs, Row};
use super::queue::Queue;
use crate::vector::Plan;
use crate::Result;

/// Rows in groups, so that each runs in the way that its own rig allows: in `lanes` at all, and
/// with these channels, by number, to be read.
///
/// # Errors
/// As [`Run::new`].
pub(crate) fn grouped<'a>(
    rows: Vec<Row>,
    rigs: &dyn Rigs<'a>,
    lanes: bool,
    wanted: &[usize],
) -> Result<Vec<Box<dyn Group + 'a>>> {
    let mut groups: Vec<Box<dyn Group + 'a>> = Vec::new();
    let mut alone = Vec::new();
    let mut kinds: Vec<(&'a Plan, usize, Vec<Row>)> = Vec::new();
    for row in rows {
        let Some(plan) = Plan::of(rigs.rig(row.rig)).filter(|_| lanes) else {
            alone.push(row);
            continue;
        };
        let steps = row.timing.substeps;
        let same =
            |kind: &&mut (&Plan, usize, Vec<Row>)| std::ptr::eq(kind.0, plan) && kind.1 == steps;
        match kinds.iter_mut().find(same) {
            Some((_, _, rows)) => rows.push(row),
            None => kinds.push((plan, steps, vec![row])),
        }
    }
    for (plan, _, rows) in kinds {
        groups.extend(flight::flights(plan, rows, rigs, wanted)?);
    }
    if !alone.is_empty() {
        groups.push(Box::new(Queue::new(alone, rigs, wanted)?));
    }
    Ok(groups)
}
