"""Results of a diagnosis as they are kept in a file."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import pamrs
from pamrs.findings import NOT_JUDGED, VERDICTS


def kept(found: pamrs.Diagnosis) -> dict[str, Any]:
    """The JSON of a result, which has all its keys and reads back as the same result."""
    with tempfile.TemporaryDirectory() as home:
        text = found.to_json(Path(home) / "result.json")
        assert pamrs.load_result(home).to_json() == text
    content: dict[str, Any] = json.loads(text)
    assert {block["verdict"] for block in content["blocks"]} <= {*VERDICTS, NOT_JUDGED}
    return content
