//! A rig is compiled: its description wired and checked, its longest steps found.

use super::layout::{Layout, Names, BALANCE, HEAT_BALANCE};
use super::rates::Plant;
use super::rig::Rig;
use super::units::{Group, Node};
use super::wired::Wiring;
use crate::blocks::gas::Gas;
use crate::description::{dotted, RigSpec};
use crate::effects::{EffectInfo, EFFECTS};
use crate::{Error, Result};
use std::sync::Arc;

/// Of the 2.78 that the Runge-Kutta method bears on the negative real axis.
const STABLE: f64 = 2.0;
/// Points of a joint's range at which its reach is checked, its ends left out.
const REACH_POINTS: u32 = 64;
/// The least step that a rig may need [s].
const LEAST_STEP: f64 = 1e-7;

impl Rig {
    /// Compile a rig from its description.
    ///
    /// # Errors
    /// As [`RigSpec::validate`]; [`Error::Model`] for blocks that do not fit together, an unknown
    /// effect or effect parameter, or a volume too small for its openings; [`Error::Parameter`] for
    /// a parameter outside its bounds.
    pub fn new(spec: RigSpec) -> Result<Self> {
        Self::wired(spec, &[], EFFECTS)
    }

    /// As [`Self::new`], with other effects than those of the catalogue to choose from.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_effects(spec: RigSpec, effects: &'static [&'static EffectInfo]) -> Result<Self> {
        Self::wired(spec, &[], effects)
    }

    fn wired(
        spec: RigSpec,
        known: &[Group],
        effects: &'static [&'static EffectInfo],
    ) -> Result<Self> {
        spec.validate()?;
        let g = &spec.gas;
        let gas =
            Gas::new(g.ambient_pressure, g.temperature, g.gas_constant, g.heat_capacity_ratio);
        let (wiring, parameters) = Wiring::new(&spec, known, effects)?;
        let layout = Layout {
            supplies: wiring.supplies.len(),
            gases: wiring.gases.len(),
            flows: wiring.waves.iter().map(|wave| wave.segments).sum(),
            coordinates: wiring.coordinates.len(),
            chambers: wiring.chambers,
            effects: wiring.ports.states,
            sums: BALANCE.len() + if wiring.heated() { HEAT_BALANCE.len() } else { 0 },
        };
        let names = Arc::new(Names::new(&spec, &wiring, &layout));
        let endless = f64::INFINITY;
        let (spec, wiring) = (Arc::new(spec), Arc::new(wiring));
        let mut rig = Self {
            gas,
            wiring,
            layout,
            names,
            parameters,
            effects,
            gas_step: endless,
            first_order: true,
            body_step: endless,
            derived: Arc::default(),
            spec,
        };
        rig.check_reach()?;
        rig.find_steps()?;
        Ok(rig)
    }

    /// The same rig with other values of its parameters, in the order of [`super::Parameters::names`]:
    /// nothing is wired again. [`Self::spec`] stays what it was.
    ///
    /// # Errors
    /// As [`super::Parameters::with_values`], and [`Error::Model`] for values that would need too short a
    /// step.
    pub fn with_values(&self, values: &[f64]) -> Result<Self> {
        let mut rig = self.clone();
        rig.parameters = self.parameters.with_values(values)?;
        rig.find_steps()?;
        Ok(rig)
    }

    /// Every joint's and load's whole range must be within the reach of the tendons and of the
    /// muscles' tables; all that are not are named.
    fn check_reach(&self) -> Result<()> {
        let mut found = Vec::new();
        for (group, spec) in self.wiring.groups.iter().zip(&self.spec.muscles) {
            found.extend(self.beyond_reach(group, &spec.name));
        }
        match found.len() {
            0 => Ok(()),
            1 => Err(found.swap_remove(0)),
            _ => Err(Error::Model(
                found.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "),
            )),
        }
    }

    fn beyond_reach(&self, group: &Group, name: &str) -> Option<Error> {
        let table = &group.muscle.table;
        if let Some(load) = &self.spec.load {
            let ends = [("load.min_length", load.min_length), ("load.max_length", load.max_length)];
            let (short, long) =
                (group.rest_length * (1.0 - table.e_max), group.rest_length * (1.0 - table.e_min));
            let outside = ends
                .iter()
                .find(|(_, length)| !table.contains(1.0 - length / group.rest_length))?;
            let allowed =
                format!("a length that the muscle can have, from {short:.5} to {long:.5} m");
            return Some(Error::parameter(outside.0, outside.1, allowed));
        }
        let joint = &self.names.coordinates[group.coordinate];
        let stops = self.wiring.coordinates[group.coordinate].stops?;
        let of =
            if name.is_empty() { String::new() } else { format!(" of {}", dotted("muscle", name)) };
        // The ends first: they are numbers of the file. A joint may leave the muscle's range
        // between them, too.
        let ends = [("min_angle", stops.min_angle), ("max_angle", stops.max_angle)];
        let inside = (1..REACH_POINTS).map(|i| {
            (
                "an angle inside the range of",
                stops.min_angle
                    + (stops.max_angle - stops.min_angle) * f64::from(i) / f64::from(REACH_POINTS),
            )
        });
        for (key, angle) in ends.into_iter().chain(inside) {
            let full =
                if key.contains(' ') { format!("{key} {joint}") } else { format!("{joint}.{key}") };
            if !group.joint.reaches(angle) {
                let allowed = format!("an angle that the tendon{of} reaches (it is too short)");
                return Some(Error::parameter(full, angle, allowed));
            }
            let contraction = group.joint.eval(angle).shortening / group.rest_length;
            if !table.contains(contraction) {
                let (low, high) = (table.e_min, table.e_max);
                let allowed = format!(
                    "an angle that keeps the contraction ratio{of} \
                    ({contraction:.4} here) from {low:.4} to {high:.4}"
                );
                return Some(Error::parameter(full, angle, allowed));
            }
        }
        None
    }

    /// Find the longest stable steps; refuses values that together are not possible.
    fn find_steps(&mut self) -> Result<()> {
        let plant = Plant::new(self, self.parameters.lift::<f64>(), false)?;
        plant.check_masses()?;
        plant.check_moduli()?;
        let steps = self.stable_steps(&plant)?;
        let first_order = plant.first_order();
        (self.gas_step, self.body_step) = steps;
        self.first_order = first_order;
        Ok(())
    }

    fn stable_steps(&self, plant: &Plant<'_, f64>) -> Result<(f64, f64)> {
        let body = plant.fastest_body();
        if !body.is_finite() {
            return Err(Error::Model(
                "the arm's mass matrix is not positive definite: a link without inertia".into(),
            ));
        }
        let needed = |step: f64| {
            format!(
                "a step of {step:.1e} s would be needed, at least {LEAST_STEP:.0e} s is allowed"
            )
        };
        if let Some((wave, line)) = plant.fastest_wave() {
            if STABLE / wave < LEAST_STEP {
                let line = &self.spec.lines[line];
                let (name, segments) = (dotted("line", &line.name), line.segments);
                return Err(Error::Model(format!(
                    "{name} is too short for {segments} segments: {}",
                    needed(STABLE / wave)
                )));
            }
        }
        let (air, place) = plant.fastest_air(|_| true);
        if STABLE / body < LEAST_STEP {
            return Err(Error::Model(format!(
                "what moves is too light, or too strongly damped or held, for its inertia: {}",
                needed(STABLE / body)
            )));
        }
        let step = STABLE / air.max(plant.fastest_give());
        if step < LEAST_STEP {
            return Err(Error::Model(match place {
                Some(k) => format!(
                    "{} is too small for what flows through it: {}; it needs {:.1} times its \
                        volume",
                    self.names.gases[k],
                    needed(step),
                    LEAST_STEP / step
                ),
                None => {
                    format!("a supply answers too fast to what flows out of it: {}", needed(step))
                }
            }));
        }
        Ok((step.min(STABLE / plant.fastest_command()), STABLE / body))
    }

    /// The same rig with other parameter values and effects; a muscle's table is kept when its
    /// geometry and moduli are the same.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn respecified(&self, spec: RigSpec) -> Result<Self> {
        Self::wired(spec, &self.wiring.groups, self.effects)
    }

    /// The same for some pressures alone, while the others are driven.
    pub(crate) fn air_step(&self, moves: impl Fn(Node) -> bool) -> Result<f64> {
        let plant = Plant::new(self, self.parameters.lift::<f64>(), false)?;
        let (rate, _) = plant.fastest_air(moves);
        Ok(STABLE / rate.max(plant.fastest_command()).max(plant.fastest_give()))
    }
}
