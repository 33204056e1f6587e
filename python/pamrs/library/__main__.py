"""``python -m pamrs.library``: derive the identified numbers again and print every published fact beside ours."""

from __future__ import annotations

from pamrs.library.text import facts

if __name__ == "__main__":
    print(facts())
