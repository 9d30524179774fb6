"""Let this virtual environment see the packages of another, behind its own: ``see_packages.py PYTHON``.

A path of the other that is itself named by a ``.pth`` file there, such as an editable install, is not seen.
"""

from __future__ import annotations

import site
import subprocess
import sys
from pathlib import Path

if __name__ == "__main__":
    command = [sys.argv[1], "-c", "import site; print(site.getsitepackages()[0])"]
    packages = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    Path(site.getsitepackages()[0], "packages.pth").write_text(packages, encoding="utf-8")
