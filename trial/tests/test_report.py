"""Shares and means with their intervals, and keys that must be those that were published."""

import hashlib
import json

import pytest

from trial.__main__ import main
from trial.marks import gap_of
from trial.report import checked
from trial.summary import mean_interval, median_interval, wilson
from trial.tests.test_cases import LEAK, key_of


@pytest.fixture
def trial(tmp_path):
    """A trial folder with keys and manifest."""
    digests = {}
    for name in ("keys", "cases", "results"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("c01", "c02"):
        text = json.dumps(key_of(name, [LEAK]))
        (tmp_path / "keys" / f"{name}.json").write_text(text)
        digests[name] = hashlib.sha256(text.encode()).hexdigest()
    told = {"schema": "pamrs.trial-manifest/1", "keys": digests}
    (tmp_path / "manifest.json").write_text(json.dumps(told))
    return tmp_path


def scored(trial, *words):
    place = ["--keys", str(trial / "keys"), "--results", str(trial / "results")]
    return main(["score", *place, *words])


def test_intervals():
    assert median_interval([1.0] * 5) is None
    assert median_interval([float(v) for v in range(6)]) == (0.0, 5.0)
    # ranks 6 and 15 of 20, as tabulated
    assert median_interval([float(v) for v in range(20)]) == (5.0, 14.0)
    assert mean_interval([1.0, 2.0] * 50) == pytest.approx((1.5 - 0.0985, 1.5 + 0.0985), abs=1e-4)


@pytest.mark.parametrize(
    ("hits", "cases", "low", "high"),
    [(5, 10, 0.2366, 0.7634), (0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (1, 60, 0.0029, 0.0886)],
)
def test_wilson(hits, cases, low, high):
    assert wilson(hits, cases) == pytest.approx((low, high), abs=1e-4)


def test_wilson_wants_a_share():
    with pytest.raises(ValueError, match="is no share"):
        wilson(2, 1)


def test_nothing_named_closes_nothing():
    table = {"joint_angle": {"noise": 1.0, "refit": 3.0, "after": 3.0}}
    assert gap_of({"verdict": "unlisted", "fit": {"gap_closed": None, "held_out": table}}) == 0.0
    assert gap_of({"verdict": "effects", "fit": {"gap_closed": 0.8, "held_out": table}}) == 0.8
    quiet = {"joint_angle": {"noise": 1.0, "refit": 1.01, "after": 1.01}}
    assert gap_of({"verdict": "none", "fit": {"gap_closed": None, "held_out": quiet}}) is None
    assert gap_of({"verdict": "none", "fit": {}}) is None


def test_the_tables_say_how_the_trial_was_made(trial, capsys):
    words = ["--command", "make prove CASES=2", "--markdown", str(trial / "t.md")]
    assert scored(trial, *words) == 0
    text = (trial / "t.md").read_text()
    assert text in capsys.readouterr().out
    assert "make prove CASES=2" in text
    assert hashlib.sha256((trial / "manifest.json").read_bytes()).hexdigest() in text


def test_keys_must_be_those_that_were_published(trial, capsys):
    assert checked(trial)[1] == 2
    key = trial / "keys" / "c01.json"
    key.write_text(key.read_text().replace("30.0", "31.0"))
    assert scored(trial) == 2
    assert "not the key that was published" in capsys.readouterr().err
    key.unlink()
    with pytest.raises(ValueError, match="missing"):
        checked(trial)


def test_results_must_be_of_this_trial(trial, capsys):
    other = {"manifest_sha256": "0" * 64, "cases": {}}
    (trial / "results" / "run.json").write_text(json.dumps(other))
    assert scored(trial) == 2
    assert "another manifest" in capsys.readouterr().err


def test_keys_of_another_schema_are_refused(trial, capsys):
    (trial / "manifest.json").unlink()
    (trial / "keys" / "c02.json").write_text('{"schema": "pamrs.trial-key/1", "case": "c02"}')
    assert scored(trial) == 2
    assert "c02.json: schema must be 'pamrs.trial-key/2'" in capsys.readouterr().err
