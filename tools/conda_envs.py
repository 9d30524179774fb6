"""Write envs/*.yaml: the packages of each stage as conda environments, with the versions of the lock file.

Run by ``make envs``. The tested way is the virtual environment of the Makefile; these files describe
the same packages to people who use ``snakemake --sdm conda``.
"""

from __future__ import annotations

import re
from pathlib import Path

from packaging.markers import Marker

ROOT = Path(__file__).resolve().parents[1]
PYTHON = "3.11"
BASE = ("numpy", "scipy", "zarr", "numcodecs", "google-crc32c", "pyyaml", "jsonschema")
PHOTOGRAPHS = ("opencv-python-headless", "openexr")
PAGES = (*PHOTOGRAPHS, "nlopt", "jinja2", "matplotlib", "plotly", "rich")
STAGES = {
    "capture": (*BASE, *PHOTOGRAPHS, "pyserial", "rich"),
    "calibration": (*BASE, *PHOTOGRAPHS),
    "reconstruction": (*BASE, *PHOTOGRAPHS),
    "tabulation": (*BASE, *PHOTOGRAPHS, "xarray"),
    "fitting": (*BASE, "nlopt"),
    "report": (*BASE, *PAGES),
    "mitsuba": (*BASE, *PAGES, "mitsuba"),
}
PIN = re.compile(r"^([A-Za-z0-9._-]+)==([^ ;\\]+)(?: *; *([^\\]+?))? *\\?$", re.MULTILINE)


def locked_versions(lock: str) -> dict[str, str]:
    """Version by package that the lock file gives to `PYTHON`."""
    environment = {"python_version": PYTHON, "python_full_version": f"{PYTHON}.0"}
    return {
        name.lower(): version
        for name, version, marker in PIN.findall(lock)
        if not marker or Marker(marker).evaluate(environment)
    }


def environments(lock: str) -> dict[str, str]:
    """Content of ``envs/<stage>.yaml`` by stage."""
    versions = locked_versions(lock)
    texts = {}
    for stage, packages in STAGES.items():
        pins = "".join(f"      - {name}=={versions[name]}\n" for name in sorted(packages))
        texts[stage] = (
            "# Made from the lock file by tools/conda_envs.py; pbrdf itself: pip install --no-deps .\n"
            "channels:\n  - conda-forge\n  - nodefaults\n"
            f"dependencies:\n  - python={PYTHON}\n  - pip\n  - pip:\n{pins}"
        )
    return texts


if __name__ == "__main__":
    for stage, text in environments((ROOT / "requirements.lock").read_text(encoding="utf-8")).items():
        (ROOT / "envs" / f"{stage}.yaml").write_text(text, encoding="utf-8")
