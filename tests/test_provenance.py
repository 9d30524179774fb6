from __future__ import annotations

import ast
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import pbrdf
from pbrdf import provenance
from pbrdf.provenance import source_digest

SOURCE = Path(pbrdf.__file__).parent
STAGES = (
    "capture.images",
    "calibration.documents",
    "reconstruction.light",
    "tabulation.light",
    "tabulation.material",
    "fitting.material",
    "report.material",
)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the package for a test to change, and the digests of its stages taken from there."""
    copy = tmp_path / "pbrdf"
    shutil.copytree(SOURCE, copy, ignore=shutil.ignore_patterns("__pycache__", "*.so"))
    monkeypatch.setattr(provenance, "PACKAGE", copy)
    provenance._imports.cache_clear()
    yield copy
    provenance._imports.cache_clear()


def _digest(module: str) -> str:
    return source_digest(f"pbrdf.{module}")


def _follows(package: Path, module: str, file: str) -> bool:
    """Whether the digest of a module changes with a file that imports what it did, and returns with it."""
    before = _digest(module)
    content = (package / file).read_bytes()
    (package / file).write_bytes(content + b"\n")
    changed = _digest(module) != before
    (package / file).write_bytes(content)
    assert _digest(module) == before
    return changed


@pytest.mark.parametrize(
    ("module", "file"),
    [
        ("reconstruction.light", "reconstruction/light.py"),
        ("reconstruction.light", "reconstruction/mueller_image.py"),
        ("reconstruction.light", "reconstruction/reduction.py"),
        ("reconstruction.light", "reconstruction/__init__.py"),
        ("reconstruction.light", "optics/mueller.py"),
        ("reconstruction.light", "optics/__init__.py"),
        ("reconstruction.light", "calibration/polarimeter.py"),
        ("reconstruction.light", "formats/folders.py"),
        ("reconstruction.light", "errors.py"),
        ("calibration.documents", "calibration/sphere.py"),
        ("tabulation.material", "formats/table_zarr.py"),
        ("fitting.material", "fitting/objective.py"),
        ("fitting.material", "models/baek2018.py"),
        ("capture.images", "settings/plan.py"),
    ],
)
def test_a_module_that_is_executed_counts(package: Path, module: str, file: str) -> None:
    assert _follows(package, module, file)


@pytest.mark.parametrize(("file", "counts"), [("models/hyde2009.py", False), ("models/facets.py", True)])
def test_a_module_that_no_result_comes_from_does_not_count(package: Path, file: str, counts: bool) -> None:
    arguments = {"without": ["pbrdf.models.hyde2009"]}
    before = source_digest("pbrdf.fitting.material", **arguments)
    (package / file).write_text((package / file).read_text() + "\n")
    assert (source_digest("pbrdf.fitting.material", **arguments) != before) == counts


@pytest.mark.parametrize("other", ["report", "fitting", "settings", "models", "tabulation", "instruments"])
def test_reconstruction_depends_on_no_later_stage_nor_on_how_a_run_is_asked_for(
    package: Path, other: str
) -> None:
    files = [str(path.relative_to(package)) for path in (package / other).rglob("*") if path.is_file()]
    assert files
    assert [file for file in files if _follows(package, "reconstruction.light", file)] == []


@pytest.mark.parametrize("module", STAGES)
def test_no_stage_depends_on_the_command_line_or_on_what_the_package_opens(
    package: Path, module: str
) -> None:
    assert not _follows(package, module, "cli.py")
    assert not _follows(package, module, "__init__.py")
    assert not _follows(package, module, "settings/config.schema.yaml")


@pytest.mark.parametrize("template", sorted(p.name for p in (SOURCE / "report/templates").iterdir()))
def test_page_templates_count_for_pages_and_for_nothing_else(package: Path, template: str) -> None:
    assert _follows(package, "report.material", f"report/templates/{template}")
    assert not _follows(package, "fitting.material", f"report/templates/{template}")


def test_a_new_template_and_a_new_name_count(package: Path) -> None:
    before = _digest("report.material")
    (package / "report/templates/new.html.j2").write_text("")
    added = _digest("report.material")
    (package / "report/templates/new.html.j2").rename(package / "report/templates/other.html.j2")
    assert len({before, added, _digest("report.material")}) == 3


@pytest.mark.parametrize(
    ("module", "topics"),
    [
        ("reconstruction.light", {"exposures", "halves", "physicality", "processor", "solve"}),
        ("calibration.documents", {"processor"}),
        ("models.baek2018", {"facet", "facet_fit"}),
        ("formats.pbsdf", {"items"}),
    ],
)
def test_the_kernels_that_are_called_count_and_no_others(
    module: str, topics: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    digests = dict(provenance._kernels.digests)
    before = _digest(module)
    counted = set()
    for topic in digests:
        with monkeypatch.context() as patch:
            patch.setattr(provenance._kernels, "digests", digests | {topic: "changed"})
            if _digest(module) != before:
                counted.add(topic)
    assert counted == topics


@pytest.mark.parametrize(
    "line",
    [
        "from pbrdf._kernels import facet",
        "from pbrdf._kernels.facet import evaluate",
        "import pbrdf._kernels.facet",
        "def f():\n    from pbrdf._kernels import facet",
        "from pbrdf.models import baek2018",
        "import pbrdf.models.baek2018 as model",
    ],
)
def test_imports_are_followed_however_they_are_written(
    package: Path, line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (package / "formats/new.py").write_text(line + "\n")
    before = _digest("formats.new")
    changed = dict(provenance._kernels.digests) | {"facet": "changed"}
    monkeypatch.setattr(provenance._kernels, "digests", changed)
    assert _digest("formats.new") != before


@pytest.mark.parametrize("path", sorted(SOURCE.rglob("*.py")), ids=lambda path: str(path.relative_to(SOURCE)))
def test_no_module_imports_in_a_way_that_is_not_followed(path: Path) -> None:
    """Relative imports would be missed, and so would kernels reached through the package alone."""
    imports = [
        n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.ImportFrom)
    ]
    assert all(node.level == 0 for node in imports)
    whole = any(n.module == "pbrdf" and "_kernels" in {alias.name for alias in n.names} for n in imports)
    if whole and path != SOURCE / "provenance.py":
        assert any(node.module == "pbrdf._kernels" for node in imports)


def test_the_order_of_the_modules_does_not_matter() -> None:
    one = source_digest("pbrdf.fitting.material", "pbrdf.report.material")
    assert one == source_digest("pbrdf.report.material", "pbrdf.fitting.material")
    assert len(one) == 16
    assert int(one, 16) >= 0


def test_a_copy_elsewhere_has_the_same_digest(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copied = {module: _digest(module) for module in STAGES}
    provenance._imports.cache_clear()
    monkeypatch.setattr(provenance, "PACKAGE", SOURCE)
    assert copied == {module: _digest(module) for module in STAGES}


@pytest.mark.parametrize(
    "module",
    ["pbrdf.nothing", "pbrdf.fitting.nothing", "numpy", "numpy.linalg", "errors", "other.errors", ""],
)
def test_what_is_no_module_of_the_package_raises(module: str) -> None:
    with pytest.raises(ModuleNotFoundError):
        source_digest(module)
