"""The committed JSON schema of a result, beside the types that it is made from.

``python -m pamrs.diagnosis.schema`` writes it again; with ``--check`` it only says whether it is
what the types give.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Final

from pamrs._writing import write_atomically
from pamrs.diagnosis.result import schema

__all__ = ["FILE", "is_current", "text"]

FILE: Final = Path(__file__).with_name("schema.json")
"""Where it is committed."""


def text() -> str:
    """The schema as it is committed."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


def is_current() -> bool:
    """Whether the committed file is what the types give."""
    return FILE.read_text(encoding="utf-8") == text()


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        sys.exit(
            0
            if is_current()
            else f"{FILE} is not what the types give; python -m pamrs.diagnosis.schema writes it"
        )
    write_atomically(FILE, text())
