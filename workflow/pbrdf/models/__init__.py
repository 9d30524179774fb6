"""What answers with a Mueller matrix for a pair of directions: analytic models by name, and tables."""

from __future__ import annotations

from pbrdf.models.baek2018 import BAEK2018
from pbrdf.models.interface import CostKind, Model, NodeCost, Parameter

MODELS: dict[str, Model] = {model.name: model for model in (BAEK2018,)}

__all__ = ["MODELS", "CostKind", "Model", "NodeCost", "Parameter"]
