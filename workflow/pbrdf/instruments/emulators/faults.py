"""The back door by which an emulated instrument is made to fail."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass
class _Armed:
    fault: str
    after: int
    count: int
    value: Any


class Faults:
    """Faults of one instrument, armed by name.

    Parameters
    ----------
    armed : iterable of mapping, optional
        As a rig file has them: ``fault`` and, where wanted, ``after`` (occasions that pass before it),
        ``count`` (how often it strikes, 1 by default, -1 for ever) and ``value``.
    """

    def __init__(self, armed: Iterable[Mapping[str, Any]] = ()) -> None:
        self._armed: list[_Armed] = []
        self._lock = threading.Lock()
        for one in armed:
            self.arm(**one)

    def arm(self, fault: str, after: int = 0, count: int = 1, value: Any = None) -> None:
        """Let a fault strike; see the class for the parameters."""
        with self._lock:
            self._armed.append(_Armed(fault, after, count, value))

    def strikes(self, fault: str) -> bool:
        """Whether the fault strikes on this occasion, which counts as one."""
        return self.value(fault, absent=None, struck=True) is not None

    def value(self, fault: str, absent: Any, struck: Any = 0) -> Any:
        """The fault's value if it strikes on this occasion (`struck` if armed without one), else `absent`."""
        with self._lock:
            for one in self._armed:
                if one.fault != fault or one.count == 0:
                    continue
                if one.after > 0:
                    one.after -= 1
                    continue
                one.count -= 1
                return struck if one.value is None else one.value
        return absent
