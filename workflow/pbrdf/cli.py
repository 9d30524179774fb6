"""The command line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib.metadata import version

from pbrdf.commands import photographs, tables
from pbrdf.errors import InputError

FAILED = 2
COMMANDS = (*photographs.COMMANDS, *tables.COMMANDS)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process if absent.

    Returns
    -------
    int
        0, or 2 after one line on stderr that names file, field and remedy.
    """
    arguments = _parser().parse_args(argv)
    try:
        arguments.run(arguments)
    except InputError as error:
        print(f"pbrdf: {error}", file=sys.stderr)
        return FAILED
    except OSError as error:
        path = error.filename2 or error.filename
        print(f"pbrdf: {path}: {error.strerror}; check the path and its rights", file=sys.stderr)
        return FAILED
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="pbrdf",
        description="From polarised photographs of a sphere to a polarimetric BRDF.",
        epilog="pbrdf COMMAND --help has examples.",
    )
    parser.add_argument("--version", action="version", version=f"pbrdf {version('pbrdf')}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for command in COMMANDS:
        sub = commands.add_parser(
            command.name,
            help=command.summary,
            description=command.summary[0].upper() + command.summary[1:] + ".",
            epilog="examples:\n" + command.examples,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.add_arguments(sub)
        sub.set_defaults(run=command.run)
    return parser
