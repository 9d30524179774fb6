"""Serial ports, by any URL that pyserial knows."""

from __future__ import annotations

import errno
from pathlib import Path

import serial
from serial.urlhandler.protocol_spy import FormatHexdump

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
        ``/dev/serial/by-id/…``, ``hwgrep://55000001`` for the port whose description or USB serial number has
        this in it, ``socket://host:port``, ``rfc2217://host:port``: what `serial_for_url` takes.
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
    # spy:// knows the system's own ports alone
    full = f"spy://{url}" if log is not None and "://" not in url else url
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
    if hasattr(port, "formatter"):
        port.formatter.output = output
    else:
        _spy(port, FormatHexdump(output, False))

    def close_both() -> None:
        close()
        output.close()

    port.close = close_both


def _spy(port: serial.SerialBase, formatter: FormatHexdump) -> None:
    """Have a port that spy:// does not know tell its bytes as that does."""
    read, write = port.read, port.write

    def told_read(size: int = 1) -> bytes:
        data: bytes = read(size)
        if data:
            formatter.rx(data)
        return data

    def told_write(data: bytes) -> int | None:
        formatter.tx(data)
        written: int | None = write(data)
        return written

    port.read, port.write = told_read, told_write


def _reason(error: Exception) -> tuple[str, str]:
    text = str(error).lower()
    if "lock" in text or "busy" in text or getattr(error, "errno", None) == errno.EBUSY:
        return "is in use by another program", "end that program; a port has one owner"
    if "permission" in text or getattr(error, "errno", None) == errno.EACCES:
        return "may not be opened by this user", "add the user to the group `dialout`"
    return f"cannot be opened ({error})", "see that it is plugged in, and name its port in the rig file"
