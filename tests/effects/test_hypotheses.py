"""Terms and hypotheses: their text and when two of them are the same."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from pamrs.effects import (
    CATALOGUE,
    NONE,
    UNDECIDED,
    UNLISTED,
    WITHOUT_NAME,
    Hypothesis,
    Term,
    effect_of,
)

TERMS = st.one_of(
    st.builds(Term, st.sampled_from(sorted(CATALOGUE)), st.sampled_from(["", "flexor", "left_2"])),
    st.sampled_from([Term("chamber.dead_volume"), Term("chamber.flexor.dead_volume")]),
)


@given(terms=st.lists(TERMS, unique=True), rest=st.sampled_from(["", "unlisted", "none"]))
def test_text_gives_the_hypothesis_back(terms: list[Term], rest: str) -> None:
    told = Hypothesis(tuple(terms), rest)
    again = Hypothesis.parse(str(told))
    assert (again.terms, again.rest) == (told.terms, told.rest)
    assert Hypothesis.of(told.words) == told
    assert str(told) == "+".join([*map(str, terms), *([rest] if rest else [])])


@given(terms=st.lists(TERMS, unique=True, min_size=1))
def test_terms_have_no_order_and_what_is_beside_them_counts(terms: list[Term]) -> None:
    one, other = Hypothesis(tuple(terms)), Hypothesis(tuple(reversed(terms)))
    assert one == other
    assert len({one, other}) == 1
    assert one != Hypothesis(one.terms, "unlisted")
    assert one != Hypothesis(one.terms[1:])
    # by text as by term: places follow the effect everywhere
    assert [str(term) for term in sorted(terms)] == sorted(map(str, terms))


def test_what_has_no_term_is_told_by_its_word() -> None:
    assert [str(h) for h in WITHOUT_NAME] == ["none", "parameters", "unlisted"]
    assert Hypothesis.parse("") == UNDECIDED != NONE != UNLISTED
    assert Term.parse("chamber.dead_volume").is_value
    assert not Term.parse("unlisted_effect").is_effect


def test_a_dotted_parameter_belongs_to_an_effect_at_its_place_or_to_the_rig() -> None:
    leak, flexor = Term("leak_muscle"), Term("leak_muscle", "flexor")
    assert effect_of("leak_muscle.conductance") == leak
    assert effect_of("leak_muscle@flexor.conductance") == flexor
    assert effect_of("chamber.flexor.dead_volume") is None
    values = {"leak_muscle.conductance": 1.0, "leak_muscle@flexor.conductance": 2.0, "a.b": 3.0}
    assert leak.own(values) == {"conductance": 1.0}
    assert flexor.own(values) == {"conductance": 2.0}
