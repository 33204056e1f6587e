"""Diagnosis of rigs with named blocks: each tank, chamber and joint its own block, and a joint
driven by pressures alone.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import pytest

import pamrs
from pamrs.diagnosis import _scaled_for_unknown_geometry, _unknown_parameters
from pamrs.diagnosis.__init__ import _UNKNOWN_GEOMETRY_FACTOR
from pamrs.diagnosis.evidence import BlockGroup
from pamrs.diagnosis.next_experiment import measurable
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from tests.diagnosis.asked import blocks_of, diagnosed
from tests.diagnosis.noisy import without
from tests.diagnosis.stands import antagonists
from tests.diagnosis.terms import by_text, of_texts
from tests.tables import rows_of

SIDES = ("flexor", "extensor")


def pressures_only(rig: pamrs.Rig, role: str, seed: int) -> Recording:
    """The joint without its supply's gauge and its commands."""
    one = antagonists(rig, role, seed)
    return without(one, "supply_pressure", *(f"valve_command.{side}" for side in SIDES))


@pytest.fixture(scope="module")
def rig() -> pamrs.Rig:
    return pamrs.rigs.antagonistic_joint()


@pytest.fixture(scope="module")
def bare(rig: pamrs.Rig) -> pamrs.Rig:
    """The same joint without tank and valves."""
    tables = rig.to_toml_text().split("\n[")
    kept = [tables[0], *("[" + t for t in tables[1:] if not t.startswith(("supply]", "valve.")))]
    return parse_rig("\n".join(kept))


def test_every_block_has_its_own_drives_and_parameters(rig: pamrs.Rig) -> None:
    blocks = blocks_of(rig, measurable(rig))
    assert list(blocks) == ["supply", "chamber.flexor", "chamber.extensor", "arm.elbow"]
    assert [b.kind for b in blocks.values()] == ["supply", "chamber", "chamber", "arm"]
    flexor = blocks["chamber.flexor"]
    assert flexor.channel == "muscle_pressure.flexor"
    assert flexor.drives == ("supply_pressure", "valve_command.flexor", "joint_angle.elbow")
    own = (
        "valve.flexor.null_voltage",
        "chamber.flexor.dead_volume",
        "sensors.flexor.pressure_zero",
    )
    assert set(own) <= flexor.parameters
    assert not any("extensor" in name for name in flexor.parameters)
    assert {"muscle_pressure.flexor", "valve_command.extensor"} <= set(blocks["supply"].drives)
    shared = {f"muscle.{side}.modulus_scale" for side in SIDES}
    assert shared | {"sensors.elbow.angle_zero"} <= blocks["arm.elbow"].parameters


@pytest.mark.parametrize(
    ("name", "channels", "expected"),
    rows_of(__file__, "the_channels_decide_what_can_be_told_apart"),
)
def test_the_channels_decide_what_can_be_told_apart(
    name: str, channels: tuple[str, ...], expected: list[str]
) -> None:
    assert list(blocks_of(pamrs.rigs.named(name), channels)) == expected


@pytest.mark.slow
def test_a_nominal_antagonist_has_nothing_missing(rig: pamrs.Rig) -> None:
    found = diagnosed(rig, partial(antagonists, rig, rows=1000))
    assert found.verdict in ("none", "parameters")
    groups = [["supply", "chamber.flexor", "chamber.extensor"], ["arm.elbow"]]
    assert [group["blocks"] for group in found.blocks] == groups
    assert set(found.residuals) == {block for group in groups for block in group}
    assert "chamber.flexor.dead_volume" in found.parameters


@pytest.mark.slow
def test_pressures_alone_tell_the_friction_of_the_muscles(rig: pamrs.Rig, bare: pamrs.Rig) -> None:
    assert diagnosed(bare, partial(pressures_only, rig)).verdict in ("none", "parameters")
    found = diagnosed(bare, partial(pressures_only, rig.with_effect("muscle_hysteresis")))
    assert found.where["block"] == "arm.elbow"
    assert found.verdict == "effects"
    assert found.effects[0]["id"] == "muscle_hysteresis"


def test_no_confident_name_beside_unknown_geometry(bare: pamrs.Rig) -> None:
    text = bare.to_toml_text()
    line = next(x for x in text.splitlines() if x.startswith("radius"))
    unknown = line.split(", tol")[0].rstrip(" }") + ", unknown = true }"
    assert _unknown_parameters(bare) == []
    assert _unknown_parameters(parse_rig(text.replace(line, unknown, 1))) == [
        "transmission.flexor.radius"
    ]
    arm = blocks_of(bare, measurable(bare))["arm.elbow"]
    chances = of_texts({"muscle_hysteresis": 0.9, "muscle_creep": 0.05, "unlisted": 0.05})
    group = BlockGroup([arm], {}, {}, [], chances, arm, {}, [arm])
    capped = by_text(_scaled_for_unknown_geometry(group, _UNKNOWN_GEOMETRY_FACTOR).probabilities)
    assert capped["muscle_hysteresis"] < 0.5
    assert sum(capped.values()) == pytest.approx(1.0)
    assert capped["unlisted"] > 0.5


def test_swapped_muscles_are_seen(rig: pamrs.Rig, bare: pamrs.Rig) -> None:
    right = pressures_only(rig, "fit", 1)
    one, two = (f"muscle_pressure.{side}" for side in SIDES)
    swapped = right.channels | {one: right.channels[two], two: right.channels[one]}
    with pytest.raises(pamrs.DiagnosisError, match=r"in each other's place"):
        diagnosed(bare, lambda *_: replace(right, channels=swapped), ("fit",))


def test_a_missing_named_channel_is_named(rig: pamrs.Rig) -> None:
    lacking = without(antagonists(rig, "fit", 1), "joint_angle.elbow", "valve_command.extensor")
    with pytest.raises(pamrs.DiagnosisError, match=r"no channel valve_command\.extensor"):
        diagnosed(rig, lambda *_: lacking, ("fit",))
