"""``python -m pamrs.design``: the joints of dissertation 3.5 printed beside ours, and the search methods side by side."""

from __future__ import annotations

import sys

from pamrs.design.joint_design import compare_methods
from pamrs.design.published import CASES, facts_of_geometry, facts_of_search
from pamrs.reproduce.facts import table

if __name__ == "__main__":
    for case in CASES:
        rows = [*facts_of_geometry(case), *facts_of_search(case, progress=lambda text: print(f"{text} ...", file=sys.stderr))]
        print(table(rows), end="\n\n")
        problem = case.problem()
        for pressure in (problem.pressure, 1.1 * problem.least_possible_pressure()):
            print(f"{case.name} at {pressure / 1e5:.4g} bar, J in joule")
            print(compare_methods(problem.replace(pressure=pressure)).table(), end="\n\n")
