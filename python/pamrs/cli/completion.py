"""``pamrs completion``: what makes a shell complete commands, options and names."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Annotated, Final

import typer

#: By which a shell asks for completions.
VARIABLE: Final = "_PAMRS_COMPLETE"


def _beginning(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def effect_ids(incomplete: str) -> list[str]:
    """Ids of effects that begin with a text."""
    from pamrs.effects import CATALOGUE

    return _beginning(CATALOGUE, incomplete)


def muscle_names(incomplete: str) -> list[str]:
    """Names of muscles of the library that begin with a text."""
    from pamrs import library

    return _beginning(library.names(), incomplete)


def rig_names(incomplete: str) -> list[str]:
    """Names of rigs of the package that begin with a text."""
    from pamrs import rigs

    return _beginning(rigs.names(), incomplete)


class _Shell(StrEnum):
    bash = "bash"
    zsh = "zsh"
    fish = "fish"


def completion_command(
    shell: Annotated[_Shell, typer.Argument(help="bash, zsh or fish.")],
) -> None:
    """Print the script that makes a shell complete pamrs.

    For bash, put into ~/.bashrc: eval "$(pamrs completion bash)". For zsh the same with zsh, into
    ~/.zshrc. For fish: pamrs completion fish > ~/.config/fish/completions/pamrs.fish.
    """
    from typer._completion_shared import get_completion_script

    typer.echo(get_completion_script(prog_name="pamrs", complete_var=VARIABLE, shell=shell.value))
