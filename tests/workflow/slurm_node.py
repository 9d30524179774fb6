"""A SLURM cluster of one node, this machine, for as long as a test takes.

Debian's packages `slurm-wlm` and `munge`, without accounting and cgroups, everything in a folder of its own
but ``/etc/slurm/slurm.conf``: the executor takes every ``SLURM_…`` variable away before its inner
``srun``, which then looks there alone.
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "srun", "sinfo", "squeue", "scancel")
CONFIGURATION = Path("/etc/slurm/slurm.conf")
PREFIX = "slurm-"
START_S = 60.0
CORES = os.cpu_count() or 1
MEMORY_MB = 6000


def missing() -> str | None:
    """Why no cluster can be started here; None if one can."""
    lost = [program for program in PROGRAMS if shutil.which(program) is None]
    if lost:
        return f"there is no {', '.join(lost)}: apt-get install slurm-wlm munge"
    if os.geteuid() != 0:
        return "only root can start SLURM's daemons"
    if CONFIGURATION.exists() and not _is_left_behind():
        return f"this machine belongs to a cluster already ({CONFIGURATION})"
    return None


def _is_left_behind() -> bool:
    """Whether the configuration is that of a test that was killed: its controller has gone."""
    home = CONFIGURATION.resolve().parent
    if home.parent != Path(tempfile.gettempdir()).resolve() or not home.name.startswith(PREFIX):
        return False
    try:
        controller = int((home / "slurmctld.pid").read_text(encoding="utf-8"))
    except FileNotFoundError:
        return True
    return not Path(f"/proc/{controller}").exists()


@contextmanager
def cluster() -> Iterator[Path]:
    """Start munged, slurmctld and slurmd; gives the folder of their logs once the node is idle."""
    # munged refuses a folder that others cannot enter, as pytest's are
    home = Path(tempfile.mkdtemp(prefix=PREFIX))
    home.chmod(0o755)
    with ExitStack() as ends:
        ends.callback(shutil.rmtree, home, ignore_errors=True)
        _start_munge(home, ends)
        CONFIGURATION.parent.mkdir(parents=True, exist_ok=True)
        # one left behind by a killed test
        CONFIGURATION.unlink(missing_ok=True)
        (home / "slurm.conf").write_text(_configuration(home), encoding="utf-8")
        CONFIGURATION.symlink_to(home / "slurm.conf")
        ends.callback(CONFIGURATION.unlink, missing_ok=True)
        for name in ("state", "spool"):
            (home / name).mkdir()
        _start(home, ends, "slurmctld", "-D", "-c")
        _start(home, ends, "slurmd", "-D", "-N", socket.gethostname())
        _await_idle(home)
        yield home


def _configuration(home: Path) -> str:
    host = socket.gethostname()
    return "\n".join(
        [
            "ClusterName=one",
            f"SlurmctldHost={host}(127.0.0.1)",
            "SlurmUser=root",
            "SlurmdUser=root",
            f"AuthInfo=socket={home}/munge/munge.sock",
            f"StateSaveLocation={home}/state",
            f"SlurmdSpoolDir={home}/spool",
            f"SlurmctldPidFile={home}/slurmctld.pid",
            f"SlurmdPidFile={home}/slurmd.pid",
            "ProctrackType=proctrack/linuxproc",
            "TaskPlugin=task/none",
            "JobAcctGatherType=jobacct_gather/none",
            "AccountingStorageType=accounting_storage/none",
            "SelectType=select/cons_tres",
            "SelectTypeParameters=CR_Core_Memory",
            "SlurmdParameters=config_overrides",
            "ReturnToService=2",
            "MinJobAge=300",
            f"NodeName={host} NodeAddr=127.0.0.1 CPUs={CORES} RealMemory={MEMORY_MB} State=UNKNOWN",
            "PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP",
            "",
        ]
    )


def _start_munge(home: Path, ends: ExitStack) -> None:
    folder = home / "munge"
    folder.mkdir(mode=0o755)
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)
    for path in (folder, key):
        shutil.chown(path, "munge", "munge")
    as_munge = ["setpriv", "--reuid", "munge", "--regid", "munge", "--clear-groups"]
    files = {
        "key-file": "munge.key",
        "socket": "munge.sock",
        "pid-file": "pid",
        "log-file": "log",
        "seed-file": "seed",
    }
    options = [f"--{option}={folder / name}" for option, name in files.items()]
    _start(home, ends, *as_munge, "munged", "--foreground", "--force", *options)
    deadline = time.monotonic() + START_S
    while not (folder / "munge.sock").exists():
        _require_time(home, deadline)


def _start(home: Path, ends: ExitStack, *command: str) -> None:
    log = ends.enter_context((home / f"{Path(command[-1]).name}.{command[0]}.log").open("wb"))
    process = subprocess.Popen(command, stdout=log, stderr=log, cwd=home)
    ends.callback(_end, process)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(20)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _await_idle(home: Path) -> None:
    deadline = time.monotonic() + START_S
    while True:
        told = subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True, check=False)
        if told.stdout.strip() == "idle":
            return
        _require_time(home, deadline)


def _require_time(home: Path, deadline: float) -> None:
    if time.monotonic() > deadline:
        logs = "\n".join(path.read_text(errors="replace")[-2000:] for path in home.glob("*.log"))
        raise TimeoutError(f"SLURM does not start:\n{logs}")
    time.sleep(0.2)
