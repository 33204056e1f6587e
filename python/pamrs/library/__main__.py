"""``python -m pamrs.library``: as ``pamrs library --facts``."""

from __future__ import annotations

import sys

from pamrs.cli import main

if __name__ == "__main__":
    code = main(["library", "--facts"])
    if code:
        sys.exit(code)
