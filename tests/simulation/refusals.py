"""Calls that are refused, each in words of its own."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from pamrs.errors import PamrsError, ParameterError


def refused(
    *cases: tuple[str, Callable[[], object]], by: type[PamrsError] = ParameterError
) -> None:
    """Each call is refused in words that match the pattern before it."""
    assert cases
    for told, call in cases:
        with pytest.raises(by, match=told):
            call()
