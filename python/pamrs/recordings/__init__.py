"""Recordings of a rig on one clock, and cases: a rig with its recordings in a folder.

:func:`load_recording` reads a table, checks it and masks what cannot be used; :func:`load_case`
reads a case folder, :data:`CASE_KEYS` has the keys of its ``case.toml``;
:func:`load_recordings` takes the log of a laboratory as it is, :func:`propose` says what of it is
likely which channel, :func:`suspicions` which units physics contradicts.
:mod:`pamrs.recordings.table` reads tables of numbers from files, :mod:`pamrs.recordings.logs` logs
of every format, :mod:`pamrs.recordings.mapping` what their numbers stand for.
"""

from pamrs.channels import CHANNELS
from pamrs.recordings._case import Case, is_table, load_case, load_recording, model_and_case
from pamrs.recordings._doubts import Suspicion, ambient_of, suspicions
from pamrs.recordings._from_log import load_recordings
from pamrs.recordings._proposal import LogProposal, Proposal, channels_of, propose
from pamrs.recordings._recording import Issue, OwnValue, Recording
from pamrs.recordings.mapping import CASE_KEYS

__all__ = [
    "CASE_KEYS",
    "CHANNELS",
    "Case",
    "Issue",
    "LogProposal",
    "OwnValue",
    "Proposal",
    "Recording",
    "Suspicion",
    "ambient_of",
    "channels_of",
    "is_table",
    "load_case",
    "load_recording",
    "load_recordings",
    "model_and_case",
    "propose",
    "suspicions",
]
