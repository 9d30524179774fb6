"""Verdicts on a measurement, put together from what there is to say of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

LEVELS = GOOD, FAIR, POOR, UNUSABLE = ("good", "fair", "poor", "unusable")


@dataclass(frozen=True)
class Finding:
    """One thing that is worth a word: how bad it is, one of `LEVELS`, and the words."""

    level: str
    words: str


def judged(told: str, findings: Iterable[Finding]) -> dict[str, Any]:
    """Entries ``verdict`` and ``usable`` of a document.

    The verdict is one line: the level of the worst finding, what is told in any case, and the findings of
    that level.
    """
    found = list(findings)
    worst = max((finding.level for finding in found), key=LEVELS.index, default=GOOD)
    words = [finding.words for finding in found if finding.level == worst]
    return {"verdict": f"{worst}: {'; '.join([told, *words])}", "usable": worst != UNUSABLE}


def graded(value: float, *thresholds: tuple[float, str], words: str) -> list[Finding]:
    """The finding whose threshold a value exceeds last, of thresholds that ascend; none below the first."""
    exceeded = [level for threshold, level in thresholds if value > threshold]
    return [Finding(exceeded[-1], words)] if exceeded else []
