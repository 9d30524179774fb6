"""How a table is to be fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from pbrdf.errors import InputError
from pbrdf.models.interface import CostKind

COST_UNITS = {CostKind.NORMS: "1/sr", CostKind.ROOTS: "1/√sr", CostKind.SQUARES: "1"}


class Thinning(StrEnum):
    """What stands for a block of neighbouring nodes."""

    NODES = "nodes"
    """Its first node."""
    BLOCKS = "blocks"
    """The mean of its measured nodes, each counted by its variance."""


@dataclass(frozen=True)
class FitOptions:
    """Options of a fit; the defaults are the choices of the supplement of Baek et al. 2020.

    Attributes
    ----------
    downsample : int
        Nodes along each side of a block that one matrix stands for; 1 takes every node.
    thinning : Thinning
        Which matrix that is.
    cost : CostKind
        What is summed over the nodes. `norms` is the supplement's "sum of square root of the
        differences" read as Frobenius norms, `roots` the same read element by element; `squares`
        weighs with the inverse of the table's variances.
    solid_angle : bool
        Weigh each node with the share of all pairs of directions that it stands for.
    held_out : bool
        Fit a second time without every tenth slab of θd and tell the error there.
    starts : int
        Searches to make; the best counts.
    seed : int
        Of the starts; the same seed gives the same result to the last bit.

    Raises
    ------
    InputError
        If a value makes no sense.
    """

    downsample: int = 4
    thinning: Thinning = Thinning.NODES
    cost: CostKind = CostKind.NORMS
    solid_angle: bool = False
    held_out: bool = False
    starts: int = 3
    seed: int = 0

    def __post_init__(self) -> None:
        for field, least in (("downsample", 1), ("starts", 1), ("seed", 0)):
            value = getattr(self, field)
            if value < least:
                raise InputError("fit", field, f"is {value}", f"give a whole number of at least {least}")

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> FitOptions:
        """Make options from plain values by name, as a config or a document holds them."""
        kinds: dict[str, type[StrEnum]] = {"thinning": Thinning, "cost": CostKind}
        members = {}
        for field, kind in kinds.items():
            if field not in plain:
                continue
            if plain[field] not in list(kind):
                problem = f"{plain[field]!r} is not known"
                raise InputError("fit", field, problem, f"give one of {', '.join(kind)}")
            members[field] = kind(plain[field])
        return cls(**{**plain, **members})

    def plain(self) -> dict[str, Any]:
        """Return plain values by name, as `of` takes them."""
        return {name: str(v) if isinstance(v, StrEnum) else v for name, v in asdict(self).items()}
