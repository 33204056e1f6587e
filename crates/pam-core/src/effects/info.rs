//! What an effect is: its identifier, its forms with their parameters, states and ports, and where it comes from.

use super::port::{Effect, Port};
use crate::blocks::gas::Gas;
use crate::scalar::Scalar;
use num_dual::DualSVec64;
use serde::Serialize;

/// Lanes of the dual numbers that sensitivities are found with.
pub const LANES: usize = 8;
/// The dual number of sensitivities.
pub type Dual = DualSVec64<LANES>;

/// One parameter of an effect, SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EffectParameter {
    /// Name, public API.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Least possible value.
    pub lower: f64,
    /// Greatest possible value.
    pub upper: f64,
    /// A typical value.
    pub default: f64,
    /// Values from which a fit starts, small to large.
    pub starts: &'static [f64],
    /// Value that switches the effect off (with the other parameters that have one at theirs); none for a parameter that
    /// gives the effect its shape.
    pub neutral: Option<f64>,
    /// Where it usually lies, as prior knowledge.
    pub expected: Option<(f64, f64)>,
}

impl EffectParameter {
    /// A parameter between two bounds, with a typical value.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str, lower: f64, upper: f64, default: f64) -> Self {
        Self { name, unit, lower, upper, default, starts: &[], neutral: None, expected: None }
    }

    /// The same with values from which a fit starts.
    #[must_use]
    pub const fn starts(self, starts: &'static [f64]) -> Self {
        Self { starts, ..self }
    }

    /// The same with the value that switches the effect off.
    #[must_use]
    pub const fn off(self, neutral: f64) -> Self {
        Self { neutral: Some(neutral), ..self }
    }

    /// The same with the range in which it usually lies.
    #[must_use]
    pub const fn usually(self, low: f64, high: f64) -> Self {
        Self { expected: Some((low, high)), ..self }
    }
}

/// What a state of an effect is to a linear model of the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// It moves by itself.
    Moves,
    /// It moves by itself between a command and an opening.
    Opens,
    /// It follows a small motion of its block.
    Follows,
    /// It says that something has begun.
    Begun,
    /// It changes at once or for good, or moves nothing.
    Keeps,
}

/// One state of an effect, at each block on which it acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct EffectState {
    /// Name among the states of the effect; empty where there is one only.
    pub name: &'static str,
    /// What it is to a linear model.
    pub role: Role,
}

/// Makes an effect of its parameter values, in each number type that a plant has.
#[derive(Debug, Clone, Copy)]
pub struct Make {
    /// Plain numbers.
    pub plain: fn(&[f64], &Gas) -> Box<dyn Effect<f64>>,
    /// Dual numbers.
    pub dual: fn(&[Dual], &Gas) -> Box<dyn Effect<Dual>>,
}

/// A [`Make`] of a function that is generic over its number type.
#[macro_export]
macro_rules! made_by {
    ($make:path) => {
        $crate::effects::Make { plain: $make, dual: $make }
    };
}

/// A number type that effects are made in.
pub trait Number: Scalar {
    /// An effect of some parameter values.
    fn effect(make: &Make, values: &[Self], gas: &Gas) -> Box<dyn Effect<Self>>;
}

impl Number for f64 {
    fn effect(make: &Make, values: &[Self], gas: &Gas) -> Box<dyn Effect<Self>> {
        (make.plain)(values, gas)
    }
}

impl Number for Dual {
    fn effect(make: &Make, values: &[Self], gas: &Gas) -> Box<dyn Effect<Self>> {
        (make.dual)(values, gas)
    }
}

/// One form of an effect.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Form {
    /// Name, public API; the first form of an effect is the one that is meant where none is named.
    pub name: &'static str,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
    /// Its states at each block.
    pub states: &'static [EffectState],
    /// Its states are integrated by their rates.
    pub integrates: bool,
    /// Where it acts.
    pub ports: &'static [Port],
    /// How it is made.
    #[serde(skip)]
    pub make: Make,
}

/// When an effect leaves the very recordings that another one leaves, so that nothing in them can tell the two apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SameData {
    /// The other effect.
    pub effect: &'static str,
    /// Its parameter that is then as large as `size`.
    pub parameter: &'static str,
    /// The own parameter that is the effect's size; the two are the same where it is positive.
    pub size: &'static str,
    /// The own parameter that would tell the two apart, if it were not zero.
    pub without: &'static str,
    /// Own parameters with the values at which the two are the same.
    pub held: &'static [(&'static str, f64)],
}

/// Why an effect has no linear model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Kink {
    /// It is there where any of these parameters is not zero.
    pub where_not_zero: &'static [&'static str],
    /// The reason.
    pub why: &'static str,
    /// It is there only while the pressure of the supply moves.
    pub of_supplies: bool,
}

/// Changes of parameters that a linear model about a state of rest is made with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum AtRest {
    /// The parameter is set to a value.
    #[serde(rename = "set")]
    Set(&'static str, f64),
    /// The effect is left out where the parameter is below a value.
    #[serde(rename = "out_below")]
    OutBelow(&'static str, f64),
}

/// An effect of the catalogue, or a sum of terms that stands where no name does.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct EffectInfo {
    /// Identifier, public API.
    pub id: &'static str,
    /// Block in which it acts.
    pub block: &'static str,
    /// Kind of the blocks of which it can take one, by its name; empty for an effect on the whole rig.
    pub at: &'static str,
    /// Whether it is a name for physics; a sum of terms is none.
    pub named: bool,
    /// Place among the effects at one port: lower ones act first.
    pub order: u8,
    /// Kinds of supply that it acts on; empty for all.
    pub supplies: &'static [&'static str],
    /// Without `at` it acts on the last block of its kind, not on every one.
    pub last_only: bool,
    /// It acts on a linear load too, not only on an arm.
    pub on_loads: bool,
    /// With it the mass of a chamber's gas is a state of its own.
    pub frees_mass: bool,
    /// It is dry friction, which a motion that does not turn round does not feel as damping.
    pub dry_friction: bool,
    /// Why it has no linear model, if it has none.
    pub kink: Option<Kink>,
    /// How it is changed for a linear model about a state of rest.
    pub at_rest: &'static [AtRest],
    /// Another effect whose recordings it leaves.
    pub same_data: Option<SameData>,
    /// Its forms.
    pub forms: &'static [Form],
    /// Where it comes from.
    pub source: &'static str,
}

impl EffectInfo {
    /// What most effects have; `id`, `block`, `at`, `forms` and `source` are their own.
    pub const USUAL: Self = Self {
        id: "",
        block: "",
        at: "",
        named: true,
        order: 0,
        supplies: &[],
        last_only: false,
        on_loads: false,
        frees_mass: false,
        dry_friction: false,
        kink: None,
        at_rest: &[],
        same_data: None,
        forms: &[],
        source: "",
    };

    /// The form of a name, the first one for an empty name.
    #[must_use]
    pub fn form(&self, name: &str) -> Option<&'static Form> {
        self.forms.iter().find(|form| name.is_empty() || form.name == name)
    }

    /// The parameters of the first form.
    #[must_use]
    pub fn parameters(&self) -> &'static [EffectParameter] {
        self.forms.first().map_or(&[], |form| form.parameters)
    }
}

/// The state that says that an effect has begun, first among its own.
pub(crate) const BEGINNING: EffectState = EffectState { name: "begun", role: Role::Begun };
