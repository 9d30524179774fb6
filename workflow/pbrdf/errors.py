"""The one error a user meets: a line that names the file, the field and the remedy."""

from __future__ import annotations

from pathlib import Path

REFUSALS = Path(".snakemake/refusals.txt")
"""Errors of jobs, in a run's folder: it repeats them at its end, for Snakemake says much after them."""

LONGEST_PART = 400
"""Characters that a part of a message may take: what a file says of itself can be of any length."""


class InputError(Exception):
    """Input that cannot be used as it is.

    Parameters
    ----------
    source : str or Path
        The file, or the call, that holds the input.
    field : str
        The field in it: a key, a column, an array, an argument.
    problem : str
        What is wrong there, with the value found.
    remedy : str
        What to do about it.
    """

    def __init__(self, source: str | Path, field: str, problem: str, remedy: str) -> None:
        self.source = str(source)
        self.field = field
        self.problem = problem
        self.remedy = remedy
        super().__init__(source, field, problem, remedy)

    def __str__(self) -> str:
        field, problem, remedy = map(_short, (self.field, self.problem, self.remedy))
        return _printable(f"{self.source}: {field}: {problem}; {remedy}")


class InstrumentError(InputError):
    """An instrument that does not do what it is told; `source` names it with its port."""


def _short(text: str) -> str:
    return text if len(text) <= LONGEST_PART else f"{text[: LONGEST_PART - 1]}…"


def _printable(text: str) -> str:
    """One line in which a terminal finds nothing to obey."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in " ".join(text.split()))
