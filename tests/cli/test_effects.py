"""The catalogue of effects as text and on the command line."""

from __future__ import annotations

import dataclasses

import pytest

from pamrs import rigs
from pamrs.effects import CATALOGUE, EFFECTS, Form, text
from pamrs.errors import ParameterError
from pamrs.rig import parse_rig
from tests.effects.test_effects import rig_for
from tests.scripts import command as run

IDS = [info.id for infos in text.catalogue().values() for info in infos]


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


def two_forms(monkeypatch):
    """The leak with another second form."""
    leak = EFFECTS["leak_muscle"]
    second = Form("porous", leak.parameters[:1], (), ("leak",))
    grown = dataclasses.replace(leak, forms=(leak.forms[0], second))
    monkeypatch.setitem(CATALOGUE, "leak_muscle", grown)
    return grown


def test_each_form_is_shown_with_its_parameters(monkeypatch):
    first = two_forms(monkeypatch).forms[0].name
    shown = text.description("leak_muscle")
    head, _, rest = shown.partition("form porous, parameters:")
    assert f"form {first} (the usual one), parameters:" in head
    assert "laminar_share" in head
    assert "laminar_share" not in rest.partition("in a rig file\n")[0]
    assert 'form = "porous"' in rest.partition("in a rig file, form porous")[2]
    assert text.snippet("leak_muscle", form=first) == text.snippet("leak_muscle")
    with pytest.raises(ParameterError, match=f"leak_muscle has '{first}', 'porous'"):
        text.snippet("leak_muscle", form="other")


def test_two_at_blocks_of_their_own_are_shown():
    shown = text.description("leak_muscle")
    head, _, rest = shown.partition("in a rig with several chambers, by their names")
    assert "at =" not in head
    assert rest.count("[[effects]]") == 2
    assert 'at = "chamber_a"' in rest
    assert 'at = "chamber_b"' in rest
    assert "several supplies" in text.description("supply_leak")
    assert "several" not in text.description("clock_skew")
    assert text.description("payload_swing").partition("several joints")[2].count("at =") == 1


def test_a_snippet_takes_a_block():
    rig = rigs.named("antagonistic_joint")
    read = parse_rig(f"{rig.to_toml_text()}\n{text.snippet('leak_muscle', at='flexor')}\n")
    assert read.effects == rig.with_effect("leak_muscle", at="flexor").effects
    with pytest.raises(ParameterError, match="at = 'a' is not allowed: clock_skew acts on the"):
        text.snippet("clock_skew", at="a")


def test_an_effect_of_an_unknown_block_is_not_dropped(monkeypatch):
    other = dataclasses.replace(EFFECTS["leak_muscle"], block="wheel")
    monkeypatch.setitem(CATALOGUE, "leak_muscle", other)
    with pytest.raises(ValueError, match="leak_muscle is in the block 'wheel'; there are: supply"):
        text.catalogue()


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
