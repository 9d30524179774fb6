"""Serial ports, by any URL that pyserial knows."""

from __future__ import annotations

import errno
from pathlib import Path

import serial

from pbrdf.errors import InstrumentError


def open_port(
    url: str,
    instrument: str,
    baudrate: int,
    *,
    rtscts: bool = False,
    timeout_s: float = 1.0,
    log: str | Path | None = None,
) -> serial.SerialBase:
    """Open a port that nobody else may have open.

    Parameters
    ----------
    url : str
        ``/dev/serial/by-id/…``, ``socket://host:port``, ``rfc2217://host:port``: what `serial_for_url` takes.
    instrument : str
        What should be there, for messages.
    baudrate : int
    rtscts : bool
        Whether the two ends keep each other waiting by wire.
    timeout_s : float
        Longest wait for bytes, and for room to write them.
    log : str or Path, optional
        File to which every byte in either direction is added.

    Raises
    ------
    InstrumentError
        If the port does not exist, may not be opened, or is in use, or the log cannot be written.
    """
    full = url if log is None else f"spy://{url}"
    try:
        port = serial.serial_for_url(
            full, baudrate=baudrate, rtscts=rtscts, timeout=timeout_s, write_timeout=timeout_s, exclusive=True
        )
    except (serial.SerialException, OSError, ValueError) as error:
        raise InstrumentError(f"{instrument} at {url}", "port", *_reason(error)) from None
    if log is not None:
        try:
            _add_to_log(port, Path(log))
        except OSError as error:
            port.close()
            problem = f"{log} cannot be written ({error.strerror})"
            raise InstrumentError(f"{instrument} at {url}", "log", problem, "name another file") from None
    return port


def set_rts(port: serial.SerialBase, on: bool) -> None:
    """Raise or lower the line where there is one: pseudo-terminals and sockets have none."""
    try:
        port.rts = on
    except OSError as error:
        if error.errno not in (errno.ENOTTY, errno.EINVAL):
            raise


def _add_to_log(port: serial.SerialBase, log: Path) -> None:
    # left to itself spy:// empties the file, even where the port is then refused, and never closes it
    output = log.open("a")
    close = port.close
    port.formatter.output = output

    def close_both() -> None:
        close()
        output.close()

    port.close = close_both


def _reason(error: Exception) -> tuple[str, str]:
    text = str(error).lower()
    if "lock" in text or "busy" in text or getattr(error, "errno", None) == errno.EBUSY:
        return "is in use by another program", "end that program; a port has one owner"
    if "permission" in text or getattr(error, "errno", None) == errno.EACCES:
        return "may not be opened by this user", "add the user to the group `dialout`"
    return f"cannot be opened ({error})", "see that it is plugged in, and name its port in the rig file"
