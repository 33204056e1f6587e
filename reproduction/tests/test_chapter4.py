"""Chapter 4 beside ours: small runs of its experiments, and how its statements are judged."""

from dataclasses import replace

import numpy as np
import pytest

from pamrs.control import PID, closed_loop
from pamrs.control.metrics import evaluate
from pamrs.errors import ParameterError
from reproduction import chapter4, lift
from reproduction.chapter4_statements import SERIES, statements
from reproduction.elbow import PSI
from reproduction.lift import GAINS, PAYLOADS, VARIANTS, Lifts
from reproduction.tests.pages import facts
from reproduction.two_branches import two_branches
from tests.tables import rows_of

TIME = np.arange(2501) * 0.01
PATH = lift.trajectory()


def made(late=0.3, swing=0.0, rest=0.0, above=0.0):
    """Four payloads that follow the reference late, swing, settle ``rest`` deg off and pass the
    hold by ``above`` deg.
    """
    wanted = np.asarray(PATH(TIME).angle)
    angle = np.asarray(PATH(np.maximum(TIME - late, 0.0)).angle)
    angle = angle + np.radians(swing) * np.sin(8.0 * TIME) + np.radians(rest) * (TIME > 20.0)
    angle = angle + np.radians(above) * np.exp(-(((TIME - 11.0) / 0.5) ** 2))
    angle = np.tile(angle, (4, 1))
    rate = np.gradient(angle, TIME, axis=1)
    metrics = evaluate(TIME, wanted, angle, rate=rate, parts=PATH.phases)
    return Lifts(TIME, wanted, angle, rate, np.zeros_like(angle), metrics)


def verdicts(**changed):
    """Verdict of every statement for runs that all lag by 0.3 s, but for some."""
    runs = dict.fromkeys(GAINS, made()) | changed
    return {row.fact: row.verdict for row in statements("group", runs)}


def test_overshoot_swing_and_delay_are_read_off_the_angle():
    run = made(late=0.5, above=7.0)
    np.testing.assert_allclose(run.overshoot, 7.0, atol=0.01)
    np.testing.assert_allclose(run.swing, 0.0, atol=0.01)
    np.testing.assert_allclose(run.delay, 0.5 + 1.0 / 13.0, atol=0.011)
    np.testing.assert_allclose(made(swing=3.0).swing, 6.0, rtol=0.01)
    np.testing.assert_allclose(made(rest=-4.0).undershoot, 4.0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "good", "bad", "fact"),
    rows_of(__file__, "a_statement_changes_sides_with_what_it_says"),
)
def test_a_statement_changes_sides_with_what_it_says(name, good, bad, fact):
    plain = {"PID": made(late=0.3, swing=1.0)} if "omega" in fact else {}
    assert verdicts(**plain, **{name: made(**good)})[fact] == "agree"
    assert verdicts(**plain, **{name: made(**bad)})[fact] == "differs"


def test_best_gain_of_the_series_is_the_one_with_the_least_error():
    fact = "kM with the smallest RMS error, 23 kg"
    for km, name in SERIES.items():
        runs = {other: made(late=0.6) for other in SERIES.values()} | {name: made(late=0.2)}
        assert (verdicts(**runs)[fact] == "agree") == (km == 0.5)


def test_a_lift_of_a_batch_is_the_one_alone():
    gains = {"PID": GAINS["PID"], "FF": GAINS["FF"]}
    names, payloads = ["as printed", "muscle damping 3000 N s/m"], PAYLOADS[:2]
    together = lift.lifts(names, gains, payloads=payloads)
    assert list(together) == names
    alone = lift.lifts([names[1]], {"PID": GAINS["PID"]}, payloads=payloads[1:])[names[1]]["PID"]
    np.testing.assert_array_equal(together[names[1]]["PID"].angle[1], alone.angle[0])
    assert not np.array_equal(together[names[0]]["PID"].angle[1], alone.angle[0])
    # and the one of a closed loop that knows of no batch
    rig = lift.plant(VARIANTS[names[1]], payloads[1])
    start = {"joint_angle": alone.angle[0, 0], "muscle_pressure": alone.pressure[0, 0]}
    controller = PID(1.4, 2.5, period=lift.PERIOD, anti_windup="none")
    single = closed_loop(rig, controller, PATH, sample_time=lift.PERIOD, step=1e-3, initial=start)
    np.testing.assert_allclose(alone.angle[0], single.angle[::2], atol=1e-9)


def test_a_plant_hides_its_effects_and_shares_its_valve():
    variant = replace(VARIANTS["muscle damping 3000 N s/m"], known=VARIANTS["valve 4.2 mm2"].known)
    rig, model = lift.plant(variant, 20.0), lift.assumed(variant)
    assert [effect["id"] for effect in rig.effects] == ["muscle_rate_damping"]
    assert model.effects == []
    for one in (rig, model):
        assert one.parameter("valve.discharge_area_max").value == pytest.approx(4.2e-6)
    assert rig.parameter("arm.inertia").value != model.parameter("arm.inertia").value
    rubbing = VARIANTS["as printed, and hysteresis (2.36)"]
    assert lift.plant(rubbing, 20.0).model["muscle"]["friction_coefficient"] == 0.16
    assert lift.assumed(rubbing).model["muscle"]["friction_coefficient"] == 0.0
    smooth = VARIANTS["smooth muscle"]
    assert (model.muscle.model, lift.assumed(smooth).muscle.model) == ("elbow_linear", "robinson")
    fed = lift.plant(VARIANTS["regulated supply, dead band 50 kPa"], 20.0)
    assert fed.model["supply"]["kind"] == "regulator"
    assert fed.model["supply"]["initial_pressure"] == model.model["supply"]["initial_pressure"]
    words = r"names has 'no such plant'; the plants are: as printed"
    with pytest.raises(ParameterError, match=words):
        lift.lifts(["no such plant"])


def test_the_perturbed_plant_is_off_by_what_it_says():
    rig = lift.assumed(VARIANTS[chapter4.SMOOTH])
    plant = lift.perturbed(rig, 7)
    assert lift.perturbed(rig, 7).model == plant.model != lift.perturbed(rig, 8).model
    names = ("viscous", "coulomb", "inertia", "payload")
    viscous, coulomb, inertia, payload = (
        plant.parameter(f"arm.{n}").value / rig.parameter(f"arm.{n}").value for n in names
    )
    assert viscous == pytest.approx(coulomb)
    assert payload == 1.0
    # at rest length the pressure's part of the force goes with the cross-section
    pull = [float(r.muscle.force(8e5, 0.0) - r.muscle.force(0.0, 0.0)) for r in (rig, plant)]
    size = [r.parameter("muscle.rest_diameter").value for r in (rig, plant)]
    force = (size[1] / size[0]) ** 2
    assert pull[1] / pull[0] == pytest.approx(force, rel=0.02)
    assert all(0.025 <= abs(factor - 1.0) <= 0.05 for factor in (viscous, inertia, force))


@pytest.mark.slow
def test_every_trial_changes_what_the_arm_does():
    """An effect that a rig has no part for would be a trial of nothing."""
    gains = {"FF+fuzzy": GAINS["FF+fuzzy"]}
    down = "as printed, (4.4) both ways in the feedforward"  # only where the muscle lengthens
    names = [name for name in VARIANTS if name != down]
    assert "as printed" in names
    found = lift.lifts(names, gains, payloads=PAYLOADS[1:2], duration=6.5)
    plain = found.pop("as printed")["FF+fuzzy"].angle
    for name, runs in found.items():
        assert np.abs(runs["FF+fuzzy"].angle - plain).max() > 1e-4, name
    found = lift.lifts(["as printed", down], gains, payloads=PAYLOADS[1:2], duration=16.5)
    one, other = (runs["FF+fuzzy"].angle[0] for runs in found.values())
    until = TIME[: one.size] <= 15.0
    np.testing.assert_array_equal(one[until], other[until])
    assert np.abs(one - other).max() > 1e-4


def test_page_has_every_plant():
    stored = facts("chapter4")
    assert {row["group"] for row in stored} == set(chapter4.say.groups.values())
    tried = [row for row in stored if row["group"] == chapter4.say.groups["effects"]]
    own = [f"{name}, gains of its own maps" for name in (chapter4.PRINTED, chapter4.RUBBING)]
    assert [row["fact"] for row in tried] == [*VARIANTS, *own]
    # each statement counts once: the printed plant's, of which there is another reading
    counted = {row["fact"] for row in stored if not row["apart"]}
    assert len(counted) == sum(not row["apart"] for row in stored)
    for name, apart in (("printed", False), ("rubbing", True), ("effects", True), ("unit", True)):
        rows = [row for row in stored if row["group"] == chapter4.say.groups[name]]
        assert {bool(row["apart"]) for row in rows} == {apart}
    printed = [row for row in stored if row["group"] == chapter4.say.groups["printed"]]
    agree = {row["fact"] for row in printed if row["verdict"] == "agree"}
    score = next(row for row in tried if row["fact"] == own[0])
    assert int(float(score["ours"])) == len(agree & set(verdicts()))


def test_the_printed_muscle_lets_go_at_its_free_contraction():
    """3.2.2: 37 % at 150 psi; and (4.7) is above (4.4), since it resists being stretched."""
    muscle = two_branches()
    told = {name: value for name, value, _ in chapter4.say.chosen()}["E_R of (4.5), (4.6)"]
    assert told == f"{muscle.parameters['bladder_modulus'] / 1e6:.2f} MPa"
    psi = 150.0 * PSI
    assert float(muscle.force(psi, 0.37, -1.0)) == pytest.approx(0.0, abs=1e-6)
    up, down = (muscle.force(psi, [0.05, 0.2, 0.35], way) for way in (-1.0, 1.0))
    assert np.all(down > up + 1.0)
    # (4.7): FL and FT are in proportion to E_R, and less by a fifth
    stiff = muscle.replace(bladder_modulus=2.0 * muscle.parameters["bladder_modulus"])
    once, twice = (float(one.force(0.0, 0.2, 1.0)) for one in (muscle, stiff))
    assert twice == pytest.approx(2.0 * once, rel=1e-12)
    assert once == pytest.approx(0.8 * float(muscle.force(0.0, 0.2, -1.0)), rel=1e-12)


def test_an_error_too_small_for_a_figure_decides_nothing():
    fact = "fuzzy: error at the end of the hold, least"
    for late, verdict in ((0.3, "differs"), (5.05, "cannot tell"), (5.5, "agree")):
        assert verdicts(fuzzy=made(late=late))[fact] == verdict


def test_an_optimum_at_the_end_of_a_line_decides_nothing():
    inside, end = [0.3, 0.6, 0.4], [0.3, chapter4._RATE[-1], 0.4]
    assert chapter4._at_an_end(inside) == ""
    assert "end of the line" in chapter4._at_an_end(end)
    assert "end of the line" in chapter4._at_an_end([chapter4._RATE[0], 0.3])
