"""Diagnosis of rigs with named blocks: each tank, chamber and joint its own block, and a joint
driven by pressures alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import _capped, _unsettled
from pamrs.diagnosis.__init__ import _UNKNOWN_GEOMETRY_PROBABILITY
from pamrs.diagnosis.evidence import BlockGroup
from pamrs.diagnosis.prepare import available_blocks
from pamrs.recordings import Recording
from tests.diagnosis.noisy import whole
from tests.diagnosis.terms import by_text, of_texts
from tests.tables import rows_of

ROOT = Path(__file__).parents[2]
RIGS = ROOT / "python" / "pamrs" / "rigs"
NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}


def recorded(
    rig: pamrs.Rig, seed: int, role: str, *, pressures_only: bool = False, n: int = 1600
) -> Recording:
    """The antagonistic joint, both valves moved, 8 s at 200 Hz."""
    rng = np.random.default_rng(seed)
    time, phase = 0.005 * np.arange(n), rng.uniform(0.0, 6.0, 3)
    flexor = 5 + 0.5 * np.sin(1.3 * time + phase[0]) + 0.35 * np.sin(3.1 * time + phase[1])
    extensor = 5 - 0.5 * np.sin(1.3 * time + phase[0] + 0.4) - 0.3 * np.sin(2.7 * time + phase[2])
    run = pamrs.simulate(rig, {"flexor": flexor, "extensor": extensor}, sample_time=0.005)
    kinds = ("muscle_pressure", "joint_angle") if pressures_only else (*NOISE, "valve_command")
    names = [name for name in run if name.partition(".")[0] in kinds]
    channels = {
        name: run[name] + rng.normal(0.0, 1.0, n) * NOISE.get(name.partition(".")[0], 0.0)
        for name in names
    }
    return whole(f"{role}_{seed}", role, 0.005, channels)


def case(
    truth: pamrs.Rig, nominal: pamrs.Rig, *, pressures_only: bool = False, n: int = 1600
) -> pamrs.Case:
    """Two recordings to fit and one held out."""
    recordings = [
        recorded(truth, seed, role, pressures_only=pressures_only, n=n)
        for seed, role in ((1, "fit"), (2, "fit"), (3, "held_out"))
    ]
    return pamrs.Case("antagonist", nominal, recordings, ROOT)


@pytest.fixture(scope="module")
def rig() -> pamrs.Rig:
    return pamrs.load_rig(RIGS / "antagonistic_joint.toml")


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> pamrs.Rig:
    """The same joint without tank and valves."""
    tables = (RIGS / "antagonistic_joint.toml").read_text(encoding="utf-8").split("\n[")
    kept = [tables[0], *("[" + t for t in tables[1:] if not t.startswith(("supply]", "valve.")))]
    file = tmp_path_factory.mktemp("bare") / "rig.toml"
    file.write_text("\n".join(kept), encoding="utf-8")
    return pamrs.load_rig(file)


def test_every_block_has_its_own_drives_and_parameters(rig: pamrs.Rig) -> None:
    blocks = {
        b.name: b for b in available_blocks(rig, tuple(recorded(rig, 1, "fit", n=40).channels))
    }
    assert list(blocks) == ["supply", "chamber.flexor", "chamber.extensor", "arm.elbow"]
    assert [b.kind for b in blocks.values()] == ["supply", "chamber", "chamber", "arm"]
    flexor = blocks["chamber.flexor"]
    assert flexor.channel == "muscle_pressure.flexor"
    assert flexor.drives == ("supply_pressure", "valve_command.flexor", "joint_angle.elbow")
    assert {
        "valve.flexor.null_voltage",
        "chamber.flexor.dead_volume",
        "sensors.flexor.pressure_zero",
    } <= flexor.parameters
    assert not any("extensor" in name for name in flexor.parameters)
    assert {"muscle_pressure.flexor", "valve_command.extensor"} <= set(blocks["supply"].drives)
    assert {
        "muscle.flexor.modulus_scale",
        "muscle.extensor.modulus_scale",
        "sensors.elbow.angle_zero",
    } <= blocks["arm.elbow"].parameters


@pytest.mark.parametrize(
    ("name", "channels", "expected"),
    rows_of(__file__, "the_channels_decide_what_can_be_told_apart"),
)
def test_the_channels_decide_what_can_be_told_apart(
    name: str, channels: tuple[str, ...], expected: list[str]
) -> None:
    assert [
        b.name for b in available_blocks(pamrs.load_rig(RIGS / f"{name}.toml"), channels)
    ] == expected


@pytest.mark.slow
def test_a_nominal_antagonist_has_nothing_missing(rig: pamrs.Rig) -> None:
    found = pamrs.diagnose(case(rig, rig, n=1000))
    assert found.verdict in ("none", "parameters")
    assert set(found.residuals) == {"supply", "chamber.flexor", "chamber.extensor", "arm.elbow"}
    assert [b["blocks"] for b in found.blocks] == [
        ["supply", "chamber.flexor", "chamber.extensor"],
        ["arm.elbow"],
    ]
    assert "chamber.flexor.dead_volume" in found.parameters


@pytest.mark.slow
def test_pressures_alone_tell_the_friction_of_the_muscles(rig: pamrs.Rig, bare: pamrs.Rig) -> None:
    assert pamrs.diagnose(case(rig, bare, pressures_only=True)).verdict in ("none", "parameters")
    found = pamrs.diagnose(case(rig.with_effect("muscle_hysteresis"), bare, pressures_only=True))
    assert found.where["block"] == "arm.elbow"
    assert found.verdict == "effects"
    assert found.effects[0]["id"] == "muscle_hysteresis"


def test_no_confident_name_beside_unknown_geometry(
    rig: pamrs.Rig, bare: pamrs.Rig, tmp_path: Path
) -> None:
    text = bare.to_toml_text()
    line = next(x for x in text.splitlines() if x.startswith("radius"))
    (tmp_path / "rig.toml").write_text(
        text.replace(line, line.split(", tol")[0].rstrip(" }") + ", unknown = true }", 1),
        encoding="utf-8",
    )
    assert _unsettled(bare) == []
    assert _unsettled(pamrs.load_rig(tmp_path / "rig.toml")) == ["transmission.flexor.radius"]
    arm = available_blocks(
        bare, tuple(recorded(rig, 1, "fit", pressures_only=True, n=40).channels)
    )[0]
    group = BlockGroup(
        [arm],
        {},
        {},
        [],
        of_texts({"muscle_hysteresis": 0.9, "muscle_creep": 0.05, "unlisted": 0.05}),
        arm,
        {},
        [arm],
    )
    capped = by_text(_capped(group, _UNKNOWN_GEOMETRY_PROBABILITY).probabilities)
    assert capped["muscle_hysteresis"] < 0.5
    assert sum(capped.values()) == pytest.approx(1.0)
    assert capped["unlisted"] > 0.5


def test_swapped_muscles_are_seen(rig: pamrs.Rig, bare: pamrs.Rig) -> None:
    recording = recorded(rig, 1, "fit", pressures_only=True)
    one, two = "muscle_pressure.flexor", "muscle_pressure.extensor"
    recording.channels[one], recording.channels[two] = (
        recording.channels[two],
        recording.channels[one],
    )
    with pytest.raises(pamrs.DiagnosisError, match=r"in each other's place"):
        pamrs.diagnose(pamrs.Case("swapped", bare, [recording], ROOT))


def test_a_missing_named_channel_is_named(rig: pamrs.Rig) -> None:
    recording = recorded(rig, 1, "fit")
    for name in ("joint_angle.elbow", "valve_command.extensor"):
        del recording.channels[name], recording.mask[name]
    with pytest.raises(pamrs.DiagnosisError, match=r"no channel valve_command\.extensor"):
        pamrs.diagnose(pamrs.Case("short", rig, [recording], ROOT))
