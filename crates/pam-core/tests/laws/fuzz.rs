//! Rigs, commands and states at random: an error that says what is wrong, or finite numbers; no
//! panic, and no allocation without an end. `PROPTEST_CASES` says how many (`make fuzz`).

use super::rigs::compiled;
use pam_core::simulate::{simulate, Initial, Progress, Timing, Trajectory};
use pam_core::{Rig, RigSpec};
use proptest::prelude::*;
use proptest::sample::Index;
use serde_json::Value;

const SHOULDER: &str = include_str!("../data/shoulder.json");
/// Steps of a sample that a test waits for.
const MOST_STEPS: usize = 20_000;

/// Numbers that programs are wrong about, and usual ones.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>(),
        -10.0..10.0,
        prop::sample::select(vec![
            0.0,
            -0.0,
            1e-300,
            -1e-300,
            1e300,
            -1e300,
            1e-9,
            1e9,
            f64::MIN_POSITIVE,
            f64::MAX,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
        ]),
    ]
}

/// Places of a document that hold a number.
fn numbers(value: &mut Value) -> Vec<&mut Value> {
    match value {
        Value::Number(_) => vec![value],
        Value::Array(items) => items.iter_mut().flat_map(numbers).collect(),
        Value::Object(items) => items.values_mut().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}

/// A shoulder of which some numbers are multiplied or replaced.
fn changed(changes: &[(Index, bool, f64)]) -> Option<Rig> {
    let mut document: Value = serde_json::from_str(SHOULDER).unwrap();
    for (at, replaced, by) in changes {
        let mut places = numbers(&mut document);
        let count = places.len();
        let place = &mut places[at.index(count)];
        let was = place.as_f64().unwrap();
        **place = Value::from(if *replaced { *by } else { was * by });
    }
    let usual = compiled(RigSpec::from_json(SHOULDER).unwrap());
    RigSpec::from_json(&document.to_string()).and_then(|spec| usual.respecified(spec)).ok()
}

/// Whether every number of a run can be used.
fn finite(run: &Trajectory) -> bool {
    run.channels.iter().flatten().all(|value| value.is_finite())
}

proptest! {
    #[test]
    fn any_text_is_a_rig_or_an_error(text in ".{0,200}") {
        let _ = RigSpec::from_json(&text).and_then(Rig::new);
    }

    #[test]
    fn any_part_of_a_rig_is_a_rig_or_an_error(end in any::<Index>(), noise in any::<char>()) {
        let end = end.index(SHOULDER.len());
        let text = format!("{}{noise}{}", &SHOULDER[..end], &SHOULDER[end..]);
        let _ = RigSpec::from_json(&text).and_then(Rig::new);
        let _ = RigSpec::from_json(&SHOULDER[..end]).and_then(Rig::new);
    }

    #[test]
    fn any_rig_and_commands_give_numbers_or_an_error(
        changes in prop::collection::vec((any::<Index>(), any::<bool>(), number()), 0..4),
        commands in prop::collection::vec(number(), 1..6),
        start in number(),
        sample_time in number(),
    ) {
        let Some(rig) = changed(&changes) else { return Ok(()) };
        let timing = Timing::new(sample_time.abs().min(0.01), sample_time.abs().min(0.01));
        let Ok(timing) = timing.and_then(|timing| timing.stable(&rig)) else { return Ok(()) };
        if timing.substeps > MOST_STEPS {
            return Ok(());
        }
        let rest = Initial::rest(&rig);
        let started = rest.clone().with(&rig, "muscle_pressure", start).unwrap_or(rest);
        let signals = [("valve_command", commands.as_slice())];
        if let Ok(run) = simulate(&rig, commands.len(), &signals, timing, &started) {
            prop_assert!(finite(&run), "{run:?}");
        }
    }

    #[test]
    fn any_state_is_gone_on_from_or_an_error(
        places in prop::collection::vec((any::<Index>(), number()), 1..5),
        cut in any::<Index>(),
        whole in any::<bool>(),
    ) {
        let rig = changed(&[]).unwrap();
        let timing = Timing { sample_time: 0.002, substeps: 2 }.stable(&rig).unwrap();
        let mut progress = Progress::start(&rig, &Initial::rest(&rig)).unwrap();
        let mut state = progress.to_vec();
        for (at, value) in &places {
            let at = at.index(state.len());
            state[at] = *value;
        }
        if !whole {
            state.truncate(cut.index(state.len()));
        }
        let Ok(restored) = progress.restored(&rig, &state) else { return Ok(()) };
        progress = restored;
        let commands = [5.5; 4];
        let drive = pam_core::simulate::drive::Drive::new(
            &rig, commands.len(), &[("valve_command", &commands)],
        ).unwrap();
        let mut out = Trajectory::new(&rig, commands.len());
        if progress.advance(&rig, timing, &drive, &mut out).is_ok() {
            prop_assert!(finite(&out), "{out:?}");
        }
    }
}
