"""Recordings of a rig on one clock, and cases: a rig with its recordings in a folder.

:func:`load_recording` reads a table, checks it and masks what cannot be used; :func:`load_case`
reads a case folder. :mod:`pamrs.recordings.table` reads tables of numbers from files.
"""

from __future__ import annotations

from pamrs.recordings._case import Case, load_case
from pamrs.recordings._recording import CHANNELS, Issue, Recording, load_recording

__all__ = ["CHANNELS", "Case", "Issue", "Recording", "load_case", "load_recording"]
