"""The conda descriptions are those that the lock file makes, and hold what the rules run."""

from __future__ import annotations

import ast
import re
import runpy
import sys
from functools import cache
from importlib.metadata import packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
TOOL = runpy.run_path(str(ROOT / "tools/conda_envs.py"))
SCRIPTS = [
    (environment, script)
    for rules in (ROOT / "workflow/rules").glob("*.smk")
    for environment, script in re.findall(
        r'conda:\s+"\.\./\.\./envs/(\w+)\.yaml".*?script:\s+"\.\./scripts/(\w+)\.py"',
        rules.read_text(encoding="utf-8"),
        re.DOTALL,
    )
]
OPTIONAL = {"mitsuba", "pygobject", "pyftdi"}
"""What some instruments and virtual spheres want besides."""
DISTRIBUTIONS = packages_distributions()


def test_environments_hold_the_versions_of_the_lock_file() -> None:
    made = TOOL["environments"]((ROOT / "requirements.lock").read_text(encoding="utf-8"))
    written = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "envs").glob("*.yaml")}
    assert written == made


@pytest.mark.parametrize(("environment", "script"), SCRIPTS)
def test_a_rules_environment_holds_what_its_script_imports(environment: str, script: str) -> None:
    held = set().union(*map(installed_with, TOOL["STAGES"][environment]))
    met = imported(ROOT / f"workflow/scripts/{script}.py")
    assert {name for name in met if not names_of(name) & held} == set()


@pytest.mark.parametrize("script", ["compare_with_truth", "write_sixteen_elements", "render"])
def test_what_mitsuba_makes_has_an_environment_with_mitsuba(script: str) -> None:
    (environment,) = {environment for environment, found in SCRIPTS if found == script}
    assert "mitsuba" in TOOL["STAGES"][environment]


@cache
def imported(path: Path) -> frozenset[str]:
    """Other people's modules that a file of the project executes, itself or through the package."""
    found: set[str] = set()
    waiting, met = [path], set()
    while waiting:
        file = waiting.pop()
        if file in met:
            continue
        met.add(file)
        for name in imports(file):
            package, *inner = name.split(".")
            if package == "pbrdf":
                base = ROOT.joinpath("workflow/pbrdf", *inner)
                waiting += [one for one in (base.with_suffix(".py"), base / "__init__.py") if one.is_file()]
            elif package not in sys.stdlib_module_names and package != "job":
                found.add(package)
    return frozenset(name for name in found if not names_of(name) & OPTIONAL)


def imports(path: Path) -> set[str]:
    """Full names that a file imports."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def names_of(module: str) -> set[str]:
    """Distributions that bring a module; Aravis' comes with PyGObject."""
    if module == "gi":
        return {"pygobject"}
    return {canonicalize_name(name) for name in DISTRIBUTIONS.get(module, [module])}


@cache
def installed_with(distribution: str) -> frozenset[str]:
    """A distribution, with those it requires itself."""
    needed = {Requirement(line) for line in requires(distribution) or []}
    always = {one.name for one in needed if not one.marker or one.marker.evaluate({"extra": ""})}
    return frozenset(canonicalize_name(name) for name in {distribution, *always})
