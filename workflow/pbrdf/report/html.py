"""Templates filled in: every value is escaped, and none may be missing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from pbrdf.report.figures import number

TEMPLATES = Path(__file__).with_name("templates")


def render(template: str, *, scripts: Sequence[str] = (), **context: Any) -> str:
    """Fill in one of the page templates; `figure` writes its numbers.

    `scripts` are addresses beside the page: without them a page runs nothing.
    """
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["figure"] = _figure
    style = Markup((TEMPLATES / "style.css").read_text(encoding="utf-8"))
    return environment.get_template(template).render(style=style, scripts=scripts, **context)


def _figure(value: float, digits: int = 3, zeros: bool = False) -> str:
    return f"{value:,}".replace(",", "\u202f") if isinstance(value, int) else number(value, digits, zeros)
