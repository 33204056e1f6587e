"""How far a work is: percent and time left for whoever asks, silent otherwise."""

from __future__ import annotations

import logging
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest

from pamrs._progress import LOG, Line, Steps


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_lines_have_percent_and_time_left() -> None:
    heard, clock = list[str](), Clock()
    steps = Steps(heard.append, within=(0.2, 0.8), clock=clock)
    steps("begins", 0.0)
    clock.now = 10.0
    steps(Line("a: refit", 0.5, part="a"))
    steps(Line("b: refit", 0.25, part="b"))
    steps(Line("b: more", part="b"))
    steps("text alone")
    clock.now = 40.0
    steps("last", 1.0)
    assert all(isinstance(line, Line) for line in heard)
    shares = [line.share for line in heard]  # type: ignore[attr-defined]
    assert shares[0] == 0.0
    assert shares[1] == pytest.approx(0.2 + 0.6 * 0.5)
    assert shares[2] == shares[1]  # never goes back: two parts make the mean smaller
    assert shares == sorted(shares)
    assert heard[0].whole == "0 %: begins"  # type: ignore[attr-defined]
    assert heard[1].whole == "50 %, about 10 s left: a: refit"  # type: ignore[attr-defined]
    assert heard[-1].whole == "100 %, about 0 s left: last"  # type: ignore[attr-defined]


def test_lines_are_logged_and_nobody_hears_them_unasked(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "pamrs"):
        Steps()("something", 0.5)
    assert [one.getMessage() for one in caplog.records] == ["50 %, about 0 s left: something"]
    assert caplog.records[0].name == LOG.name == "pamrs"
    code = "from pamrs._progress import LOG, Steps; Steps()('loud', 0.5); LOG.warning('louder')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


def test_a_notebook_shows_one_line_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = list[tuple[str, str]]()

    class Handle:
        def update(self, told: dict[str, str], *, raw: bool) -> None:
            shown.append(("update", told["text/plain"]))

    def display(told: dict[str, str], *, raw: bool, display_id: bool) -> Handle:
        shown.append(("new", told["text/plain"]))
        return Handle()

    shell = SimpleNamespace(kernel=object())
    notebook = SimpleNamespace(get_ipython=lambda: shell, display=SimpleNamespace(display=display))
    monkeypatch.setitem(sys.modules, "IPython", notebook)  # type: ignore[arg-type]
    steps = Steps()
    steps("first", 0.0)
    steps("second", 0.5)
    assert [kind for kind, _ in shown] == ["new", "update"]
    assert shown[1][1].startswith("50 %, about 0 s left: second")


def test_threads_share_it() -> None:
    heard = list[str]()
    steps = Steps(heard.append)

    def work(name: str) -> None:
        for k in range(50):
            steps(Line(f"{name} {k}", k / 49, part=name))

    threads = [threading.Thread(target=work, args=(name,)) for name in "ab"]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert len(heard) == 100
    assert heard[-1].share == 1.0  # type: ignore[attr-defined]
