//! What a rig says: every key of every block with its unit, bounds and usual value, and which of
//! them can carry a derivative. Files are read by it, and the core checks by it.
//!
//! The bounds are those of the possible, not of the likely: outside them a value is a mistake.

use crate::error::{check_range, Error, Result};
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// A limit that never acts, of the rate of a regulator's outlet [Pa/s].
pub const FASTEST: f64 = 1e12;
/// Buckling load of a muscle that pushes like a strut, whatever it is pushed with [N]; by default a
/// muscle pushes nothing.
pub const STRUT: f64 = 1e9;

/// The value of a key that a file leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Usual {
    /// It has to be given.
    Needed,
    /// A number, SI.
    Number(f64),
    /// A list of numbers, SI.
    List(&'static [f64]),
    /// A word.
    Word(&'static str),
}

/// What a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// One number.
    Scalar,
    /// A whole number.
    Count,
    /// A list of numbers.
    Vector,
    /// A word of several.
    Choice,
}

/// Least and greatest possible value, with the unit as a message has it.
pub type Bounds = (f64, f64, &'static str);

/// One key of a block.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Key {
    /// Name, public API.
    pub name: &'static str,
    /// SI unit, `1` for a pure number.
    pub unit: &'static str,
    /// Least possible value.
    pub lower: f64,
    /// Greatest possible value.
    pub upper: f64,
    /// What it is where it is left out.
    pub usual: Usual,
    /// What its value is.
    pub kind: Kind,
    /// Words that it may be.
    pub choices: &'static [&'static str],
    /// Words of another key of the block with which it has this one; empty for all.
    pub only: &'static [&'static str],
    /// A count of the block without which (0) it does not have this key; empty for none.
    pub needs: &'static str,
    /// It can carry a derivative of what is measured.
    pub moves: bool,
}

impl Key {
    /// A number that has to be given, between two bounds.
    const fn new(name: &'static str, unit: &'static str, lower: f64, upper: f64) -> Self {
        Self {
            name,
            unit,
            lower,
            upper,
            usual: Usual::Needed,
            kind: Kind::Scalar,
            choices: &[],
            only: &[],
            needs: "",
            moves: false,
        }
    }

    /// One of some words, with the usual one.
    const fn choice(
        name: &'static str,
        choices: &'static [&'static str],
        usual: &'static str,
    ) -> Self {
        Self {
            kind: Kind::Choice,
            choices,
            usual: Usual::Word(usual),
            ..Self::new(name, "1", 0.0, 0.0)
        }
    }

    /// The same with a number where it is left out.
    const fn or(self, usual: f64) -> Self {
        Self { usual: Usual::Number(usual), ..self }
    }

    /// The same as a whole number.
    const fn whole(self) -> Self {
        Self { kind: Kind::Count, ..self }
    }

    /// The same as a list, each of whose numbers has the bounds.
    const fn list(self) -> Self {
        Self { kind: Kind::Vector, ..self }
    }

    /// The same as a list with one where it is left out.
    const fn or_list(self, usual: &'static [f64]) -> Self {
        Self { usual: Usual::List(usual), ..self.list() }
    }

    /// The same for blocks of some kinds alone.
    const fn only(self, only: &'static [&'static str]) -> Self {
        Self { only, ..self }
    }

    /// The same for blocks that have another count.
    const fn needs(self, needs: &'static str) -> Self {
        Self { needs, ..self }
    }

    /// The same for what can carry a derivative.
    const fn moves(self) -> Self {
        Self { moves: true, ..self }
    }

    /// Its bounds.
    #[must_use]
    pub const fn bounds(&self) -> Bounds {
        (self.lower, self.upper, if same(self.unit, "1") { "" } else { self.unit })
    }

    /// A number that is between its bounds, under the name that a message gives it.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn check(&self, name: &str, value: f64) -> Result<f64> {
        let (low, high, unit) = self.bounds();
        check_range(name, value, low, high, unit)
    }

    /// The same for a number of a block that is called so, each where it is a list.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn check_all(&self, block: &str, values: &[f64]) -> Result<()> {
        values.iter().enumerate().try_for_each(|(place, value)| {
            self.check(self.name, *value).map(|_| ()).or_else(|_| {
                let place =
                    if self.kind == Kind::Vector { format!("[{place}]") } else { "".into() };
                self.check(&format!("{block}.{}{place}", self.name), *value).map(|_| ())
            })
        })
    }

    /// The same for a word.
    ///
    /// # Errors
    /// [`Error::Choice`].
    pub fn check_word(&self, name: &str, value: &str) -> Result<()> {
        if self.choices.contains(&value) {
            return Ok(());
        }
        let quoted: Vec<_> = self.choices.iter().map(|a| format!("\"{a}\"")).collect();
        Err(Error::Choice {
            name: name.into(),
            value: format!("\"{value}\""),
            allowed: format!("one of {}", quoted.join(", ")),
        })
    }
}

/// The keys of one kind of block.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Block {
    /// Its name.
    pub name: &'static str,
    /// Kinds of block of the cut chain in which it acts, and what a fit moves in it.
    pub acts_in: &'static [&'static str],
    /// Its keys, in the order in which they are written.
    pub keys: &'static [Key],
}

/// The key of a name; for constants, where a name that is none does not compile.
///
/// # Panics
/// For a name that is none.
#[must_use]
pub const fn key(block: &str, name: &str) -> &'static Key {
    let mut at = 0;
    while at < BLOCKS.len() {
        let keys = BLOCKS[at].keys;
        let mut place = 0;
        while same(BLOCKS[at].name, block) && place < keys.len() {
            if same(keys[place].name, name) {
                return &keys[place];
            }
            place += 1;
        }
        at += 1;
    }
    panic!("no such key")
}

/// Whether two texts are the same.
const fn same(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut at = 0;
    while at < one.len() && at < other.len() && one[at] == other[at] {
        at += 1;
    }
    at == one.len() && at == other.len()
}

/// The key of a name that stands in the source.
#[macro_export]
macro_rules! key {
    ($block:literal, $name:expr) => {
        const { $crate::keys::key($block, $name) }
    };
}

/// As units are converted outside, so that a bound in degrees is met to the last bit.
const DEGREE: f64 = PI / 180.0;

const REGULATOR: &[&str] = &["regulator"];
const ISO: &[&str] = &["iso_6358"];
const SPRUNG: &[&str] = &["second_order"];
const SWITCHING: &[&str] = &["switching"];
const TUBE: &[&str] = &["tube"];
const COEFFICIENTS: &[&str] = &["coefficients"];
const TENDON: &[&str] = &["tendon", "published"];
const ONE_LINK: &[&str] = &["one_link"];
const MASS: &[&str] = &["mass"];
const MAP: &[&str] = &["map"];
const POLYNOMIAL: &[&str] = &["ferraresi", "kothera", "robinson"];
const ELASTIC: &[&str] = &[
    "gaylord",
    "chou_hannaford",
    "mooney_rivlin",
    "ferraresi",
    "kothera",
    "robinson",
    "elbow_linear",
];
const MODELS: &[&str] = &[
    "gaylord",
    "chou_hannaford",
    "mooney_rivlin",
    "ferraresi",
    "kothera",
    "robinson",
    "elbow_linear",
    "map",
];
const GEOMETRIES: &[&str] = &["cylinder", "elliptic", "elliptic_published"];

/// Every kind of block with its keys, in the order of a file.
pub const BLOCKS: &[Block] = &[
    Block {
        name: "gas",
        acts_in: &[],
        keys: &[
            Key::new("ambient_pressure", "Pa", 1000.0, 2e5).or(101325.0),
            Key::new("temperature", "K", 150.0, 500.0).or(293.15),
            Key::new("gas_constant", "J/(kg K)", 20.0, 5000.0).or(287.05),
            Key::new("heat_capacity_ratio", "1", 1.01, 1.7).or(1.4),
        ],
    },
    Block {
        name: "supply",
        acts_in: &["supply"],
        keys: &[
            Key::choice("kind", &["tank", "constant", "regulator", "measured"], "tank"),
            Key::new("volume", "m3", 1e-7, 1000.0).only(&["tank"]).moves(),
            Key::new("initial_pressure", "Pa", 0.0, 1e8),
            Key::new("time_constant", "s", 0.0001, 100.0).or(0.05).only(REGULATOR).moves(),
            Key::new("droop", "Pa s/kg", 0.0, 1e12).or(0.0).only(REGULATOR).moves(),
            Key::new("dead_time", "s", 0.0, 10.0).or(0.0).only(REGULATOR).moves(),
            Key::new("rise_limit", "Pa/s", 1.0, FASTEST).or(FASTEST).only(REGULATOR).moves(),
            Key::new("fall_limit", "Pa/s", 1.0, FASTEST).or(FASTEST).only(REGULATOR).moves(),
            Key::new("dead_band", "Pa", 0.0, 1e7).or(0.0).only(REGULATOR).moves(),
            Key::new("pressure_zero", "Pa", -1e6, 1e6).or(0.0).moves(),
        ],
    },
    Block {
        name: "valve",
        acts_in: &["supply", "chamber", "flow"],
        keys: &[
            Key::choice("flow", &["orifice", "iso_6358"], "orifice"),
            Key::new("discharge_area_max", "m2", 1e-11, 0.01).only(&["orifice"]).moves(),
            Key::new("fill_conductance", "m3/(s Pa)", 0.0, 0.0001).only(ISO).moves(),
            Key::new("fill_critical_ratio", "1", 0.0, 0.9).only(ISO).moves(),
            Key::new("vent_conductance", "m3/(s Pa)", 0.0, 0.0001).only(ISO).moves(),
            Key::new("vent_critical_ratio", "1", 0.0, 0.9).only(ISO).moves(),
            Key::new("null_voltage", "V", -50.0, 50.0).moves(),
            Key::new("half_range", "V", 0.001, 100.0),
            Key::choice("spool", &["ideal", "second_order", "switching"], "ideal"),
            Key::new("natural_frequency", "Hz", 0.1, 1e5).only(SPRUNG).moves(),
            Key::new("damping_ratio", "1", 0.01, 100.0).or(0.7).only(SPRUNG).moves(),
            Key::choice("with_current", &["fill", "vent", "closed", "either"], "fill")
                .only(SWITCHING),
            Key::choice("without_current", &["closed", "vent", "fill"], "closed").only(SWITCHING),
            Key::new("opening_delay", "s", 0.0, 10.0).or(0.0).only(SWITCHING).moves(),
            Key::new("closing_delay", "s", 0.0, 10.0).or(0.0).only(SWITCHING).moves(),
            Key::new("carrier_frequency", "Hz", 0.0, 1e5).or(0.0).only(SWITCHING).moves(),
            Key::new("carrier_phase", "1", 0.0, 1.0).or(0.0).only(SWITCHING).moves(),
            Key::new("opening", "1", 0.0, 1.0).list(),
            Key::new("fraction", "1", 0.0, 1.0).list(),
        ],
    },
    Block {
        name: "line",
        acts_in: &["supply", "chamber", "flow"],
        keys: &[
            Key::choice("kind", &["tube", "orifice"], "tube"),
            Key::new("length", "m", 0.0001, 1000.0).only(TUBE).moves(),
            Key::new("diameter", "m", 0.0001, 0.2).only(TUBE).moves(),
            Key::new("discharge_area", "m2", 1e-12, 0.1).only(&["orifice"]).moves(),
            Key::new("inlet_volume", "m3", 0.0, 1.0).or(0.0).moves(),
            Key::new("pressure_zero", "Pa", -1e6, 1e6).or(0.0).moves(),
            Key::new("segments", "1", 0.0, 256.0).or(0.0).whole().only(TUBE),
            Key::new("alpha", "1", 0.5, 2.0).or(1.4).only(TUBE).needs("segments").moves(),
        ],
    },
    Block {
        name: "chamber",
        acts_in: &["chamber"],
        keys: &[
            Key::new("dead_volume", "m3", 1e-10, 1000.0).moves(),
            Key::new("initial_pressure", "Pa", -1e5, 1e8).or(0.0),
            Key::choice("gas", &["coefficients", "energy_balance"], "coefficients"),
            Key::new("alpha_in", "1", 0.3, 3.0).or(1.4).only(COEFFICIENTS).moves(),
            Key::new("alpha_out", "1", 0.3, 3.0).or(1.0).only(COEFFICIENTS).moves(),
            Key::new("alpha", "1", 0.3, 3.0).or(1.2).only(COEFFICIENTS).moves(),
            Key::new("heat_transfer_coefficient", "W/(m2 K)", 0.0, 1e5)
                .or(50.0)
                .only(&["energy_balance"])
                .moves(),
        ],
    },
    Block {
        name: "muscle",
        acts_in: &["arm", "pull"],
        keys: &[
            Key::choice("model", MODELS, "robinson"),
            Key::choice("geometry", GEOMETRIES, ""),
            Key::new("count", "1", 1.0, 1000.0).or(1.0).whole(),
            Key::new("rest_length", "m", 0.001, 10.0),
            Key::new("rest_diameter", "m", 0.0001, 1.0),
            Key::new("braid_angle", "rad", 45.0 * DEGREE, 89.0 * DEGREE),
            Key::new("wall_thickness", "m", 1e-9, 0.1),
            Key::new("modulus_slope", "1", -1e6, 1e6).list().only(POLYNOMIAL),
            Key::new("modulus_offset", "Pa", -1e11, 1e11).list().only(POLYNOMIAL),
            Key::new("c10", "Pa", -1e11, 1e11).only(&["mooney_rivlin"]),
            Key::new("c01", "Pa", -1e11, 1e11).or(0.0).only(&["mooney_rivlin"]),
            Key::new("bladder_modulus", "Pa", -1e11, 1e11).only(&["elbow_linear"]),
            Key::new("extension_factors", "1", -10.0, 10.0)
                .or_list(&[0.3, 0.8, 0.8])
                .only(&["elbow_linear"]),
            Key::new("map_pressure", "Pa", -1e5, 1e8).list().only(MAP),
            Key::new("map_contraction", "1", -1.0, 1.0).list().only(MAP),
            Key::new("map_force", "N", -1e7, 1e7).list().only(MAP),
            Key::new("modulus_scale", "1", 0.0, 100.0).or(1.0).moves(),
            Key::new("softening", "1/K", -0.1, 0.1).or(0.0).only(ELASTIC).moves(),
            Key::new("temperature", "K", 150.0, 500.0).or(293.15).only(ELASTIC).moves(),
            Key::new("reference_temperature", "K", 150.0, 500.0).or(293.15).only(ELASTIC),
            Key::new("k0", "1", 0.3, 10.0).or(1.64),
            Key::new("contraction_slope", "1", -20.0, 20.0).or(2.405),
            Key::new("extension_slope", "1", -20.0, 20.0).or(6.105),
            Key::new("neck_floor", "1", 0.3, 1.0).or(0.8),
            Key::new("friction_coefficient", "1", -1.0, 1.0).or(0.0),
            Key::new("friction_pressure_slope", "1/Pa", -0.0001, 0.0001).or(0.0),
            Key::new("friction_floor", "1", 0.0, 1.0).or(0.0),
            Key::new("friction_presliding", "m", 1e-7, 1.0).or(0.001),
            Key::new("buckling_load", "N", 0.0, STRUT).or(0.0),
        ],
    },
    Block {
        name: "transmission",
        acts_in: &[],
        keys: &[
            Key::choice("kind", &["tendon", "published", "pulley", "polynomial"], "tendon"),
            Key::new("upper_axial", "m", 1e-6, 10.0).only(TENDON),
            Key::new("upper_offset", "m", -10.0, 10.0).only(TENDON),
            Key::new("lower_axial", "m", 1e-6, 10.0).only(TENDON),
            Key::new("lower_offset", "m", -10.0, 10.0).only(TENDON),
            Key::new("radius", "m", -10.0, 10.0).only(&["pulley"]),
            Key::new("coefficients", "m", -100.0, 100.0).list().only(&["polynomial"]),
            Key::new("rest_angle", "rad", -TAU, TAU),
        ],
    },
    Block {
        name: "joint",
        acts_in: &["arm"],
        keys: &[
            Key::choice("kind", &["tendon", "published", "pulley", "polynomial", "free"], "tendon"),
            Key::new("upper_axial", "m", 1e-6, 10.0).only(TENDON),
            Key::new("upper_offset", "m", -10.0, 10.0).only(TENDON),
            Key::new("lower_axial", "m", 1e-6, 10.0).only(TENDON),
            Key::new("lower_offset", "m", -10.0, 10.0).only(TENDON),
            Key::new("radius", "m", -10.0, 10.0).only(&["pulley"]),
            Key::new("coefficients", "m", -100.0, 100.0).list().only(&["polynomial"]),
            Key::new("rest_angle", "rad", -TAU, TAU),
            Key::new("min_angle", "rad", -TAU, TAU),
            Key::new("max_angle", "rad", -TAU, TAU),
            Key::new("stop_stiffness", "N m/rad", 0.0, 1e9).or(20000.0),
            Key::new("stop_damping", "N m s/rad", 0.0, 1e7).or(60.0),
            Key::new("stiffness", "N m/rad", 0.0, 1e9).or(0.0).moves(),
            Key::new("spring_angle", "rad", -TAU, TAU).or(0.0).moves(),
        ],
    },
    Block {
        name: "arm",
        acts_in: &["arm"],
        keys: &[
            Key::choice("kind", &["one_link", "planar"], "one_link"),
            Key::new("inertia", "kg m2", 1e-9, 1e6).only(ONE_LINK).moves(),
            Key::new("first_moment", "kg m", -1e5, 1e5).or(0.0).only(ONE_LINK).moves(),
            Key::new("length", "m", 0.0001, 100.0).only(ONE_LINK),
            Key::new("payload", "kg", 0.0, 1e5).or(0.0).only(ONE_LINK).moves(),
            Key::new("viscous", "N m s/rad", 0.0, 1e6).or(0.0).only(ONE_LINK).moves(),
            Key::new("coulomb", "N m", 0.0, 1e6).or(0.0).only(ONE_LINK).moves(),
            Key::new("coulomb_speed", "rad/s", 1e-9, 100.0).or(0.02).only(ONE_LINK),
            Key::new("gravity", "m/s2", -50.0, 50.0).or(9.80665),
            Key::new("base_angle", "rad", -TAU, TAU).or(0.0).moves(),
            Key::new("centre_angle", "rad", -TAU, TAU).or(0.0).only(ONE_LINK).moves(),
        ],
    },
    Block {
        name: "link",
        acts_in: &["arm"],
        keys: &[
            Key::new("length", "m", 0.0, 100.0).moves(),
            Key::new("mass", "kg", 0.0, 1e5).moves(),
            Key::new("centre", "m", -100.0, 100.0).moves(),
            Key::new("inertia", "kg m2", 0.0, 1e6).moves(),
            Key::new("payload", "kg", 0.0, 1e5).or(0.0).moves(),
            Key::new("viscous", "N m s/rad", 0.0, 1e6).or(0.0).moves(),
            Key::new("coulomb", "N m", 0.0, 1e6).or(0.0).moves(),
            Key::new("coulomb_speed", "rad/s", 1e-9, 100.0).or(0.02),
        ],
    },
    Block {
        name: "load",
        acts_in: &["arm"],
        keys: &[
            Key::choice("kind", &["mass", "frame"], "mass"),
            Key::new("min_length", "m", 0.001, 10.0),
            Key::new("max_length", "m", 0.001, 10.0),
            Key::new("mass", "kg", 1e-6, 1e5).only(MASS).moves(),
            Key::new("viscous", "N s/m", 0.0, 1e7).or(0.0).only(MASS).moves(),
            Key::new("coulomb", "N", 0.0, 1e7).or(0.0).only(MASS).moves(),
            Key::new("coulomb_speed", "m/s", 1e-9, 100.0).or(0.01).only(MASS),
            Key::new("gravity", "m/s2", -50.0, 50.0).or(9.80665).only(MASS),
            Key::new("stop_stiffness", "N/m", 0.0, 1e11).or(1e6).only(MASS),
            Key::new("stop_damping", "N s/m", 0.0, 1e9).or(1000.0).only(MASS),
        ],
    },
    Block {
        name: "sensors",
        acts_in: &[],
        keys: &[
            Key::new("pressure_zero", "Pa", -1e6, 1e6).or(0.0).moves(),
            Key::new("angle_zero", "rad", -TAU, TAU).or(0.0).moves(),
            Key::new("length_zero", "m", -10.0, 10.0).or(0.0).moves(),
            Key::new("force_gain", "1", 0.01, 100.0).or(1.0).moves(),
        ],
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_in_order_and_hold_the_usual_value() {
        for key in BLOCKS.iter().flat_map(|block| block.keys) {
            assert!(key.lower < key.upper || key.kind == Kind::Choice, "{key:?}");
            let usual = match key.usual {
                Usual::Number(value) => vec![value],
                Usual::List(values) => values.to_vec(),
                Usual::Word(word) => {
                    assert!(word.is_empty() || key.choices.contains(&word), "{key:?}");
                    Vec::new()
                }
                Usual::Needed => Vec::new(),
            };
            assert!(usual.iter().all(|v| key.check(key.name, *v).is_ok()), "{key:?}");
        }
    }

    #[test]
    fn a_kind_of_which_a_key_is_is_a_word_of_its_block() {
        for block in BLOCKS {
            let words: Vec<_> = block.keys.iter().flat_map(|key| key.choices).collect();
            for key in block.keys {
                assert!(key.only.iter().all(|only| words.contains(&only)), "{key:?}");
                assert!(key.needs.is_empty() || block.keys.iter().any(|k| k.name == key.needs));
            }
        }
    }

    #[test]
    fn a_message_names_the_key_its_value_and_what_is_allowed() {
        let told = key!("valve", "half_range").check("valve.flexor.half_range", 0.0);
        assert_eq!(
            told.unwrap_err().to_string(),
            "valve.flexor.half_range = 0 is not allowed: a finite number from 0.001 to 100 V"
        );
        let told = key!("chamber", "gas").check_word("chamber.gas", "ideal").unwrap_err();
        assert!(told.to_string().contains("\"coefficients\", \"energy_balance\""));
    }
}
