"""``python -m pamrs.library``: derive the identified numbers again and print every published fact beside ours."""

from __future__ import annotations

import numpy as np

from pamrs.library import entry, names
from pamrs.library.design import compare_design, six_against_two
from pamrs.library.identify import derive
from pamrs.library.published import compare_all, counts, table


def main() -> None:
    """Print the identification, the table of facts, and the comparison of 3.2.3."""
    print("Identified numbers, derived again from prior and facts\n")
    for name in names():
        item, again = entry(name), derive(entry(name))
        slope, offset = (again.parameters[f"modulus_{key}"] for key in ("slope", "offset"))
        print(f"{name}: m = {np.array(slope)}, b = {np.array(offset)} Pa")
        if "braid_angle" in again.parameters:
            print(f"    braid angle {np.degrees(again.parameters['braid_angle']):.4f} deg")
        print(f"    facts: {', '.join(again.conditions) or 'none'}; they determine {again.rank} of {again.unknowns} combinations")
        print(f"    prior: {item.identification['prior']['origin']}")
        print(f"    moved by {np.round(again.change, 3)} prior standard deviations")
    rows = [*compare_all(), *compare_design("large_2in_effective"), *compare_design("large_2in")]
    print("\nPublished facts\n")
    print(table(rows))
    print("\nSix against two\n")
    print(six_against_two().table())
    print("\n" + ", ".join(f"{number} {verdict}" for verdict, number in counts(rows).items()))


if __name__ == "__main__":
    main()
