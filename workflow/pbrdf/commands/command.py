"""What a subcommand is."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Command:
    """A subcommand.

    Attributes
    ----------
    name, summary, examples : str
        What ``--help`` tells.
    add_arguments : callable
        Declares its arguments.
    run : callable
        Does it; raises `InputError` for what the user can put right.
    """

    name: str
    summary: str
    examples: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], None]
