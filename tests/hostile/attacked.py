"""A reader let loose on a hostile file in a process of its own, and what becomes of it.

Run as a program, this is the server: it imports the readers once and forks for every file.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import IO

ALLOWANCE_BYTES = 48 << 20
"""What a reader may allocate beside the content: its own modules, threads and buffers."""
SECONDS = 10
FORBIDDEN = (
    "pickle.find_class",
    "subprocess.Popen",
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "socket.connect",
)
LONGEST_MESSAGE = 2000
CALM = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "1"}
"""One thread and one arena: what more of them would reserve counts as allocated."""
ANSWERS = 3
"""Where the server answers: libraries talk on the usual descriptors."""


class Attacked:
    """The server, seen from the tests."""

    def __enter__(self) -> Attacked:
        self._server = subprocess.Popen(
            [sys.executable, __file__],
            env=os.environ | CALM,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _stream(self._server.stdin).close()
        self._server.wait()
        _stream(self._server.stdout).close()

    def outcome(self, reader: str, path: Path) -> str:
        """``read``, ``refused: …``, or what must not be."""
        question = _stream(self._server.stdin)
        question.write(json.dumps([reader, str(path)]) + "\n")
        question.flush()
        answer = _stream(self._server.stdout).readline()
        return str(json.loads(answer))


def _stream(stream: IO[str] | None) -> IO[str]:
    assert stream is not None
    return stream


def judged(read: object, path: Path) -> str:
    """Read a file, and say what came of it."""
    from pbrdf.errors import InputError

    try:
        read(path)  # type: ignore[operator]
    except InputError as error:
        line = str(error)
        if ran_out_of_memory(error):
            return f"allocated too much: {line}"
        if not line.isprintable() or len(line) > LONGEST_MESSAGE:
            return f"refused in no fit line: {line[:200]!r} of {len(line)} characters"
        return f"refused: {line}"
    except BaseException as error:
        return f"raised {type(error).__name__}: {error}"
    return "read"


def ran_out_of_memory(error: BaseException | None) -> bool:
    """Whether a lack of memory lies behind an error."""
    while error is not None:
        if isinstance(error, MemoryError) or "bad_alloc" in str(error) or "MemoryError" in str(error):
            return True
        error = error.__cause__ or error.__context__
    return False


def limit_memory(path: Path, squeezed: int) -> None:
    """Allow no more memory than the content of a file or folder can need."""
    files = [file for file in path.rglob("*") if file.is_file()] if path.is_dir() else [path]
    room = ALLOWANCE_BYTES + squeezed * sum(file.stat().st_size for file in files)
    status = Path("/proc/self/status").read_text(encoding="ascii")
    used = int(status.partition("VmData:")[2].split()[0]) << 10
    resource.setrlimit(resource.RLIMIT_DATA, (used + room, used + room))


def _watch(folder: Path) -> None:
    """End the process if it unpickles, runs a program, connects, or opens a file elsewhere."""
    places = (
        folder,
        Path(sys.prefix),
        Path(sys.base_prefix),
        *map(Path, sys.path[1:]),
        Path("/proc"),
        Path("/sys"),
    )
    roots = tuple(str(place.resolve()) for place in places)

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event.startswith(FORBIDDEN):
            _answer_and_end(f"did {event}: {arguments!r}")
        if event == "open" and isinstance(arguments[0], str | bytes):
            opened = os.path.realpath(os.fsdecode(arguments[0]))
            if not opened.startswith(roots):
                _answer_and_end(f"opened {opened}")

    sys.addaudithook(hook)


def _answer(answer: str) -> None:
    os.write(ANSWERS, (json.dumps(answer) + "\n").encode())


def _answer_and_end(answer: str) -> None:
    _answer(answer)
    os._exit(0)


def _child(name: str, path: Path) -> None:
    from readers import READERS

    os.chdir(path.parent)
    signal.alarm(SECONDS)
    limit_memory(path, READERS[name].squeezed)
    _watch(path.parent)
    _answer_and_end(judged(READERS[name].read, path))


def main() -> None:
    """Answer a line with a line until there are no more."""
    import readers

    assert readers.READERS
    os.dup2(1, ANSWERS)
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    for line in sys.stdin:
        name, path = json.loads(line)
        pid = os.fork()
        if not pid:
            try:
                _child(name, Path(path))
            finally:
                os._exit(1)
        _, status = os.waitpid(pid, 0)
        if os.WIFSIGNALED(status):
            number = os.WTERMSIG(status)
            told = f"hung for {SECONDS} s" if number == signal.SIGALRM else f"died of signal {number}"
            _answer(told)
        elif os.WEXITSTATUS(status):
            _answer(f"left with status {os.WEXITSTATUS(status)}")


if __name__ == "__main__":
    main()
