"""For every test: what fails is raised, not left out of a result with a warning; what was collected
is no garbage; and what tests of the work tell at the end of a run, whichever process they ran in.
"""

from __future__ import annotations

import gc
import os

import pytest

from pamrs._losses import STRICT

os.environ[STRICT] = "1"


def pytest_collection_finish() -> None:
    """Modules and tests stay: libraries that collect garbage at each file need not go over them."""
    gc.collect()
    gc.freeze()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the instructions that were counted."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for name, value in report.user_properties:
                if name == "instructions":
                    terminalreporter.write_line(f"{name}: {value}")
