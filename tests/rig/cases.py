"""Small rigs for tests: the least that each kind of block needs, put together by names and
ports.
"""

from __future__ import annotations

import pytest

from pamrs.errors import RigError
from pamrs.rig import Rig, parse_rig
from tests.tables import rows_of

__all__ = ["HEAD", "LEAST", "refused", "same", "stand"]

HEAD = 'schema = "pamrs.rig/1"\nname = "stand"\n[gas]\n'

#: The least that each kind of block needs.
LEAST = rows_of(__file__, "least")
KINDS = {"orifice": "line", "free": "joint", "planar": "arm"}


def stand(*blocks: str, **extra: str) -> str:
    """A rig of blocks like ``"valve.a from=supply to=b"``: the least that each needs, and its
    ports.
    """
    lines = [HEAD]
    for entry in blocks:
        which, *ports = entry.split()
        kind, _, name = which.partition(".")
        lines.append(f"[{KINDS.get(kind, kind)}{'.' + name if name else ''}]")
        lines += [f'{port} = "{end}"' for port, _, end in (part.partition("=") for part in ports)]
        lines += [extra.get(which.replace(".", "_").replace("-", "_"), ""), LEAST[kind]]
    return "\n".join(lines) + "\n"


def refused(text: str) -> str:
    """Why a rig is not read."""
    with pytest.raises(RigError) as caught:
        parse_rig(text, source="stand.toml")
    message = str(caught.value)
    assert message.startswith("stand.toml")
    return message


def same(one: Rig, other: Rig) -> bool:
    """Whether two rigs are equal, with what is known of each number, and as the core gets them."""
    return one == other and one.to_json() == other.to_json()
