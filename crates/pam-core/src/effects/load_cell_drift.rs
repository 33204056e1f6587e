//! `load_cell_drift`: the zero of a load cell, or of a torque sensor, that creeps while a recording
//! lasts.
//!
//! What is recorded is `F + z(t)`, with `z` as in `gauge_drift`: `D t/60 s` (`straight`) or `D (1 -
//! exp(-t/tau))` (`exponential`), another size in each recording. It is the same at any length and
//! pressure, which neither creep nor moduli that change are. OIML R 60 (creep and zero return of
//! load cells); E. O. Doebelin, *Measurement Systems*, ch. 3.

use super::gauge_drift::{exponential, straight, DRIFTS, TIME_CONSTANT};
use super::{EffectInfo, EffectParameter, Form, Port};
use crate::made_by;

const CHANGE: EffectParameter =
    EffectParameter::new("change", "N", -1e6, 1e6, 5.0).starts(&[5.0]).off(0.0).own();

const STRAIGHT: Form = Form {
    name: "straight",
    parameters: &[CHANGE],
    states: &[],
    integrates: false,
    ports: &[Port::Zero],
    make: made_by!(straight),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "load_cell_drift",
    block: "sensors",
    at: "",
    acts_in: &["pull"],
    kink: Some(DRIFTS),
    source: "OIML R 60; Doebelin, Measurement Systems, ch. 3",
    forms: &[
        STRAIGHT,
        Form {
            name: "exponential",
            parameters: &[CHANGE, TIME_CONSTANT],
            make: made_by!(exponential),
            ..STRAIGHT
        },
    ],
    ..EffectInfo::USUAL
};
