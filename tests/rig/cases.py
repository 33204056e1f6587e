"""Small rigs for tests: the least that each kind of block needs, put together by names and
ports.
"""

from __future__ import annotations

import pytest

from pamrs.errors import RigError
from pamrs.rig import Rig, parse_rig

__all__ = ["HEAD", "LEAST", "refused", "same", "stand"]

HEAD = 'schema = "pamrs.rig/1"\nname = "stand"\n[gas]\n'

#: The least that each kind of block needs.
LEAST = {
    "supply": 'volume = { value = 5, unit = "l" }\ninitial_pressure = { value = 6, unit = "bar" }',
    ("valve"): (
        'discharge_area_max = { value = 1, unit = "mm2" }\n'
        'null_voltage = { value = 5, unit = "V" }\nhalf_range = { value = 5, unit = "V" }\n'
        "area_fraction = { opening = [0.0, 1.0], fraction = [0.0, 1.0] }"
    ),
    "line": 'length = { value = 2, unit = "m" }\ndiameter = { value = 4, unit = "mm" }',
    "orifice": 'kind = "orifice"\ndischarge_area = { value = 1, unit = "mm2" }',
    "chamber": 'dead_volume = { value = 10, unit = "cm3" }',
    ("muscle"): (
        'rest_length = { value = 20, unit = "cm" }\nrest_diameter = { value = 2, unit = "cm" }\n'
        'braid_angle = { value = 74, unit = "deg" }\nwall_thickness = { value = 2, unit = "mm" }\n'
        'modulus_slope = { value = [1.0], unit = "1" }\n'
        'modulus_offset = { value = [1.0], unit = "MPa" }'
    ),
    ("transmission"): (
        'kind = "pulley"\nradius = { value = 2, unit = "cm" }\n'
        'rest_angle = { value = 0, unit = "deg" }'
    ),
    ("joint"): (
        'kind = "pulley"\nradius = { value = 2, unit = "cm" }\n'
        'rest_angle = { value = 0, unit = "deg" }\n'
        'min_angle = { value = 0, unit = "deg" }\nmax_angle = { value = 90, unit = "deg" }'
    ),
    "free": 'kind = "free"\nrest_angle = { value = 0, unit = "deg" }\n'
    'min_angle = { value = 0, unit = "deg" }\nmax_angle = { value = 90, unit = "deg" }',
    "arm": 'inertia = { value = 0.1, unit = "kg m2" }\nlength = { value = 0.3, unit = "m" }',
    "planar": 'kind = "planar"',
    "link": 'length = { value = 0.3, unit = "m" }\nmass = { value = 1, unit = "kg" }\n'
    'centre = { value = 0.15, unit = "m" }\ninertia = { value = 0.01, unit = "kg m2" }',
    ("load"): (
        'mass = { value = 10, unit = "kg" }\nmin_length = { value = 15, unit = "cm" }\n'
        'max_length = { value = 20, unit = "cm" }'
    ),
    "sensors": "",
}
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
    with pytest.raises(RigError) as caught:
        parse_rig(text, source="stand.toml")
    return str(caught.value)


def same(one: Rig, other: Rig) -> bool:
    equal = (
        one.model == other.model
        and one.parameters == other.parameters
        and one.effect_std == other.effect_std
    )
    return equal and one.to_json() == other.to_json()
