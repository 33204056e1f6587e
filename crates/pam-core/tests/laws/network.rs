//! Laws of rigs of several blocks: what is conserved, what they come to rest at, order, stability,
//! and what is refused.

use pam_core::blocks::supply::FASTEST;
use pam_core::cut_chain::{predict, Block, Measured, Signal};
use pam_core::description::{ArmSpec, ChamberSpec, LineSpec, LinkSpec, SupplySpec};
use pam_core::simulate::{simulate, Initial, Progress, Timing, Trajectory};
use pam_core::{Rig, RigSpec};

use super::rigs::{antagonists, compiled, shoulder, two_joints, with_struts};

const RT: f64 = 287.05 * 293.15;
const AMBIENT: f64 = 101_325.0;

/// Nothing but chambers and lines.
fn gas(chambers: &[(&str, f64, f64)], lines: Vec<LineSpec>) -> RigSpec {
    let mut spec = shoulder();
    spec.arm = None;
    (spec.supplies, spec.valves, spec.muscles, spec.joints) = (vec![], vec![], vec![], vec![]);
    spec.chambers = (chambers.iter())
        .map(|(name, volume, pressure)| ChamberSpec {
            name: (*name).into(),
            dead_volume: *volume,
            initial_pressure: *pressure,
            gas: "coefficients".into(),
            heat_transfer_coefficient: 0.0,
            alpha_in: 1.0,
            alpha_out: 1.0,
            alpha: 1.0,
        })
        .collect();
    spec.lines = lines;
    spec
}

fn tube(from: &str, to: &str, length: f64, diameter: f64) -> LineSpec {
    LineSpec {
        name: String::new(),
        kind: "tube".into(),
        from: from.into(),
        to: to.into(),
        length,
        diameter,
        discharge_area: 0.0,
        inlet_volume: 0.0,
        pressure_zero: 0.0,
        segments: 0,
        alpha: 1.4,
    }
}

fn orifice(from: &str, to: &str, area: f64) -> LineSpec {
    LineSpec { kind: "orifice".into(), discharge_area: area, ..tube(from, to, 0.0, 0.0) }
}

fn wave(rows: usize, phase: f64) -> Vec<f64> {
    (0..rows).map(|k| 5.2 + 0.9 * (k as f64 * 0.02 + phase).sin()).collect()
}

fn last(rig: &Rig, run: &Trajectory, name: &str) -> f64 {
    *run.get(rig, name).unwrap().last().unwrap()
}

fn run(
    rig: &Rig,
    rows: usize,
    signals: &[(&str, &[f64])],
    sample_time: f64,
    step: f64,
) -> Trajectory {
    let timing = Timing::new(sample_time, step).unwrap().stable(rig).unwrap();
    simulate(rig, rows, signals, timing, &Initial::rest(rig)).unwrap()
}

/// Supplied less vented less stored, relative to what moved.
fn imbalance(rig: &Rig, run: &Trajectory) -> f64 {
    let masses = |k: usize| -> f64 {
        let own = rig
            .names()
            .channels
            .iter()
            .filter(|(n, _)| n.starts_with("air_mass") || n.starts_with("line_mass"));
        own.map(|(n, _)| run.get(rig, n).unwrap()[k]).sum()
    };
    let rows = run.channels[0].len();
    let (supplied, vented) = (last(rig, run, "mass_supplied"), last(rig, run, "mass_vented"));
    let moved = supplied.abs() + vented.abs() + masses(0);
    (supplied - vented - (masses(rows - 1) - masses(0))).abs() / moved
}

#[test]
fn mass_in_is_mass_stored_and_vented() {
    let (a, b) = (wave(400, 0.0), wave(400, 2.0));
    let pair: [(&str, &[f64]); 2] = [("valve_command.flexor", &a), ("valve_command.extensor", &b)];
    let rig = compiled(antagonists());
    let out = run(&rig, 400, &pair, 0.005, 1e-3);
    assert!(imbalance(&rig, &out) < 1e-12, "{}", imbalance(&rig, &out));
    assert!(last(&rig, &out, "mass_supplied") > 1e-4 && last(&rig, &out, "mass_vented") > 1e-4);
    // The tank, whose mass is P V/(R T), lost what was supplied; and E_in is its pressure times its
    // volume.
    let tank = out.get(&rig, "supply_pressure").unwrap();
    let lost = (tank[0] - tank[399]) * 0.015;
    assert!((lost / last(&rig, &out, "energy_supplied") - 1.0).abs() < 1e-9);
    assert!((lost / RT / last(&rig, &out, "mass_supplied") - 1.0).abs() < 1e-9);
    let closed = compiled(gas(
        &[("a", 1e-4, 5e5), ("b", 3e-4, 0.0)],
        vec![tube("chamber.a", "chamber.b", 2.0, 0.004)],
    ));
    let out = run(&closed, 200, &[], 0.01, 1e-3);
    assert!(imbalance(&closed, &out) < 1e-13);
}

#[test]
fn a_choked_isothermal_blow_down_is_an_exponential() {
    let (volume, area) = (2e-3, 1e-6);
    let rig = compiled(gas(&[("", volume, 9e5)], vec![orifice("chamber", "ambient", area)]));
    let out = run(&rig, 401, &[], 0.05, 1e-3);
    let psi = (2.0_f64 / 2.4).powf(2.5) * (1.4_f64 / 2.4).sqrt();
    let tau = volume / (RT * area * (2.0 / RT).sqrt() * psi);
    let pressure = out.get(&rig, "muscle_pressure").unwrap();
    let mut checked = 0;
    for (k, p) in pressure.iter().enumerate() {
        let exact = (9e5 + AMBIENT) * (-(k as f64) * 0.05 / tau).exp();
        if AMBIENT / exact < 0.528 {
            assert!(((p + AMBIENT) / exact - 1.0).abs() < 1e-9, "row {k}");
            checked += 1;
        }
    }
    assert!(checked > 50);
    let event = &out.events[out.events.len() - 1];
    let t = tau * ((9e5 + AMBIENT) * 0.528_281_787_717 / AMBIENT).ln();
    assert_eq!((event.kind.name(), event.block.as_str()), ("unchoked", "line"));
    assert!((event.time - t).abs() < 1e-4, "{} {t}", event.time);
}

#[test]
fn a_tube_brings_two_chambers_to_one_pressure() {
    let spec = gas(
        &[("a", 1e-4, 5e5), ("b", 3e-4, 0.0)],
        vec![tube("chamber.a", "chamber.b", 2.0, 0.004)],
    );
    let rig = compiled(spec);
    let out = run(&rig, 300, &[], 0.01, 1e-3);
    let half = std::f64::consts::PI * 0.002 * 0.002 * 2.0 / 2.0;
    let (va, vb) = (1e-4 + half, 3e-4 + half);
    let expected = ((5e5 + AMBIENT) * va + AMBIENT * vb) / (va + vb) - AMBIENT;
    for name in ["muscle_pressure.a", "muscle_pressure.b"] {
        assert!((last(&rig, &out, name) / expected - 1.0).abs() < 1e-9, "{name}");
    }
}

#[test]
fn antagonists_at_one_pressure_stay_in_the_middle_and_move_with_a_difference() {
    let rig = compiled(antagonists());
    let (five, six) = (vec![5.0; 300], vec![5.4; 300]);
    let still = run(
        &rig,
        300,
        &[("valve_command.flexor", &six), ("valve_command.extensor", &six)],
        0.01,
        1e-3,
    );
    assert!(last(&rig, &still, "joint_angle").abs() < 1e-12);
    assert!(last(&rig, &still, "muscle_pressure.flexor") > 5e5);
    let bent = run(
        &rig,
        300,
        &[("valve_command.flexor", &six), ("valve_command.extensor", &five)],
        0.01,
        1e-3,
    );
    assert!(last(&rig, &bent, "joint_angle") > 0.3);
    let pull = |run: &Trajectory, name: &str| last(&rig, run, &format!("muscle_force.{name}"));
    let torque = 0.025 * (pull(&bent, "flexor") - pull(&bent, "extensor"));
    assert!((torque - last(&rig, &bent, "joint_torque")).abs() < 1e-9 * torque.abs().max(1.0));
}

#[test]
fn what_the_muscles_give_the_arm_takes() {
    // No gravity, no friction, no stop touched: kinetic energy is the work of the muscles. They push
    // like struts: without air slack ones do nothing yet.
    let mut spec = with_struts(antagonists());
    let arm = spec.arm.as_mut().unwrap();
    (arm.viscous, arm.coulomb) = (0.0, 0.0);
    let inertia = arm.inertia + arm.payload * arm.length * arm.length;
    let rig = compiled(spec);
    let (a, b) = (vec![5.2; 60], vec![5.0; 60]);
    let out =
        run(&rig, 60, &[("valve_command.flexor", &a), ("valve_command.extensor", &b)], 0.005, 2e-4);
    assert!(out.events.iter().all(|e| !e.block.starts_with("joint")));
    let rate = last(&rig, &out, "joint_rate");
    let kinetic = 0.5 * inertia * rate * rate;
    assert!(kinetic > 0.1, "{kinetic}");
    let rest = Progress::start(&rig, &Initial::rest(&rig)).unwrap();
    assert_eq!(rest.samples(), 0);
    assert!((last(&rig, &out, "muscle_work") / kinetic - 1.0).abs() < 1e-6);
}

#[test]
fn a_planar_arm_of_one_link_is_the_one_link_arm() {
    let one = compiled(shoulder());
    let mut spec = shoulder();
    let arm = spec.arm.clone().unwrap();
    // mass and centre that give the same first moment and, with their inertia, the same about the
    // joint
    let (mass, centre) = (4.0, arm.first_moment / 4.0);
    let link = LinkSpec {
        name: String::new(),
        joint: "joint".into(),
        length: arm.length,
        mass,
        centre,
        inertia: arm.inertia - mass * centre * centre * 0.5,
        payload: arm.payload,
        viscous: arm.viscous,
        coulomb: arm.coulomb,
        coulomb_speed: arm.coulomb_speed,
    };
    let mut same = spec.arm.take().unwrap();
    same.inertia = link.inertia + mass * centre * centre;
    let mut one_link = shoulder();
    one_link.arm = Some(same);
    spec.arm = Some(ArmSpec { kind: "planar".into(), links: vec![link], ..arm });
    let (planar, one_link) = (compiled(spec), compiled(one_link));
    let u = wave(300, 0.0);
    let a = run(&planar, 300, &[("valve_command", &u)], 0.005, 1e-3);
    let b = run(&one_link, 300, &[("valve_command", &u)], 0.005, 1e-3);
    for name in ["joint_angle", "muscle_pressure", "joint_torque"] {
        let pairs = a.get(&planar, name).unwrap().iter().zip(b.get(&one_link, name).unwrap());
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-9 * b.abs().max(1.0)), "{name}");
    }
    assert!(one.stable_step() > 1e-3);
}

/// Set to 4 bar, of 50 ms.
fn regulator(droop: f64) -> SupplySpec {
    SupplySpec {
        name: String::new(),
        kind: "regulator".into(),
        volume: 0.0,
        initial_pressure: 4e5,
        time_constant: 0.05,
        droop,
        dead_time: 0.0,
        rise_limit: FASTEST,
        fall_limit: FASTEST,
        dead_band: 0.0,
        pressure_zero: 0.0,
        inlet: String::new(),
    }
}

#[test]
fn a_regulator_settles_and_its_droop_follows_the_flow() {
    let mut spec = gas(&[("", 1e-3, 0.0)], vec![orifice("supply", "chamber", 5e-6)]);
    spec.supplies = vec![regulator(4e6)];
    let rig = compiled(spec);
    let out = run(&rig, 500, &[], 0.02, 1e-3);
    assert!((last(&rig, &out, "muscle_pressure") - 4e5).abs() < 1.0);
    let supply = out.get(&rig, "supply_pressure").unwrap();
    let flow = 5e-6 * (supply[10] + AMBIENT) * (2.0 / RT).sqrt() * 0.4842;
    assert!((supply[10] - (4e5 - 4e6 * flow)).abs() < 500.0, "{}", supply[10]);
    let set: Vec<f64> = (0..500).map(|k| if k < 250 { 4e5 } else { 1e5 }).collect();
    let out = run(&rig, 500, &[("supply_command", &set)], 0.02, 1e-3);
    assert!((last(&rig, &out, "muscle_pressure") - 1e5).abs() < 5.0, "it takes air back");
    assert!(imbalance(&rig, &out) < 1e-12);
}

/// A regulator of no lag to speak of behind another supply.
fn behind(kind: &str, volume: f64, pressure: f64) -> Vec<SupplySpec> {
    let front = SupplySpec {
        name: "bottle".into(),
        kind: kind.into(),
        volume,
        initial_pressure: pressure,
        ..regulator(0.0)
    };
    let own =
        SupplySpec { name: "regulator".into(), inlet: "supply.bottle".into(), ..regulator(4e6) };
    vec![front, own]
}

/// A chamber that a regulator behind a small tank fills through an orifice.
fn small_bottle() -> RigSpec {
    let mut spec = gas(&[("", 1e-3, 0.0)], vec![orifice("supply.regulator", "chamber", 5e-6)]);
    spec.supplies = behind("tank", 1e-3, 7e5);
    spec
}

#[test]
fn what_a_regulator_lets_through_is_drawn_from_its_inlet() {
    let rig = compiled(small_bottle());
    let set = vec![6e5; 600];
    let out = run(&rig, 600, &[("supply_command.regulator", &set)], 0.01, 1e-3);
    let of = |name: &str| out.get(&rig, name).unwrap();
    let (bottle, outlet, chamber) =
        (of("supply_pressure.bottle"), of("supply_pressure.regulator"), of("muscle_pressure"));
    // a litre of each at one temperature: pressures are masses, with what the outlet, which falls
    // later than the bottle, has taken back and vented
    for (k, vented) in of("mass_vented").iter().enumerate() {
        let all = bottle[k] + chamber[k] + vented * RT / 1e-3;
        assert!((all - 7e5).abs() < 1e-9 * 7e5, "{k}: {all}");
    }
    let end = bottle.len() - 1;
    assert!((outlet[end] - bottle[end]).abs() < 5.0, "{} {}", outlet[end], bottle[end]);
    assert!((bottle[end] - 3.5e5).abs() < 1e3, "{}", bottle[end]);
    assert!(outlet.iter().all(|p| *p < 6e5 + 1.0) && outlet[100] < 4.2e5);
    assert!(imbalance(&rig, &out) < 1e-12);
    let given = (7e5 - bottle[end]) * 1e-3 / RT;
    assert!((last(&rig, &out, "mass_supplied") / given - 1.0).abs() < 1e-9, "counted once");
    assert!(last(&rig, &out, "mass_vented") < 1e-3 * given);
    // taking air back it vents it, and the bottle keeps what it has
    let set: Vec<f64> = (0..1200).map(|k| if k < 600 { 3e5 } else { 1e5 }).collect();
    let out = run(&rig, 1200, &[("supply_command.regulator", &set)], 0.01, 1e-3);
    let bottle = out.get(&rig, "supply_pressure.bottle").unwrap();
    assert!((bottle[600] - 4e5).abs() < 100.0 && (bottle[1199] - bottle[600]).abs() < 100.0);
    assert!((last(&rig, &out, "muscle_pressure") - 1e5).abs() < 50.0);
    assert!(imbalance(&rig, &out) < 1e-12);
}

#[test]
fn an_inlet_far_above_every_command_changes_nothing() {
    let line = || vec![orifice("supply.regulator", "chamber", 5e-6)];
    let mut free = gas(&[("", 1e-3, 0.0)], line());
    let mut fed = free.clone();
    fed.supplies = behind("constant", 0.0, 5e6);
    free.supplies = vec![SupplySpec { name: "regulator".into(), ..regulator(4e6) }];
    let set: Vec<f64> = (0..400).map(|k| [4e5, 1e5, 6e5, 2e5][k / 100]).collect();
    for dead_band in [0.0, 3e4] {
        fed.supplies[1].dead_band = dead_band;
        free.supplies[0].dead_band = dead_band;
        let (with, without) = (compiled(fed.clone()), compiled(free.clone()));
        let runs = [&with, &without]
            .map(|rig| run(rig, 400, &[("supply_command.regulator", &set)], 0.01, 1e-3));
        for name in ["supply_pressure.regulator", "muscle_pressure", "air_mass"] {
            assert_eq!(runs[0].get(&with, name), runs[1].get(&without, name), "{name}");
        }
        let vented =
            [last(&with, &runs[0], "mass_vented"), last(&without, &runs[1], "mass_vented")];
        assert_eq!(vented[0], vented[1]);
        let supplied =
            [last(&with, &runs[0], "mass_supplied"), last(&without, &runs[1], "mass_supplied")];
        assert_eq!(supplied[0], supplied[1]);
    }
}

#[test]
fn an_inlet_that_cannot_be_is_refused() {
    let refused = |change: &dyn Fn(&mut Vec<SupplySpec>), word: &str| {
        let mut spec = small_bottle();
        change(&mut spec.supplies);
        let text = Rig::new(spec).unwrap_err().to_string();
        assert!(text.contains("inlet = ") && text.contains(word), "{text}");
    };
    refused(&|supplies| supplies[1].inlet = "supply.botle".into(), "no such block");
    refused(&|supplies| supplies[1].inlet = "chamber".into(), "a supply is needed");
    refused(&|supplies| supplies[1].inlet = "ambient".into(), "a supply is needed");
    refused(&|supplies| supplies[1].inlet = "supply.regulator".into(), "the regulator itself");
    refused(&|supplies| supplies[0].kind = "regulator".into(), "it is a regulator");
    refused(&|supplies| supplies[0].inlet = "supply.regulator".into(), "only a regulator");
}

#[test]
fn the_block_of_a_bottle_is_drawn_from_by_its_regulator() {
    let rig = compiled(small_bottle());
    let (rows, dt) = (400, 0.005);
    let set: Vec<f64> = (0..rows).map(|k| if k < 100 { 3e5 } else { 6e5 }).collect();
    let command: &[(&str, &[f64])] = &[("supply_command.regulator", &set)];
    let timing = Timing::new(dt, 0.001).unwrap().stable(&rig).unwrap();
    let truth = simulate(&rig, rows, command, timing, &Initial::rest(&rig)).unwrap();
    let names = ["supply_pressure.bottle", "supply_pressure.regulator", "muscle_pressure"];
    let slopes: Vec<_> = names.iter().map(|name| slopes(&truth, &rig, name, dt)).collect();
    let every: Vec<_> = (names.iter().zip(&slopes))
        .map(|(name, slope)| (*name, Signal { value: truth.get(&rig, name).unwrap(), slope }))
        .collect();
    let predicted = |rig: &Rig, block: &str, left_out: &str, parameter: &str| {
        let own: Vec<_> = every.iter().filter(|(name, _)| *name != left_out).copied().collect();
        let begins = [("supply.regulator", 4e5)];
        let measured = Measured::new(rig, rows, command, &own)?.beginning(rig, &begins)?;
        let block = Block::from_name(rig, block)?;
        let timing = timing.at_most(block.longest_step(rig, &measured)?).unwrap();
        let asked: Vec<_> = rig.parameters().find(parameter).into_iter().collect();
        predict(rig, block, &measured, timing, &[0], &asked)
    };
    let off = |rig: &Rig, block: &str, left_out: &str, channel: &str| {
        let found = predicted(rig, block, left_out, "").unwrap().value;
        let read = truth.get(rig, channel).unwrap();
        found.iter().zip(read).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let bottle = "supply_pressure.bottle";
    let outlet = "supply_pressure.regulator";
    assert!(off(&rig, "supply.bottle", "", bottle) < 2e3);
    assert!(off(&rig, "supply.bottle", outlet, bottle) < 2e3, "by its command");
    assert!(off(&rig, "supply.regulator", "", outlet) < 4e3);
    assert!(off(&rig, "chamber", outlet, "muscle_pressure") < 2e3);
    // where the inlet is not measured it stays as it begins: here it falls, and that is missed
    assert!(off(&rig, "supply.regulator", bottle, outlet) > 5e4);
    // a chamber without a gauge begins at the outlet's pressure: here it is empty, and that is missed
    assert!(off(&rig, "supply.bottle", "muscle_pressure", bottle) > 5e4);
    // the slope by the bottle's volume is that of two bottles
    let name = "supply.bottle.volume";
    let found = predicted(&rig, "supply.bottle", outlet, name).unwrap();
    let with = |factor: f64| {
        let mut spec = small_bottle();
        spec.supplies[0].volume *= factor;
        predicted(&compiled(spec), "supply.bottle", outlet, "").unwrap().value
    };
    let (more, less) = (with(1.0 + 1e-6), with(1.0 - 1e-6));
    assert_eq!(found.columns, found.jacobian.len() / rows);
    for k in (50..rows).step_by(50) {
        let slope = (more[k] - less[k]) / 2e-9;
        let exact = found.jacobian[k * found.columns];
        assert!((exact / slope - 1.0).abs() < 1e-3, "{k}: {exact} {slope}");
    }
}

fn fed_through_a_tube(inlet_volume: f64, length: f64) -> RigSpec {
    let mut spec = shoulder();
    spec.lines = vec![LineSpec { inlet_volume, ..tube("", "chamber", length, 0.004) }];
    spec.valves[0].to = "line".into();
    spec
}

#[test]
fn small_volumes_are_stable_at_a_millisecond_and_accurate() {
    let rig = compiled(fed_through_a_tube(0.0, 1.0));
    assert!(rig.stable_step() < 2e-4, "{}", rig.stable_step());
    let u = wave(200, 0.0);
    let coarse = run(&rig, 200, &[("valve_command", &u)], 0.005, 1e-3);
    let fine = run(&rig, 200, &[("valve_command", &u)], 0.005, 2e-6);
    for name in ["line_pressure", "muscle_pressure", "joint_angle"] {
        let (a, b) = (coarse.get(&rig, name).unwrap(), fine.get(&rig, name).unwrap());
        let range =
            b.iter().copied().fold(f64::MIN, f64::max) - b.iter().copied().fold(f64::MAX, f64::min);
        let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-4 * range, "{name}: {worst} of {range}");
    }
}

#[test]
fn two_joints_converge_with_order_four() {
    // smooth: no Coulomb friction, no stop within reach, no muscle that goes slack
    let mut spec = with_struts(two_joints());
    for (joint, link) in spec.joints.iter_mut().zip(&mut spec.arm.as_mut().unwrap().links) {
        (joint.stop_stiffness, joint.stop_damping, link.coulomb) = (0.0, 0.0, 0.0);
    }
    let rig = compiled(spec);
    let (a, b) = (vec![5.6; 26], vec![5.3; 26]);
    let go = |substeps: usize| {
        let timing = Timing { sample_time: 0.02, substeps };
        let initial = Initial::rest(&rig);
        let initial = ["elbow", "wrist"].iter().fold(initial, |i, n| {
            let i = i.with(&rig, &format!("muscle_pressure.{n}"), 2e5).unwrap();
            i.with(&rig, &format!("joint_angle.{n}"), 0.6).unwrap()
        });
        let signals: [(&str, &[f64]); 2] =
            [("valve_command.elbow", &a), ("valve_command.wrist", &b)];
        simulate(&rig, 26, &signals, timing, &initial)
            .unwrap()
            .get(&rig, "joint_angle.wrist")
            .unwrap()
            .to_vec()
    };
    let reference = go(640);
    let error =
        |n: usize| go(n).iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let order = (error(20) / error(40)).log2();
    assert!((3.5..4.5).contains(&order), "order {order}");
}

#[test]
fn stops_and_choking_are_recorded_with_their_times() {
    let rig = compiled(shoulder());
    let u: Vec<f64> = (0..800).map(|k| if k < 400 { 9.0 } else { 2.0 }).collect();
    let out = run(&rig, 800, &[("valve_command", &u)], 0.005, 1e-3);
    let kinds: Vec<&str> = out.events.iter().map(|e| e.kind.name()).collect();
    for kind in [
        "min_stop_left",
        "max_stop_reached",
        "max_stop_left",
        "min_stop_reached",
        "choked",
        "unchoked",
    ] {
        assert!(kinds.contains(&kind), "{kind} in {kinds:?}");
    }
    assert!(out.events.windows(2).all(|w| w[1].time >= w[0].time - 1e-3));
    let angle = out.get(&rig, "joint_angle").unwrap();
    let reached = out.events.iter().find(|e| e.kind.name() == "max_stop_reached").unwrap();
    let row = (reached.time / 0.005) as usize;
    let limit = rig.spec().joints[0].max_angle;
    assert!(angle[row] <= limit && angle[row + 1] >= limit - 0.02);
}

#[test]
fn a_rig_goes_on_from_its_numbers_bit_for_bit() {
    let rig = compiled(two_joints());
    let timing = Timing::new(0.005, 1e-3).unwrap().stable(&rig).unwrap();
    let (a, b) = (wave(120, 0.0), wave(120, 1.0));
    let signals: [(&str, &[f64]); 2] = [("valve_command.elbow", &a), ("valve_command.wrist", &b)];
    let drive = pam_core::simulate::drive::Drive::new(&rig, 120, &signals).unwrap();
    let mut whole = Progress::start(&rig, &Initial::rest(&rig)).unwrap();
    let mut out = Trajectory::new(&rig, 120);
    whole.advance(&rig, timing, &drive.part(0..120), &mut out).unwrap();
    let mut first = Progress::start(&rig, &Initial::rest(&rig)).unwrap();
    let mut parts = Trajectory::new(&rig, 120);
    first.advance(&rig, timing, &drive.part(0..50), &mut parts).unwrap();
    let fresh = Progress::start(&rig, &Initial::rest(&rig)).unwrap();
    let mut again = fresh.restored(&rig, &first.to_vec()).unwrap();
    again.advance(&rig, timing, &drive.part(50..120), &mut parts).unwrap();
    assert_eq!(parts, out);
    assert!(fresh.restored(&rig, &[1.0]).unwrap_err().to_string().contains("state"));
}

#[test]
fn what_does_not_fit_together_is_named() {
    type Change = fn(&mut RigSpec);
    let cases: [(&str, Change); 14] = [
        ("valve.from is missing", |s| s.valves[0].from = String::new()),
        ("valve.to = \"chamber.x\"", |s| s.valves[0].to = "chamber.x".into()),
        ("valve.from = \"ambient\"", |s| s.valves[0].from = "ambient".into()),
        ("valve.from = \"chamber\"", |s| s.valves[0].from = "chamber".into()),
        ("valve.to = \"supply\"", |s| s.valves[0].to = "supply".into()),
        ("line.from is missing", |s| s.lines = vec![tube("", "chamber", 1.0, 0.004)]),
        ("line.from = \"chamber\"", |s| s.lines = vec![tube("chamber", "chamber", 1.0, 0.004)]),
        ("muscle.chamber", |s| s.muscles[0].chamber = "chamber.b".into()),
        ("muscle.joint", |s| s.muscles[0].joint = "joint.b".into()),
        ("transmission", |s| s.joints[0].transmission = None),
        ("[chamber] is there twice", |s| s.chambers.push(s.chambers[0].clone())),
        ("at least one chamber", |s| s.chambers.clear()),
        ("supply.kind", |s| s.supplies[0].kind = "pump".into()),
        ("1 to 4 links", |s| s.arm.as_mut().unwrap().kind = "planar".into()),
    ];
    for (word, change) in cases {
        let mut spec = shoulder();
        change(&mut spec);
        let message = spec.validate().and_then(|()| Rig::new(spec)).unwrap_err().to_string();
        assert!(message.contains(word), "{word}: {message}");
    }
    let message = Rig::new(fed_through_a_tube(0.0, 1e-4)).unwrap_err().to_string();
    assert!(message.contains("line is too small"), "{message}");
    let mut singular = two_joints();
    for link in &mut singular.arm.as_mut().unwrap().links {
        (link.mass, link.inertia, link.payload) = (0.0, 0.0, 0.0);
    }
    assert!(Rig::new(singular).unwrap_err().to_string().contains("mass matrix"));
}

#[test]
fn light_bodies_on_stiff_muscles_are_stable_at_a_millisecond() {
    // No friction, soft stops: only muscles and trapped air hold the arm.
    for inertia in [1e-3, 5e-5] {
        let mut spec = antagonists();
        let arm = spec.arm.as_mut().unwrap();
        (arm.payload, arm.first_moment, arm.viscous, arm.inertia) = (0.0, 0.0, 0.0, inertia);
        (spec.joints[0].stop_stiffness, spec.joints[0].stop_damping) = (10.0, 0.0);
        spec.chambers.iter_mut().for_each(|c| c.initial_pressure = 5e5);
        let rig = compiled(spec);
        let (a, b) = (vec![7.0; 60], vec![6.5; 60]);
        let signals: [(&str, &[f64]); 2] =
            [("valve_command.flexor", &a), ("valve_command.extensor", &b)];
        let coarse = run(&rig, 60, &signals, 0.005, 1e-3);
        let fine = run(&rig, 60, &signals, 0.005, 2e-6);
        let (a, b) =
            (coarse.get(&rig, "joint_angle").unwrap(), fine.get(&rig, "joint_angle").unwrap());
        let most = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 0.2 * most, "{inertia}: {worst} of {most}");
    }
}

#[test]
fn fast_leaks_and_walls_are_stable() {
    let effect = |id: &str, values: &[(&str, f64)]| pam_core::description::EffectSpec {
        id: id.into(),
        form: String::new(),
        at: String::new(),
        parameters: values.iter().map(|(n, v)| ((*n).to_string(), *v)).collect(),
    };
    let mut leaking = gas(&[("", 1e-6, 5e5)], vec![]);
    leaking.effects = vec![effect("leak_muscle", &[("conductance", 1e-7), ("laminar_share", 0.5)])];
    let mut warm = gas(&[("", 1e-6, 5e5)], vec![orifice("chamber", "ambient", 1e-9)]);
    warm.effects = vec![effect(
        "heat_transfer",
        &[("heat_transfer_coefficient", 1e3), ("initial_temperature_rise", 0.0), ("share", 1.0)],
    )];
    for spec in [leaking, warm] {
        let rig = compiled(spec);
        assert!(rig.stable_step() < 1e-2, "{}", rig.stable_step());
        let (coarse, fine) = (run(&rig, 50, &[], 1e-3, 1e-3), run(&rig, 50, &[], 1e-3, 1e-6));
        for (a, b) in coarse
            .get(&rig, "muscle_pressure")
            .unwrap()
            .iter()
            .zip(fine.get(&rig, "muscle_pressure").unwrap())
        {
            assert!((a - b).abs() < 2e3, "{a} {b}");
        }
    }
}

#[test]
fn air_that_goes_back_through_a_valve_empties_its_chamber() {
    let mut spec = gas(&[("", 1e-3, 6e5)], vec![]);
    spec.chambers[0].alpha_in = 1.4;
    spec.supplies = vec![SupplySpec {
        name: String::new(),
        kind: "constant".into(),
        volume: 0.0,
        initial_pressure: 0.0,
        time_constant: 0.0,
        droop: 0.0,
        dead_time: 0.0,
        rise_limit: FASTEST,
        fall_limit: FASTEST,
        dead_band: 0.0,
        pressure_zero: 0.0,
        inlet: String::new(),
    }];
    let mut through_line = spec.clone();
    through_line.lines = vec![orifice("supply", "chamber", 8.4e-6)];
    spec.valves = shoulder().valves;
    let (valve, line) = (compiled(spec), compiled(through_line));
    let open = vec![10.0; 40];
    let (a, b) =
        (run(&valve, 40, &[("valve_command", &open)], 0.01, 1e-3), run(&line, 40, &[], 0.01, 1e-3));
    assert_eq!(a.get(&valve, "muscle_pressure"), b.get(&line, "muscle_pressure"));
    assert!(last(&valve, &a, "mass_supplied") < 0.0 && imbalance(&valve, &a) < 1e-12);
}

/// Every channel of a run as a measured signal, with its slopes.
fn slopes(run: &Trajectory, rig: &Rig, name: &str, dt: f64) -> Vec<f64> {
    let values = run.get(rig, name).unwrap();
    let end = values.len() - 1;
    let at = |k: usize| (k + 1).min(end);
    (0..=end).map(|k| (values[at(k)] - values[k.saturating_sub(1)]) / (2.0 * dt)).collect()
}

#[test]
fn the_inlet_of_a_line_is_a_block_that_a_wrong_valve_shows_in() {
    let rig = compiled(fed_through_a_tube(5e-6, 2.0));
    let (rows, dt) = (400, 0.005);
    let command = wave(rows, 0.0);
    let timing = Timing::new(dt, 0.001).unwrap().stable(&rig).unwrap();
    let start = Initial::rest(&rig);
    let truth = simulate(&rig, rows, &[("valve_command", &command)], timing, &start).unwrap();
    let names = ["supply_pressure", "line_pressure", "muscle_pressure", "joint_angle"];
    let known: Vec<_> = names.iter().filter(|name| truth.get(&rig, name).is_some()).collect();
    let slopes: Vec<_> = known.iter().map(|name| slopes(&truth, &rig, name, dt)).collect();
    let signals: Vec<_> = (known.iter().zip(&slopes))
        .map(|(name, slope)| (**name, Signal { value: truth.get(&rig, name).unwrap(), slope }))
        .collect();
    let missed = |rig: &Rig| {
        let measured = Measured::new(rig, rows, &[("valve_command", &command)], &signals).unwrap();
        let block = Block::from_name(rig, "line").unwrap();
        let timing = timing.at_most(block.longest_step(rig, &measured).unwrap()).unwrap();
        let found = predict(rig, block, &measured, timing, &[0], &[]).unwrap().value;
        let read = truth.get(rig, "line_pressure").unwrap();
        found.iter().zip(read).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let mut narrower = fed_through_a_tube(5e-6, 2.0);
    narrower.valves[0].discharge_area_max *= 0.7;
    let (own, other) = (missed(&rig), missed(&compiled(narrower)));
    assert!(own < 2e3 && other > 10.0 * own, "{own} Pa, {other} Pa");
    assert!(Block::from_name(&rig, "line.other").is_err());
}

/// A gauge that reads too much moves no gas; where its zero is known, what it drives is as it was.
#[test]
fn gauges_of_supplies_and_lines_have_zeros() {
    let true_rig = compiled(fed_through_a_tube(5e-6, 2.0));
    let mut spec = fed_through_a_tube(5e-6, 2.0);
    (spec.supplies[0].pressure_zero, spec.lines[0].pressure_zero) = (1500.0, -700.0);
    let off = compiled(spec);
    let (rows, dt) = (400, 0.005);
    let command = wave(rows, 0.0);
    let commands: [(&str, &[f64]); 1] = [("valve_command", &command)];
    let [truth, read] = [&true_rig, &off].map(|rig| run(rig, rows, &commands, dt, 0.001));
    for ((name, _), (a, b)) in
        true_rig.names().channels.iter().zip(truth.channels.iter().zip(&read.channels))
    {
        let zero = match name.as_str() {
            "supply_pressure" => 1500.0,
            "line_pressure" => -700.0,
            _ => 0.0,
        };
        assert!(a.iter().zip(b).all(|(a, b)| (b - a - zero).abs() <= 1e-9 * a.abs()), "{name}");
    }
    let predicted = |name: &str, rig: &Rig, of: &Trajectory| {
        let known = ["supply_pressure", "line_pressure", "muscle_pressure", "joint_angle"];
        let known = known.iter().filter(|name| of.get(rig, name).is_some());
        let signals: Vec<_> = known.map(|n| (*n, slopes(of, rig, n, dt))).collect();
        let signals: Vec<_> = (signals.iter())
            .map(|(n, slope)| (*n, Signal { value: of.get(rig, n).unwrap(), slope }))
            .collect();
        let measured = Measured::new(rig, rows, &commands, &signals).unwrap();
        let block = Block::from_name(rig, name).unwrap();
        let timing = Timing::new(dt, 0.001).unwrap();
        let timing = timing.at_most(block.longest_step(rig, &measured).unwrap()).unwrap();
        predict(rig, block, &measured, timing, &[0], &[]).unwrap().value
    };
    for (block, zero) in [("supply", 1500.0), ("line", -700.0), ("chamber", 0.0)] {
        let [was, corrected, fooled] = [(&true_rig, &truth), (&off, &read), (&true_rig, &read)]
            .map(|(rig, of)| predicted(block, rig, of));
        let apart = |other: &[f64]| {
            was.iter().zip(other).map(|(a, b)| (b - a - zero).abs()).fold(0.0, f64::max)
        };
        assert!(apart(&corrected) < 1e-3, "{block}: {}", apart(&corrected));
        assert!(apart(&fooled) > 1.0, "{block}: {}", apart(&fooled));
    }
}

#[test]
fn a_regulator_without_a_gauge_begins_where_it_is_told() {
    let mut spec = gas(&[("", 1e-4, 0.0)], vec![tube("supply", "chamber", 2.0, 0.004)]);
    spec.supplies = vec![regulator(0.0)];
    let rig = compiled(spec);
    let (rows, dt) = (200, 0.005);
    let (command, still, flat) = (vec![3e5; rows], vec![0.0; rows], vec![0.0; rows]);
    let timing = Timing::new(dt, 0.001).unwrap().stable(&rig).unwrap();
    let begun = |outlets: &[(&str, f64)]| {
        let signal = Signal { value: &still, slope: &flat };
        let measured = Measured::new(
            &rig,
            rows,
            &[("supply_command", &command)],
            &[("muscle_pressure", signal)],
        )
        .unwrap()
        .beginning(&rig, outlets)?;
        let block = Block::from_name(&rig, "chamber").unwrap();
        let timing = timing.at_most(block.longest_step(&rig, &measured)?).unwrap();
        predict(&rig, block, &measured, timing, &[0], &[]).map(|found| found.value)
    };
    let (fed, full) = (begun(&[]).unwrap(), begun(&[("supply", 3e5)]).unwrap());
    let at_fed = begun(&[("supply", 0.0)]).unwrap();
    assert_eq!(fed, at_fed, "where nothing is told, it begins at what it feeds");
    assert!(full[20] - fed[20] > 5e4, "{} {}", full[20], fed[20]);
    assert!((full[rows - 1] - fed[rows - 1]).abs() < 200.0, "both settle");
    assert!(begun(&[("tank", 1e5)]).is_err());
    assert!(begun(&[("supply", -2e5)]).is_err());
    assert!(begun(&[("supply", f64::NAN)]).is_err());
}

#[test]
fn a_regulator_was_set_to_where_it_begins_until_its_first_command_arrives() {
    let mut spec = gas(&[("", 1e-4, 0.0)], vec![tube("supply", "chamber", 2.0, 0.004)]);
    spec.supplies = vec![SupplySpec { dead_time: 0.1, initial_pressure: 0.0, ..regulator(0.0) }];
    let rig = compiled(spec);
    let (rows, dt) = (60, 0.005);
    let (command, still) = (vec![3e5; rows], vec![0.0; rows]);
    let signals = [("muscle_pressure", Signal { value: &still, slope: &still })];
    let commands: [(&str, &[f64]); 1] = [("supply_command", &command)];
    let predicted = |outlets: &[(&str, f64)]| {
        let measured = Measured::new(&rig, rows, &commands, &signals).unwrap();
        let measured = measured.beginning(&rig, outlets).unwrap();
        let block = Block::from_name(&rig, "chamber").unwrap();
        let longest = block.longest_step(&rig, &measured).unwrap();
        let timing = Timing::new(dt, 0.001).unwrap().at_most(longest).unwrap();
        predict(&rig, block, &measured, timing, &[0], &[]).unwrap().value
    };
    let (told, not_told) = (predicted(&[("supply", 0.0)]), predicted(&[]));
    assert!(told[20].abs() < 1.0 && not_told[20] > 1e4, "{} {}", told[20], not_told[20]);
    let truth = run(&rig, rows, &commands, dt, 0.001);
    let missed = told.iter().zip(truth.get(&rig, "muscle_pressure").unwrap());
    assert!(missed.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 50.0);
}

/// What a meter reads is what the chamber gains, and what leaks out behind it.
#[test]
fn a_meter_reads_what_flows_into_a_chamber() {
    let rig = compiled(fed_through_a_tube(5e-6, 2.0));
    let (rows, dt) = (400, 0.005);
    let command: Vec<f64> = (0..rows).map(|k| 5.0 + 2.0 * (0.05 * k as f64).sin()).collect();
    let commands: [(&str, &[f64]); 1] = [("valve_command", &command)];
    let truth = run(&rig, rows, &commands, dt, 0.0005);
    let names = ["supply_pressure", "line_pressure", "muscle_pressure", "joint_angle"];
    let known: Vec<_> = names.iter().filter(|name| truth.get(&rig, name).is_some()).collect();
    let slopes: Vec<_> = known.iter().map(|name| slopes(&truth, &rig, name, dt)).collect();
    let signals: Vec<_> = (known.iter().zip(&slopes))
        .map(|(name, slope)| (**name, Signal { value: truth.get(&rig, name).unwrap(), slope }))
        .collect();
    let measured = Measured::new(&rig, rows, &commands, &signals).unwrap();
    let block = Block::from_name(&rig, "flow").unwrap();
    let timing = Timing::new(dt, 0.001).unwrap();
    let width = rig.parameters().find("line.diameter").unwrap();
    let found = predict(&rig, block, &measured, timing, &[0], &[width]).unwrap();
    let mass = truth.get(&rig, "air_mass").unwrap();
    let gained: Vec<f64> = mass.windows(3).map(|m| (m[2] - m[0]) / (2.0 * dt)).collect();
    let most = gained.iter().fold(0.0_f64, |most, flow| most.max(flow.abs()));
    for (k, flow) in gained.iter().enumerate().skip(5) {
        let read = found.value[k + 1];
        assert!((read - flow).abs() < 0.02 * most, "{k}: {read} {flow}");
        // a wider line lets more through, and at rest the meter may read anything
        assert!(found.jacobian[2 * (k + 1)] * read >= 0.0);
        assert!((found.jacobian[2 * (k + 1) + 1] - 1.0).abs() < 1e-15);
    }
}

/// A gas between driven pressures is as fast as its openings alone: half as fast as beside pressures
/// that answer, and a step of that length still ends where shorter ones do.
#[test]
fn a_gas_beside_driven_pressures_takes_longer_steps() {
    let mut spec = gas(&[("", 1e-4, 0.0)], vec![orifice("supply", "chamber", 2e-6)]);
    spec.supplies = shoulder().supplies;
    let rig = compiled(spec);
    let (rows, dt) = (400, 0.001);
    let (full, still) = (vec![6e5; rows], vec![0.0; rows]);
    let begun: Vec<f64> = (0..rows).map(|k| if k == 0 { 5.9e5 } else { 6e5 }).collect();
    let signals = [
        ("supply_pressure", Signal { value: &full, slope: &still }),
        ("muscle_pressure", Signal { value: &begun, slope: &still }),
    ];
    let measured = Measured::new(&rig, rows, &[], &signals).unwrap();
    let block = Block::from_name(&rig, "chamber").unwrap();
    let longest = block.longest_step(&rig, &measured).unwrap();
    assert!((longest / rig.gas_step() - 2.0).abs() < 0.3, "{longest} {}", rig.gas_step());
    let end = |step: f64| {
        let timing = Timing::new(dt, dt).unwrap().at_most(step).unwrap();
        let found = predict(&rig, block, &measured, timing, &[0], &[]).unwrap().value;
        assert!(found.windows(2).all(|pair| pair[1] >= pair[0] - 1e-6), "it oscillates");
        found[rows - 1]
    };
    assert!((end(longest) - end(0.1 * longest)).abs() < 1.0);
}
