//! What an effect is: its identifier, its forms with their parameters, states and ports, and where
//! it comes from.

use super::port::{Effect, Port};
use crate::blocks::gas::Gas;
use crate::dual::{Dual, LANES, WIDE_LANES};
use crate::keys::Key;
use crate::scalar::Scalar;
use serde::Serialize;

/// What a parameter is to a fit and to a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Use {
    /// It scales the effect.
    Size,
    /// It is tried from its starts.
    Shape,
    /// Either end of its range, not fitted.
    Choice,
    /// At its default.
    Held,
    /// When something happens.
    Time,
    /// How long it lasts.
    Duration,
    /// How long it takes to come.
    Rise,
    /// Where on a measured channel a contact begins.
    Place,
    /// From below or above that place.
    Side,
    /// A level of a measured channel at which something switches, which no fit can move: the first
    /// on, the second off.
    Threshold,
}

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
    /// Value that switches the effect off (with the other parameters that have one at theirs); none
    /// for a parameter that gives the effect its shape.
    pub neutral: Option<f64>,
    /// Where it usually lies, as prior knowledge.
    pub expected: Option<(f64, f64)>,
    /// Mean and standard deviation of what is known of it before any data.
    pub prior: Option<(f64, f64)>,
    /// What it is to a fit and a search; by default a size where zero is neutral, else a shape.
    pub role: Option<Use>,
    /// The same in a rig without a valve, where it is another.
    pub role_sealed: Option<Use>,
    /// Kind of the measured channel in which a place or a threshold lies.
    pub channel: &'static str,
    /// Parameter of which it is another one (`torque` of `torque_2`): held unless an event needs
    /// it.
    pub repeats: &'static str,
    /// Value that a search gives it while it looks for the time of an event, or scans another
    /// parameter.
    pub tried: Option<f64>,
    /// Least, greatest and number of values that are tried one by one, evenly in their logarithm,
    /// before any is fitted: a resonance has to be met.
    pub scan: Option<(f64, f64, u32)>,
    /// It is the same in all recordings, whatever else is not.
    pub same_everywhere: bool,
    /// Recordings must last as long as it, or so, to tell it.
    pub time_constant: bool,
    /// It is another one in each recording, whatever its form has beside it.
    pub own: bool,
    /// The effect falls with its inverse square, as a pressure loss does with a conductance.
    pub restricts: bool,
    /// Parameter of the rig (`valve.discharge_area_max`) in parts of which it is tried.
    pub like: &'static str,
    /// Kinds of block of the cut chain in which the effect acts only while this parameter is not
    /// zero.
    pub needed_in: &'static [&'static str],
}

impl EffectParameter {
    /// A parameter between two bounds, with a typical value.
    #[must_use]
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        lower: f64,
        upper: f64,
        default: f64,
    ) -> Self {
        Self {
            name,
            unit,
            lower,
            upper,
            default,
            starts: &[],
            neutral: None,
            expected: None,
            prior: None,
            role: None,
            role_sealed: None,
            channel: "",
            repeats: "",
            tried: None,
            scan: None,
            same_everywhere: false,
            time_constant: false,
            own: false,
            restricts: false,
            like: "",
            needed_in: &[],
        }
    }

    /// The same as a key of a rig, with a typical value.
    #[must_use]
    pub const fn of(key: &Key, default: f64) -> Self {
        Self::new(key.name, key.unit, key.lower, key.upper, default)
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

    /// The same with mean and standard deviation of what is known of it before any data.
    #[must_use]
    pub const fn prior(self, mean: f64, std: f64) -> Self {
        Self { prior: Some((mean, std)), ..self }
    }

    /// The same with what it is to a fit and a search.
    #[must_use]
    pub const fn role(self, role: Use) -> Self {
        Self { role: Some(role), ..self }
    }

    /// The same with what it is in a rig without a valve.
    #[must_use]
    pub const fn sealed(self, role: Use) -> Self {
        Self { role_sealed: Some(role), ..self }
    }

    /// The same with the kind of the measured channel in which it lies.
    #[must_use]
    pub const fn on(self, channel: &'static str) -> Self {
        Self { channel, ..self }
    }

    /// The same as another one of a parameter.
    #[must_use]
    pub const fn again(self, repeats: &'static str) -> Self {
        Self { repeats, ..self }
    }

    /// The same with the value that a search gives it while it looks for others.
    #[must_use]
    pub const fn tried(self, value: f64) -> Self {
        Self { tried: Some(value), ..self }
    }

    /// The same with values that are tried one by one before any is fitted.
    #[must_use]
    pub const fn scan(self, low: f64, high: f64, count: u32) -> Self {
        Self { scan: Some((low, high, count)), ..self }
    }

    /// The same for one that is the same in all recordings, where others of its effect are not.
    #[must_use]
    pub const fn same_everywhere(self) -> Self {
        Self { same_everywhere: true, ..self }
    }

    /// The same for a time that recordings must last.
    #[must_use]
    pub const fn time_constant(self) -> Self {
        Self { time_constant: true, ..self }
    }

    /// The same for one that is another one in each recording.
    #[must_use]
    pub const fn own(self) -> Self {
        Self { own: true, ..self }
    }

    /// The same for one with whose inverse square the effect falls.
    #[must_use]
    pub const fn restricts(self) -> Self {
        Self { restricts: true, ..self }
    }

    /// The same, tried in parts of a parameter of the rig.
    #[must_use]
    pub const fn like(self, parameter: &'static str) -> Self {
        Self { like: parameter, ..self }
    }

    /// The same with the kinds of block in which the effect acts only while it is not zero.
    #[must_use]
    pub const fn needed_in(self, blocks: &'static [&'static str]) -> Self {
        Self { needed_in: blocks, ..self }
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
    pub dual: fn(&[Dual<LANES>], &Gas) -> Box<dyn Effect<Dual<LANES>>>,
    /// Dual numbers with more derivatives.
    pub wide: fn(&[Dual<WIDE_LANES>], &Gas) -> Box<dyn Effect<Dual<WIDE_LANES>>>,
}

/// A [`Make`] of a function that is generic over its number type.
#[macro_export]
macro_rules! made_by {
    ($make:path) => {
        $crate::effects::Make { plain: $make, dual: $make, wide: $make }
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

impl Number for Dual<LANES> {
    fn effect(make: &Make, values: &[Self], gas: &Gas) -> Box<dyn Effect<Self>> {
        (make.dual)(values, gas)
    }
}

impl Number for Dual<WIDE_LANES> {
    fn effect(make: &Make, values: &[Self], gas: &Gas) -> Box<dyn Effect<Self>> {
        (make.wide)(values, gas)
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

/// When an effect leaves the very recordings that another one leaves, so that nothing in them can
/// tell the two apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SameData {
    /// The other effect.
    pub effect: &'static str,
    /// Its form.
    pub form: &'static str,
    /// Its parameter that is then as large as `size`.
    pub parameter: &'static str,
    /// The own parameter that is the effect's size; the two are the same where it is positive.
    pub size: &'static str,
    /// The own parameter that would tell the two apart, if it were not zero.
    pub without: &'static str,
    /// Own parameters with the values at which the two are the same.
    pub held: &'static [(&'static str, f64)],
    /// What of a rig the held parameters act on; in a rig that has none they say nothing.
    pub held_at: &'static str,
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
    /// Kind of the blocks of which it can take one, by its name; empty for an effect on the whole
    /// rig.
    pub at: &'static str,
    /// Whether it is a name for physics; a sum of terms is none.
    pub named: bool,
    /// Place among the effects at one port: lower ones act first.
    pub order: u8,
    /// Kinds of block of the cut chain in which it acts, where these are others than those of its
    /// block.
    pub acts_in: &'static [&'static str],
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
    /// Other effects whose recordings it leaves, each in rigs that have what it acts on; of several
    /// in one rig the first.
    pub same_data: &'static [SameData],
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
        acts_in: &[],
        supplies: &[],
        last_only: false,
        on_loads: false,
        frees_mass: false,
        dry_friction: false,
        kink: None,
        at_rest: &[],
        same_data: &[],
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
