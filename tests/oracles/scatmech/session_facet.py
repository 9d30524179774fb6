"""Mueller matrices of SCATMECH's shadowed facet model: JSON in, JSON out."""

import json
import math
import sys

from pySCATMECH.brdf import BRDF_Model

asked = json.load(sys.stdin)
model = BRDF_Model(
    "Shadowed_Facet_BRDF_Model",
    {
        "lambda": 0.55,
        "type": 0,
        "substrate": f"({asked['eta']!r},{asked['kappa']!r})",
        "sdf": {None: "Gaussian_Slope_Distribution_Function", "s": repr(math.sqrt(2) * asked["sigma"])},
        "stack": "No_StackModel",
        "shadow": {None: "Torrance_Sparrow_Shadow_Function"},
    },
)
matrices = [model.MuellerBRDF(*angles).tolist() for angles in asked["angles"]]
print(json.dumps(matrices))
