"""The geometrical-optics pBRDF of Hyde et al. 2009 with one roughness for all bands.

Specular: facets with Gaussian slopes of standard deviation σ, Blinn's shadowing of V-grooves and
Fresnel's reflection at the half vector. Diffuse: a depolariser, which fills M00 alone. In the forms
with ``dhr`` it is weighted, as in the paper, by what single reflections of a perfect conductor of the
same roughness leave of the light from θi: 1 − ρ(θi; σ) with the directional-hemispherical reflectance
ρ. That weight knows the light's angle alone, so that these forms are not reciprocal. ρ comes from a
series (``tools/grooved_metal.py``) that is within 5e-4 of its integral.

A real index makes 16 parameters for five bands, a complex one 21.
"""

from __future__ import annotations

import numpy as np

from pbrdf.models.facets import FacetModel, facet_parameters
from pbrdf.models.interface import Parameter

_SIGMA = Parameter(
    "sigma",
    "standard deviation of the facets' slopes",
    "1",
    0.01,
    0.7,
    shared=True,
    linear=False,
    start=tuple(float(s) for s in np.geomspace(0.0112, 0.64, 14)),
)

_M00 = "specular · D G (Rs + Rp) / (8 cosθi cosθo) + albedo/π"
_M00_DHR = "specular · D G (Rs + Rp) / (8 cosθi cosθo) + albedo/π · (1 − ρ(θi; σ))"

_REAL = facet_parameters(_SIGMA, complex_index=False)
_COMPLEX = facet_parameters(_SIGMA, complex_index=True)

HYDE2009 = FacetModel("hyde2009", "hyde", _M00, _REAL)
HYDE2009_COMPLEX = FacetModel("hyde2009_complex", "hyde", _M00, _COMPLEX)
HYDE2009_DHR = FacetModel("hyde2009_dhr", "hyde_weighted", _M00_DHR, _REAL)
HYDE2009_DHR_COMPLEX = FacetModel("hyde2009_dhr_complex", "hyde_weighted", _M00_DHR, _COMPLEX)
