"""The catalogue of effects as text and on the command line."""

from __future__ import annotations

import pytest

from pamrs import cli
from pamrs.effects import EFFECTS, text
from pamrs.errors import ParameterError
from pamrs.rig import parse_rig
from tests.effects.test_effects import rig_for

IDS = [info.id for infos in text.catalogue().values() for info in infos]


def run(capsys, *words):
    code = cli.main(list(words))
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_every_effect_is_listed_with_block_and_name(capsys):
    code, out, err = run(capsys, "effects")
    assert (code, err) == (0, "")
    lines = out.splitlines()[1:]
    assert [line.split()[1] for line in lines] == IDS
    for line, effect in zip(lines, IDS, strict=True):
        assert line.split()[0] == EFFECTS[effect].block
        assert line.endswith(EFFECTS[effect].name)


@pytest.mark.parametrize("effect", IDS)
def test_an_effect_is_shown_in_full(capsys, effect):
    code, out, err = run(capsys, "effects", effect)
    assert (code, err) == (0, "")
    info, words = EFFECTS[effect], " ".join(out.split())
    for part in (
        info.name,
        info.block,
        info.equation,
        info.fingerprint,
        info.separates,
        info.reference,
        *info.rivals,
    ):
        assert " ".join(part.split()) in words
    for parameter in info.parameters:
        assert f"{parameter.name} " in out
        assert parameter.meaning in out
        assert f"{parameter.lower:g} to {parameter.upper:g}" in out


@pytest.mark.parametrize("effect", IDS)
def test_its_snippet_switches_it_on_with_the_usual_values(effect):
    plain = rig_for(effect)
    read = parse_rig(f"{plain.to_toml_text()}\n{text.snippet(effect)}\n")
    assert read.effects == plain.with_effect(effect).effects


def test_a_snippet_takes_values():
    assert 'conductance   = { value = 2e-11, unit = "m3/(s Pa)" }' in text.snippet(
        "leak_muscle", {"conductance": 2e-11}
    )


@pytest.mark.parametrize(
    ("word", "part"),
    [
        ("leak_muscel", "did you mean leak_muscle?"),
        ("creep", "did you mean muscle_creep?"),
        ("Payload-Swing", "did you mean payload_swing?"),
        ("stribek", "did you mean joint_coulomb_stribeck?"),
        ("xyz", "the catalogue has: supply_leak, "),
    ],
)
def test_an_unknown_effect_is_refused_with_those_like_it(capsys, word, part):
    code, out, err = run(capsys, "effects", word)
    assert (code, out) == (2, "")
    assert err.startswith(f"pamrs: error: effect {word!r} is not in the catalogue; ")
    assert part in err
    assert err.count("\n") == 1
    with pytest.raises(ParameterError, match="is not in the catalogue"):
        text.description(word)


@pytest.mark.parametrize("effect", IDS)
def test_what_looks_alike_names_each_other(effect):
    rivals = EFFECTS[effect].rivals
    assert rivals
    for rival in rivals:
        assert " " in rival or rival in IDS
        assert rival not in IDS or effect in EFFECTS[rival].rivals
