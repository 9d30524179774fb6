"""The microfacet pBRDF of Baek et al. 2018 with one roughness for all bands.

Specular: GGX distribution, Smith's separable masking and Fresnel's reflection at the half vector.
Diffuse: Fresnel's transmission into the surface, full depolarisation, transmission out of it. For
five bands these are 16 parameters: the roughness and, per band, the specular weight, the albedo
and the (real) index. The complex form takes the index n − ik in both terms, transmission being what
is not reflected: 21 parameters, for metals, whose M23 and M32 no real index makes.

`BAEK2018_BECKMANN` has Beckmann's distribution, as Mitsuba's ``pplastic`` has by default.
"""

from __future__ import annotations

import numpy as np

from pbrdf.models.facets import FacetModel, facet_parameters
from pbrdf.models.interface import Parameter

_M00 = "specular · D G (Rs + Rp) / (8 cosθi cosθo) + albedo/π · T(θi) T(θo), T = (Ts + Tp)/2"


def _roughness(distribution: str) -> Parameter:
    starts = tuple(float(a) for a in np.geomspace(0.012, 0.9, 14))
    return Parameter("alpha", f"{distribution} roughness", "1", 0.01, 1.0, True, False, starts)


BAEK2018 = FacetModel("baek2018", "baek_ggx", _M00, facet_parameters(_roughness("GGX"), complex_index=False))
BAEK2018_COMPLEX = FacetModel(
    "baek2018_complex", "baek_ggx", _M00, facet_parameters(_roughness("GGX"), complex_index=True)
)
BAEK2018_BECKMANN = FacetModel(
    "baek2018_beckmann", "baek_beckmann", _M00, facet_parameters(_roughness("Beckmann"), complex_index=False)
)
