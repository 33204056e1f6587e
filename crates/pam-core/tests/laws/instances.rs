//! Several instances of one effect, each at its own block with its own parameters, and what cannot
//! be together.

use super::rigs::{
    antagonists, compiled, effect, effect_at, lone_tank, regulated, shoulder, two_joints, TYPICAL,
};
use pam_core::cut_chain::{predict, Block, Measured, Prediction, Signal};
use pam_core::description::EffectSpec;
use pam_core::effects::{
    base_flexibility, leak_muscle, payload_swing, pressure_lag, tube_flow_restriction, EffectInfo,
    EffectState, Form, Port, Role, EFFECTS,
};
use pam_core::simulate::{simulate, Initial, Timing, Trajectory};
use pam_core::{Rig, RigSpec};

const ROWS: usize = 60;
const TIMING: Timing = Timing { sample_time: 0.01, substeps: 10 };

fn with(spec: RigSpec, effects: Vec<EffectSpec>) -> Rig {
    compiled(RigSpec { effects, ..spec })
}

fn leak(at: &str, conductance: f64) -> EffectSpec {
    effect_at("leak_muscle", at, &[("conductance", conductance), ("laminar_share", 0.3)])
}

/// Valves a little open, both chambers under pressure.
fn commands(rig: &Rig) -> Vec<(String, Vec<f64>)> {
    let values: Vec<f64> = (0..ROWS).map(|k| 5.0 + 0.2 * (0.2 * k as f64).sin()).collect();
    rig.names().inputs.iter().map(|name| (name.clone(), values.clone())).collect()
}

fn borrowed(signals: &[(String, Vec<f64>)]) -> Vec<(&str, &[f64])> {
    signals.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect()
}

fn run(rig: &Rig) -> Trajectory {
    let start = ["muscle_pressure.flexor", "muscle_pressure.extensor"]
        .iter()
        .fold(Initial::rest(rig), |start, name| start.with(rig, name, 2e5).unwrap());
    simulate(rig, ROWS, &borrowed(&commands(rig)), TIMING.stable(rig).unwrap(), &start).unwrap()
}

fn last(rig: &Rig, out: &Trajectory, name: &str) -> f64 {
    *out.get(rig, name).unwrap().last().unwrap()
}

#[test]
fn two_muscles_leak_differently() {
    let rig = with(antagonists(), vec![leak("flexor", 8e-10), leak("extensor", 1e-10)]);
    let same = with(antagonists(), vec![leak("flexor", 1e-10), leak("extensor", 1e-10)]);
    let everywhere = with(antagonists(), vec![leak("", 1e-10)]);
    let tight = with(antagonists(), vec![leak("flexor", 0.0), leak("extensor", 0.0)]);
    let plain = with(antagonists(), vec![]);
    assert_eq!(run(&same).channels, run(&everywhere).channels, "two alike are one everywhere");
    assert_eq!(run(&tight).channels, run(&plain).channels, "without conductance they are none");
    let lost = |name: &str| last(&plain, &run(&plain), name) - last(&rig, &run(&rig), name);
    let (flexor, extensor) = (lost("air_mass.flexor"), lost("air_mass.extensor"));
    assert!(extensor > 0.0 && flexor > 4.0 * extensor, "{flexor} {extensor}");
    // Their order in the description does not matter.
    let turned = with(antagonists(), vec![leak("extensor", 1e-10), leak("flexor", 8e-10)]);
    assert_eq!(run(&turned).channels, run(&rig).channels);
}

#[test]
fn each_has_parameters_of_its_own() {
    let rig = with(antagonists(), vec![leak("flexor", 8e-10), leak("extensor", 1e-10)]);
    let table = rig.parameters();
    for (name, value) in [("flexor.conductance", 8e-10), ("extensor.conductance", 1e-10)] {
        assert_eq!(table.value(table.find(&format!("leak_muscle.{name}")).unwrap()), value);
    }
    assert!(table.find("leak_muscle.conductance").is_err());
    // Other values are what another description gives, bit for bit.
    let mut values = table.values().to_vec();
    let place = table.names().iter().position(|n| n == "leak_muscle.extensor.conductance").unwrap();
    values[place] = 5e-10;
    let (changed, meant) = (
        rig.with_values(&values).unwrap(),
        with(antagonists(), vec![leak("flexor", 8e-10), leak("extensor", 5e-10)]),
    );
    assert_eq!(run(&changed).channels, run(&meant).channels);
    values[place] = -1.0;
    let text = rig.with_values(&values).unwrap_err().to_string();
    assert!(text.contains("leak_muscle.extensor.conductance"), "{text}");
}

#[test]
fn one_at_a_block_is_found_by_both_names() {
    let at_one = with(antagonists(), vec![leak("flexor", 8e-10)]);
    let everywhere = with(antagonists(), vec![leak("", 8e-10)]);
    let find =
        |rig: &Rig, name: &str| rig.parameters().find(name).map(|id| rig.parameters().value(id));
    for name in ["leak_muscle.conductance", "leak_muscle.flexor.conductance"] {
        assert_eq!(find(&at_one, name).unwrap(), 8e-10);
    }
    let [one, other] = ["leak_muscle.conductance", "leak_muscle.flexor.conductance"]
        .map(|name| at_one.parameters().find(name).unwrap());
    assert_eq!(one, other);
    let named =
        |rig: &Rig| rig.parameters().names().iter().filter(|n| n.starts_with("leak")).count();
    assert_eq!((named(&at_one), named(&everywhere)), (2, 2), "each is there once");
    assert!(find(&at_one, "leak_muscle.extensor.conductance").is_err());
    assert!(find(&everywhere, "leak_muscle.flexor.conductance").is_err());
}

/// What a block predicts from a simulation, with the sensitivities to some parameters.
fn predicted(rig: &Rig, truth: &Trajectory, block: &str, names: &[&str]) -> Prediction {
    let inputs = commands(rig);
    let known = ["supply_pressure", "muscle_pressure", "joint_angle"];
    let channels: Vec<_> = (rig.names().channels.iter().map(|(name, _)| name.as_str()))
        .filter(|name| known.contains(&name.split('.').next().unwrap()))
        .collect();
    let slopes: Vec<Vec<f64>> = (channels.iter())
        .map(|name| {
            let values = truth.get(rig, name).unwrap();
            let at = |k: usize| values[k.min(ROWS - 1)];
            (0..ROWS).map(|k| (at(k + 1) - at(k.saturating_sub(1))) / 0.02).collect()
        })
        .collect();
    let measured: Vec<_> = (channels.iter().zip(&slopes))
        .map(|(name, slope)| (*name, Signal { value: truth.get(rig, name).unwrap(), slope }))
        .collect();
    let measured = Measured::new(rig, ROWS, &borrowed(&inputs), &measured).unwrap();
    let ids: Vec<_> = names.iter().map(|n| rig.parameters().find(n).unwrap()).collect();
    predict(
        rig,
        Block::from_name(rig, block).unwrap(),
        &measured,
        TIMING.stable(rig).unwrap(),
        &[0],
        &ids,
    )
    .unwrap()
}

#[test]
fn each_has_sensitivities_of_its_own() {
    let names = ["leak_muscle.flexor.conductance", "leak_muscle.extensor.conductance"];
    let sizes = [8e-10, 1e-10];
    let rig = with(antagonists(), vec![leak("flexor", sizes[0]), leak("extensor", sizes[1])]);
    let truth = run(&rig);
    for (own, block) in ["chamber.flexor", "chamber.extensor"].into_iter().enumerate() {
        let exact = predicted(&rig, &truth, block, &names);
        let shifted = |by: f64| {
            let mut now = sizes;
            now[own] += by;
            let rig = with(antagonists(), vec![leak("flexor", now[0]), leak("extensor", now[1])]);
            predicted(&rig, &truth, block, &[]).value
        };
        let step = 1e-4 * sizes[own];
        let (up, down) = (shifted(step), shifted(-step));
        let slope = |k: usize, column: usize| exact.jacobian[k * exact.columns + column];
        let scale = (0..ROWS).map(|k| slope(k, own).abs()).fold(0.0, f64::max);
        assert!(scale > 0.0, "{block}");
        for k in 0..ROWS {
            let gap = (slope(k, own) - (up[k] - down[k]) / (2.0 * step)).abs();
            assert!(gap <= 1e-4 * scale, "{block}, row {k}: {gap} of {scale}");
            assert_eq!(slope(k, 1 - own), 0.0, "the other muscle's leak is not in {block}");
        }
    }
}

fn refusal(spec: RigSpec, effects: Vec<EffectSpec>) -> String {
    Rig::new(RigSpec { effects, ..spec }).unwrap_err().to_string()
}

#[test]
fn one_effect_does_not_act_on_a_block_twice() {
    let twice = |effects| refusal(antagonists(), effects);
    for effects in [
        vec![leak("flexor", 1e-10), leak("flexor", 2e-10)],
        vec![leak("", 1e-10), leak("flexor", 2e-10)],
        vec![leak("flexor", 1e-10), leak("extensor", 1e-10), leak("flexor", 2e-10)],
    ] {
        let text = twice(effects);
        assert!(text.contains("'leak_muscle' acts on chamber.flexor twice"), "{text}");
    }
    let clock = || effect("clock_skew", &[("offset", 0.01), ("rate", 0.0), ("angle_share", 1.0)]);
    assert!(twice(vec![clock(), clock()]).contains("'clock_skew' acts on rig twice"));
    // A payload without a name is the last link's.
    let change = |at: &str| effect_at("payload_change", at, &[("mass_change", 0.5), ("time", 0.2)]);
    let text = refusal(two_joints(), vec![change(""), change("wrist")]);
    assert!(text.contains("'payload_change' acts on joint.wrist twice"), "{text}");
    assert!(
        Rig::new(RigSpec { effects: vec![change(""), change("elbow")], ..two_joints() }).is_ok()
    );
}

/// Another effect where the sensor's lag acts.
const SECOND: EffectInfo = EffectInfo { id: "second_lag", ..pressure_lag::INFO };
static READINGS: &[&EffectInfo] = &[&pressure_lag::INFO, &SECOND];

#[test]
fn a_port_for_one_effect_takes_one() {
    let lag = |id: &str, at: &str| effect_at(id, at, &[("time_constant", 0.01)]);
    let rig = |effects| Rig::with_effects(RigSpec { effects, ..antagonists() }, READINGS);
    let text =
        rig(vec![lag("pressure_lag", ""), lag("second_lag", "flexor")]).unwrap_err().to_string();
    for word in ["'pressure_lag'", "'second_lag'", "cannot both act on chamber.flexor"] {
        assert!(text.contains(word), "{text}");
    }
    assert!(rig(vec![lag("pressure_lag", "extensor"), lag("second_lag", "flexor")]).is_ok());
    let hose = effect("tube_flow_restriction", &[("conductance", 1e-8), ("tap", 0.0)]);
    let silencer = effect("exhaust_back_pressure", &[("conductance", 1e-8)]);
    let text = refusal(antagonists(), vec![hose, silencer]);
    assert!(text.contains("cannot both act on valve.flexor"), "{text}");
    // No two effects of the catalogue want such a port.
    let single = [Port::Passage, Port::Balance, Port::Hanging, Port::Mounting, Port::Reading];
    for port in single {
        let wanting =
            EFFECTS.iter().filter(|e| e.forms.iter().any(|form| form.ports.contains(&port)));
        assert!(wanting.count() <= 1, "{port:?}");
    }
}

#[test]
fn an_unknown_form_is_refused_with_those_that_there_are() {
    for info in EFFECTS {
        let form = EffectSpec { form: "other".into(), ..effect(info.id, &[]) };
        let text = refusal(shoulder(), vec![form]);
        let known = format!("\"{}\"", info.forms[0].name);
        assert!(
            text.contains(info.id) && text.contains("no form \"other\"") && text.contains(&known),
            "{text}"
        );
    }
    let named =
        EffectSpec { form: leak_muscle::INFO.forms[0].name.into(), ..leak("flexor", 1e-10) };
    let (one, other) =
        (with(antagonists(), vec![named]), with(antagonists(), vec![leak("flexor", 1e-10)]));
    assert_eq!(
        run(&one).channels,
        run(&other).channels,
        "the first form is the one without a name"
    );
}

fn typical(id: &str) -> EffectSpec {
    TYPICAL.iter().find(|typical| typical.id == id).unwrap().on()
}

#[test]
fn an_effect_without_a_place_is_refused_with_what_it_needs() {
    let deadband = || vec![typical("supply_regulator_deadband")];
    assert!(Rig::new(RigSpec { effects: deadband(), ..regulated() }).is_ok());
    let text = refusal(shoulder(), deadband());
    for word in ["'supply_regulator_deadband'", "of the kind regulator", "supply is a tank"] {
        assert!(text.contains(word), "{text}");
    }
    let text = refusal(regulated(), vec![typical("compressor_cut_in")]);
    assert!(text.contains("of the kind tank") && text.contains("supply is a regulator"), "{text}");
    for (id, words) in [
        ("valve_dead_zone", "acts on a valve, and the rig has none"),
        ("muscle_creep", "acts on a muscle, and the rig has none"),
        ("joint_end_stop", "acts on a joint, and the rig has nothing that moves"),
        ("base_flexibility", "acts on an arm, and the rig has nothing that moves"),
        ("payload_change", "joint or the mass of a load, and the rig has nothing that moves"),
    ] {
        let text = refusal(lone_tank(), vec![typical(id)]);
        assert!(text.contains(&format!("'{id}'")) && text.contains(words), "{text}");
    }
}

/// A form with a number of states, none of which says anything.
const fn with_states(info: &EffectInfo, states: &'static [EffectState]) -> Form {
    Form { states, ..info.forms[0] }
}

const STATE: EffectState = EffectState { name: "one", role: Role::Keeps };
const TWO: EffectState = EffectState { name: "two", role: Role::Keeps };
const NO_READING: EffectInfo =
    EffectInfo { forms: &[with_states(&pressure_lag::INFO, &[])], ..pressure_lag::INFO };
const TWO_TAPS: EffectInfo = EffectInfo {
    forms: &[with_states(&tube_flow_restriction::INFO, &[STATE, TWO])],
    ..tube_flow_restriction::INFO
};
const LAME_CORD: EffectInfo =
    EffectInfo { forms: &[with_states(&payload_swing::INFO, &[STATE])], ..payload_swing::INFO };
const STIFF_BASE: EffectInfo =
    EffectInfo { forms: &[with_states(&base_flexibility::INFO, &[])], ..base_flexibility::INFO };
static WRONG: &[&EffectInfo] = &[&NO_READING, &TWO_TAPS, &LAME_CORD, &STIFF_BASE];

#[test]
fn a_form_with_other_states_than_its_port_needs_is_refused() {
    for (info, words) in WRONG.iter().zip([
        "has 0 states, and what acts at the port Reading has 1",
        "has 2 states, and what acts at the port Passage has 1",
        "has 1 states, and what acts at the port Hanging has 2",
        "has 0 states, and what acts at the port Mounting has 2",
    ]) {
        let spec = RigSpec { effects: vec![typical(info.id)], ..shoulder() };
        assert!(Rig::new(spec.clone()).is_ok());
        let text = Rig::with_effects(spec, WRONG).unwrap_err().to_string();
        assert!(text.contains(info.id) && text.contains(words), "{text}");
    }
    for info in EFFECTS {
        for form in info.forms {
            for needed in form.ports.iter().filter_map(|port| port.states()) {
                assert_eq!(form.states.len(), needed, "{}", info.id);
            }
        }
    }
}

#[test]
fn only_one_mass_can_hang() {
    let swing = |at: &str| EffectSpec { at: at.into(), ..typical("payload_swing") };
    let text = refusal(two_joints(), vec![swing("elbow"), swing("wrist")]);
    for word in ["only one mass of an arm can hang", "at joint.elbow", "at joint.wrist"] {
        assert!(text.contains(word), "{text}");
    }
    assert!(Rig::new(RigSpec { effects: vec![swing("elbow")], ..two_joints() }).is_ok());
}
