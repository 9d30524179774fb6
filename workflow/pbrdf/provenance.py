"""What a result depends on besides its inputs: the library's own source."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Collection, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from pbrdf import _kernels

PACKAGE = Path(__file__).parent


def source_digest(*modules: str, without: Collection[str] = ()) -> str:
    """Digest of the source that modules of this package execute.

    Follows their imports within the package; takes in the page templates beside the modules met, and
    the digests of the kernel topics they import. Schemas of the user's files do not count: what they
    let through reaches a result as a value.

    Parameters
    ----------
    *modules : str
        Full names, such as ``pbrdf.fitting.driver``.
    without : collection of str
        Modules that are imported, but that no result comes from: not followed and not counted.

    Returns
    -------
    str
        Sixteen hexadecimal digits; equal sources give equal digits wherever they are installed.

    Raises
    ------
    ModuleNotFoundError
        If a module is not part of the package.
    """
    met: set[str] = set()
    topics: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name in met or name in without:
            continue
        met.add(name)
        imports = _imports(name)
        topics |= imports.topics
        waiting += imports.modules
    digest = hashlib.sha256()
    for path in sorted(_sources(met | _packages(met))):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    for topic in sorted(topics):
        digest.update(_kernels.digests[topic].encode())
    return digest.hexdigest()[:16]


class Imports(NamedTuple):
    """Modules and kernel topics of this package that a module imports."""

    modules: frozenset[str]
    topics: frozenset[str]


@cache
def _imports(module: str) -> Imports:
    path = _file(module)
    if path is None:
        raise ModuleNotFoundError(f"{module} is not part of the package")
    found = set()
    for node in _statements(ast.parse(path.read_text(encoding="utf-8")).body):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    topics = {name.split(".")[2] for name in found if name.startswith("pbrdf._kernels.")}
    inner = {name for name in found if name.startswith("pbrdf.") and _file(name) is not None}
    return Imports(frozenset(inner), frozenset(topics))


def _statements(body: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """All statements, those within others included; an expression holds no import."""
    for statement in body:
        yield statement
        for part in ("body", "orelse", "finalbody", "handlers", "cases"):
            yield from _statements(getattr(statement, part, ()))


def _packages(modules: set[str]) -> set[str]:
    """The subpackages that modules lie in: each is executed with them, but only gathers names for others.

    What it gathers is not followed: a module that wants it imports it. The package's own ``__init__`` opens
    doors for users; no module of ours goes through it.
    """
    parts = [module.split(".") for module in modules]
    return {".".join(names[:end]) for names in parts for end in range(2, len(names))}


def _sources(modules: set[str]) -> set[Path]:
    paths = {path for path in map(_file, modules) if path is not None}
    folders = {path.parent for path in paths}
    return paths | {template for folder in folders for template in folder.glob("templates/*")}


def _file(module: str) -> Path | None:
    package, *inner = module.split(".")
    if package != "pbrdf":
        return None
    base = PACKAGE.joinpath(*inner)
    for path in (base.with_suffix(".py"), base / "__init__.py"):
        if path.is_file():
            return path
    return None
