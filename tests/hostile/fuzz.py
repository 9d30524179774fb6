"""Coverage-guided attack on every reader: ``fuzz.py SECONDS [READER...]``, in a process each.

Atheris follows which lines of the readers, and of the Python libraries below them, an input takes. What it
finds, it leaves in ``build/fuzz/<reader>``.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOUND = ROOT / "build/fuzz"
SLOWEST_S = 10


def attack(name: str, seconds: int) -> None:
    """Attack one reader; ends the process, with a status other than 0 if something was found."""
    import atheris

    with atheris.instrument_imports(include=["pbrdf", "zarr", "yaml", "csv", "json"]):
        from attacked import judged, limit_memory
        from readers import READERS

    reader = READERS[name]
    folder = Path(tempfile.mkdtemp(prefix=f"fuzz-{name}-"))
    path, corpus = folder / reader.name, folder / "corpus"
    corpus.mkdir()
    reader.write(path)
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    valid = {file: file.read_bytes() for file in files}
    for index, content in enumerate(valid.values()):
        (corpus / str(index)).write_bytes(bytes([index]) + content)
    limit_memory(path, reader.squeezed)

    def one(data: bytes) -> None:
        if not data:
            return
        # the first byte says which file of a folder is the hostile one
        file = files[data[0] % len(files)]
        file.write_bytes(data[1:])
        outcome = judged(reader.read, path)
        file.write_bytes(valid[file])
        if outcome != "read" and not outcome.startswith("refused: "):
            raise AssertionError(outcome)

    place = FOUND / name
    place.mkdir(parents=True, exist_ok=True)
    limits = [f"-max_total_time={seconds}", f"-timeout={SLOWEST_S}", "-max_len=65536", "-rss_limit_mb=0"]
    atheris.Setup([sys.argv[0], *limits, f"-artifact_prefix={place}/", str(corpus)], one)
    atheris.Fuzz()


def main(seconds: int, names: list[str]) -> int:
    """Attack readers one after another; gives the number of those in which something was found."""
    from attacked import CALM
    from readers import READERS

    harmed = []
    for name in names or READERS:
        command = [sys.executable, __file__, "--one", str(seconds), name]
        run = subprocess.run(command, env=os.environ | CALM, stderr=subprocess.PIPE, text=True, check=False)
        lines = [line for line in run.stderr.splitlines() if line.startswith("Done") or "ssertion" in line]
        print(f"{name}: {lines[-1] if lines else run.stderr[-300:]}", flush=True)
        if run.returncode:
            harmed.append(name)
        else:
            shutil.rmtree(FOUND / name)
    print(f"something was found in {', '.join(harmed)}: see {FOUND}" if harmed else "nothing was found")
    return len(harmed)


if __name__ == "__main__":
    if sys.argv[1] == "--one":
        attack(sys.argv[3], int(sys.argv[2]))
    else:
        sys.exit(main(int(sys.argv[1]), sys.argv[2:]) > 0)
