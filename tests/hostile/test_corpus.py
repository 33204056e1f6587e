"""Every hostile input ends within seconds, in words of less than a screen."""

import signal
from pathlib import Path

import pytest

from pamrs import cli
from tests.hostile.corpus import Entry, entries

MOST_SECONDS = 20


def late(*_: object) -> None:
    raise TimeoutError(f"it takes more than {MOST_SECONDS} s")


@pytest.mark.parametrize("entry", list(entries()), ids=lambda entry: entry.name)
def test_what_is_hostile_is_survived(
    entry: Entry, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = entry.write(tmp_path)
    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(MOST_SECONDS)
    try:
        code = cli.main(words)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    out, err = capsys.readouterr()
    assert code in (0, 2), err
    assert "Traceback" not in out + err
    assert not any(ord(letter) < 32 and letter not in "\n\t" for letter in out + err)
    assert len(err) < 3000
    assert entry.told in out + err
    assert "TimeoutError" not in err
    assert "it takes more than" not in err
