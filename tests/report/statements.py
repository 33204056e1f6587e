"""Every statement that a result makes, as a reader sees it in text, page and JSON; and the pairs of
them that contradict each other.
"""

from __future__ import annotations

import dataclasses
import html
import itertools
import json
import re
from pathlib import Path
from typing import Any, NamedTuple

import pamrs
from pamrs.diagnosis.result import Diagnosis
from pamrs.findings import HEALTHY
from pamrs.report import render_html, sentences, words
from pamrs.report.sentences import law_sentence

_OPEN = (
    r"\bmay\b|not ruled out|still misses|that the model leaves out|\) or | or \d+ more"
    r"|no effect of the catalogue|outside the catalogue"
)
"""Words of a sentence that is not sure."""
_NUMBER = r"([<>]? ?\d\.\d\d)"
_BADGES = {
    "nothing missing": ("none", True),
    "nothing missing, but not settled": ("none", False),
    "parameters inside their tolerances": ("parameters", True),
    "parameters or physics, not settled": ("parameters", False),
    "missing physics named": ("effects", True),
    "missing physics, the name is not settled": ("effects", False),
    "missing physics, no name": ("unlisted", False),
    "a value of the rig file is wrong": ("parameters", True),
    "a value of the rig file may be wrong": ("parameters", False),
    "not settled: what is missing was not found": ("unlisted", False),
    "not settled: more is missing": ("", False),
    "a channel is in another unit": ("units", False),
}
"""Verdict and whether it is settled, of each badge; empty where it does not say."""
_HEALTHY_BADGES = ("nothing missing", "parameters inside their tolerances")
_LEFT = {
    "noise": ("only noise is left", "noise only", "fits to the noise"),
    "error": ("inside the usual error", "inside its usual error", "usual error: "),
}
"""Words for what is left in a block; it is more where none of them is said."""


class Statement(NamedTuple):
    """What is said of something, and where."""

    about: str
    said: Any
    source: str


def read(path: Path) -> Diagnosis:
    """A result from its file, with nothing in the place of what a file does not keep."""
    found = pamrs.load_result(path)
    kept = [f.name for f in dataclasses.fields(Diagnosis) if f.metadata.get("json", True)]
    return Diagnosis(**{name: getattr(found, name) for name in kept})


def contradictions(found: Diagnosis) -> list[str]:
    """Pairs of statements of a result that contradict each other, in words."""
    told = [
        f"{one.about}: {one.said!r} ({one.source}), {two.said!r} ({two.source})"
        for one, two in itertools.combinations(statements(found), 2)
        if one.about == two.about and one.said != two.said
    ]
    return list(dict.fromkeys(told))


def statements(found: Diagnosis) -> list[Statement]:
    """All statements of a result."""
    page = html.unescape(render_html(found))
    summary = " ".join(found.summary().split())
    told = [*_of_json(found), *_of_headlines(found, page, summary), *_of_chances(found, page)]
    told += [*_of_blocks(found, page, summary), *_of_values(found, page)]
    return [*told, *_of_next(found, page, summary), *_of_text(found)]


def _of_json(found: Diagnosis) -> list[Statement]:
    """Verdict, place and names of ``result.json``."""
    content = json.loads(found.to_json())
    answer, verdict = content["answer"], content["verdict"]
    wrong = {w["name"] for w in content["wrong_parameters"]}
    other_law = bool(content["laws"])
    effects = {e.term for e in found.effects} if verdict == "effects" else set[str]()
    told = [
        Statement("verdict", verdict, "verdict"),
        Statement("verdict", answer["verdict"], "answer"),
        Statement("settled", answer["settled"], "answer"),
        Statement("place", content["where"]["block"], "where"),
        Statement("place", answer["block"], "answer"),
        Statement("names", effects | wrong, "effects and wrong values"),
        Statement("missing", bool(wrong) or other_law or verdict not in HEALTHY, "verdict"),
        Statement("missed", {m["channel"] for m in answer["missed"]}, "answer"),
    ]
    judged = found.judged
    if judged:
        named = {n for b in judged for n in (*b.effects, *b.wrong_parameters)}
        told.append(Statement("names", named, "blocks"))
    if len(content["ambiguity"]) > 1:
        told.append(Statement("settled", False, "ambiguity"))
    chances = content["probabilities"]
    if answer["settled"] and chances and not other_law:
        healthy = sum(chances.get(key) or 0.0 for key in HEALTHY)
        told.append(Statement("missing", healthy < 0.5, "probabilities"))
    if found.unexplained or answer["missed"]:
        told.append(Statement("missing", True, "unexplained and missed"))
    return told


def _of_headlines(found: Diagnosis, page: str, summary: str) -> list[Statement]:
    """What headline, title and badge say, and how sure they are."""
    badge = re.search(r'class="badge \w*">([^<]*)<', page)
    assert badge is not None
    verdict, sure = _BADGES[badge[1]]
    told = [Statement("settled", sure, "badge")]
    if sure:
        told.append(Statement("missing", badge[1] not in _HEALTHY_BADGES, "badge"))
    if verdict:
        # of a value beside physics without a name the badge says the physics
        told.append(Statement("verdict", verdict, "badge"))
    if found.misread:
        return told
    missed = {m.channel for m in found.answer.missed}
    for source, text in (("headline", found.headline), ("title", sentences.title(found))):
        said_before = [*(own.text for own in found.faulty), *map(law_sentence, found.laws)]
        for own in said_before:
            text = text.removeprefix(f"{own}. ")
        sure = re.search(_OPEN, text.replace("alone or with others", "")) is None
        told.append(Statement("settled", sure, source))
        healthy = text.startswith(("Nothing is missing", "No physics is missing"))
        if healthy or sure:
            told.append(Statement("missing", not healthy, source))
        said, _, _ = text.partition("; what ")
        own = {c for c in found.proven.keys() | missed if words.spoken_name(c) in said}
        if source == "headline":
            own = own if "still misses" in text else set()
            told.append(Statement("missed", own, source))
        first = "still misses" in text.partition(". ")[0]
        told.append(Statement("missed first", first, source))
        told.append(Statement("missed first", bool(missed and not found.answer.named), "answer"))
    told.append(Statement("headline", found.headline, "headline"))
    told.append(Statement("headline", found.headline * (found.headline in summary), "terminal"))
    return told


def _of_chances(found: Diagnosis, page: str) -> list[Statement]:
    """Probabilities in bars, facts, headline and text, by name and place."""
    told = [
        Statement(f"probability of {row.name}", row.chance, "rivals")
        for row in sentences.rivals(found)
    ]
    rows = re.findall(r'<tr><th>([^<]*)</th><td class="track">.*?num">([^<]*)</td>', page)
    told += [Statement(f"probability of {name}", p, "page") for name, p in rows if "%" not in p]
    for name, what in sentences.facts(found):
        if chance := re.match(
            rf"probability {_NUMBER}(, alone or with others)?( in the .*)?$", what
        ):
            about = f"probability of {name}{chance[3] or ''}{chance[2] or ''}"
            told.append(Statement(about, chance[1], "facts"))
    parts = found.answer.parts
    for part in parts:
        place = words.spoken_name(part.block or "rig")
        at = f" in the {place}" if len(parts) > 1 else ""
        text = ". ".join(one for one in found.headline.split(". ") if place in one or not at)
        for own, _ in part.left:
            label = words.set_label(list(own))
            said = re.search(
                rf"(?<!\+ ){re.escape(label)}(?:{re.escape(at)})? \({_NUMBER}(,[^)]*)?\)", text
            )
            if said:
                about = f"probability of {label}{at}{said[2] or ''}"
                told.append(Statement(about, said[1], "headline"))
    for effect in found.effects:
        own = effect.id if not effect.at else f"{effect.id}@{effect.at}"
        if said := re.search(rf"\({effect.id}, probability {_NUMBER}(, alone[^)]*)?\)", found.text):
            about = f"probability of {own}, whatever else acts"
            told.append(Statement(about, said[1], "text"))
            told.append(Statement(about, words.format_probability(effect.probability), "effects"))
    return told


def _left_said(text: str) -> str:
    """What a text says of what is left in a block."""
    return next((left for left, said in _LEFT.items() if any(s in text for s in said)), "more")


def _of_blocks(found: Diagnosis, page: str, summary: str) -> list[Statement]:
    """What is left in each block, and where the mismatch is."""
    told = []
    for block, sentence in sentences.budget_sentences(found):
        about = f"left in {block}"
        told.append(Statement(about, _left_said(sentence), "budget"))
        begin = f"Budget of the {words.spoken_name(block)}: "
        text = summary.partition(begin)[2].partition("Budget of")[0]
        told.append(Statement(about, _left_said(text.partition(" (Shares")[0]), "terminal"))
        rows = page.partition(f'class="block">{words.spoken_name(block)}</th>')[2]
        rows = rows.partition('class="block"')[0].partition("</table>")[0]
        told.append(Statement(about, _left_said(rows), "page"))
    table = page.partition("with what was found</th></tr>")[2].partition("</table>")[0]
    for own in (m for b in found.judged for m in b.mismatch):
        row = re.search(rf'"left">{re.escape(words.spoken_name(own.block))}</td>(.*?)</tr>', table)
        if row:
            last = row[1].rpartition('class="num">')[2]
            told.append(Statement(f"left in {own.block}", _left_said(last), "verdicts"))
    for own in found.answer.missed:
        if own.block:
            told.append(Statement(f"left in {own.block}", "more", "answer"))
    role = "held_out" if found.fit.held_out else "fit"
    for kept in found.unexplained:
        if kept.role == role and not kept.form and found.answer.model != "mended model":
            told.append(Statement(f"left in {kept.block}", "more", "unexplained"))
    where = re.match(r"The mismatch lies in the (.*? block( of [^ .(,]+)?)", found.where.text)
    if where:
        told.append(Statement("where", where[1], "where"))
        block = found.answer.block
        told.append(Statement("where", words.spoken_block(block) if block else None, "answer"))
    return told


def _of_values(found: Diagnosis, page: str) -> list[Statement]:
    """What is said of values of the rig file, and the columns of the tables of errors."""
    told = []
    spoken = {**dict.fromkeys(re.findall(r"([\w.]+) by [+-][\d.]+ tolerances", found.text), "text")}
    for warning in found.warnings:
        if named := re.match(r"the refit without effects moves ([\w.]+) by", warning):
            spoken[named[1]] = "warning"
    wrong = {w.name: w for w in found.wrong_parameters}
    for name, own in found.parameters.items():
        row = page.rpartition(f"<tr><td>{name}</td>")[2].partition("</tr>")[0]
        about = f"{name} is determined"
        told.append(Statement(about, "not determined" not in row, "page"))
        told += [Statement(about, True, spoken[name])] if name in spoken else []
        told.append(Statement(f"{name} is wrong", "the rig file is wrong" in row, "page"))
        told.append(Statement(f"{name} is wrong", name in wrong, "wrong_parameters"))
        if name in wrong:
            told.append(Statement(f"{name} is outside its tolerance", True, "wrong_parameters"))
            outside = not abs(own.moved_sigmas) < 1.0
            told.append(Statement(f"{name} is outside its tolerance", outside, "parameters"))
    heads = re.findall(r"<tr><th>root mean square error</th>(.*?)</tr>", page)
    for names in [re.findall(r"<th>(.*?)</th>", row) for row in heads]:
        told.append(Statement("columns", len(names), "page"))
        told.append(Statement("columns", len(set(names)), "different ones"))
    line = next((one for one in found.summary().splitlines() if " your model " in one), "")
    names = re.findall(r"noise|your model|refitted|mended|your", line.partition("error")[2])
    told += [Statement("columns", len(own), "terminal") for own in (names, set(names)) if names]
    return told


def _of_next(found: Diagnosis, page: str, summary: str) -> list[Statement]:
    """What the next experiment says, and whether the first screen shows it whole."""
    own, told = found.next_experiment, []
    if re.search(r"(is|are) settled by these recordings", own.text):
        told.append(Statement("settled", True, "next experiment"))
    screen = re.sub(r"<details\b.*?</details>", " ", page, flags=re.DOTALL)
    shown = re.search(r"<b>(?:Record next|Next):</b> (.*?)</p>", screen, flags=re.DOTALL)
    wanted = own.instruction or own.text * (not found.answer.settled)
    told.append(Statement("to record", wanted, "next experiment"))
    told.append(Statement("to record", shown[1] if shown else "", "first screen"))
    whole = " ".join(own.text.split()) in summary.replace("  ", " ")
    told.append(Statement("the terminal has the next experiment", whole, "terminal"))
    told.append(Statement("the terminal has the next experiment", True, "next experiment"))
    block = str(own.excitation.get("block", ""))
    left = {m.block: sentences.left_in(found, m.block) for b in found.judged for m in b.mismatch}
    part = found.answer.part_of(block)
    # an open name is a question by itself, and so is a missing one
    asked = part is not None and (len(part.left) > 1 or part.group.verdict == "unlisted")
    if left.get(block) == "noise" and "more" in left.values() and not asked:
        told.append(Statement("block that keeps more than noise", block, "next experiment"))
        told.append(Statement("block that keeps more than noise", left, "blocks"))
    return told


def _of_text(found: Diagnosis) -> list[Statement]:
    """What the verdict in words says."""
    if not found.text or found.misread:
        return []
    told = [Statement("settled", "It is not settled" not in found.text, "text")]
    if "may lack nothing" not in found.text:
        healthy = found.text.startswith(("Nothing is missing", "No physics is missing"))
        told.append(Statement("missing", not healthy, "text"))
    if found.answer.missed:
        told.append(Statement("missing", "still misses" in found.text, "text"))
    return told
