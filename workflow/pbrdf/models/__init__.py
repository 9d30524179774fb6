"""What answers with a Mueller matrix for a pair of directions: analytic models by name, and tables."""

from __future__ import annotations

from pbrdf.models.baek2018 import BAEK2018, BAEK2018_COMPLEX
from pbrdf.models.hyde2009 import HYDE2009, HYDE2009_COMPLEX, HYDE2009_DHR, HYDE2009_DHR_COMPLEX
from pbrdf.models.interface import CostKind, Model, NodeCost, Parameter

FAMILIES: dict[str, tuple[Model, ...]] = {
    "baek2018": (BAEK2018, BAEK2018_COMPLEX),
    "hyde2009": (HYDE2009, HYDE2009_COMPLEX, HYDE2009_DHR, HYDE2009_DHR_COMPLEX),
}
"""Models by the module that holds them."""

MODELS: dict[str, Model] = {model.name: model for models in FAMILIES.values() for model in models}

__all__ = ["FAMILIES", "MODELS", "CostKind", "Model", "NodeCost", "Parameter"]
