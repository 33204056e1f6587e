"""A command of pamrs, run in this process."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import pytest

from tests.scripts import command


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Exit code, standard output and standard error of words."""
    return partial(command, capsys)
