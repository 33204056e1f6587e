"""``pamrs campaign``: what it refuses, and its pages."""

import pytest

WORDS = ("campaign", "shoulder", "--out")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "give --device or --step, one of the two"),
        (("--step", "--device", "simulated"), "give --device or --step, one of the two"),
        (("--device", "simulated", "--recording", "x.csv"), "--recording needs --step"),
        (("--device", "/dev/ttyNONE"), "/dev/ttyNONE: No such file or directory"),
        (("--device", "simulated:no.toml"), "no.toml: cannot be read"),
        (("--step", "--limit", "valve_command"), "--limit = 'valve_command' is not allowed: NAME="),
        (
            ("--step", "--limit", "valve_command=3"),
            "--limit valve_command = '3' is not allowed: LOW:",
        ),
        (("--step", "--safe", "valve_command=shut"), "a number in V is needed"),
        (("--step", "--safe", "valve_command=12"), "safe['valve_command'] = 12 V is not allowed: "),
        (
            ("--step", "--rest", "supply_command=0"),
            "rest has 'supply_command', which is not allowed",
        ),
        (("--step", "--minutes", "0"), "minutes = 0.0 is not allowed: a finite number above zero"),
        (("--step", "--runs", "-1"), "runs = -1 is not allowed: a whole number from 0 on"),
        (("--step", "--highest", "3"), "--highest = '3' is not allowed: a number with a unit"),
        (("--step", "--log", "no.csv"), "no.csv"),
        (("--step", "--case", "no"), "no"),
    ],
)
def test_what_is_wrong_is_named_before_anything_is_played(run, tmp_path, words, told):
    code, out, errors = run(*WORDS, str(tmp_path / "out"), *words)
    assert (code, out) == (2, "")
    assert told in errors


def test_it_ends_with_its_budget_and_says_where_its_pages_are(run, tmp_path):
    home = tmp_path / "out"
    code, out, _ = run(*WORDS, str(home), "--device", "simulated", "--runs", "0")
    assert code == 0
    assert (
        "The budget allows no further run (1 of 0 runs); open is: nothing was recorded yet" in out
    )
    assert f"Pages: {home / 'campaign.html'}" in out
    assert "The budget allows no further run" in (home / "campaign.html").read_text()
