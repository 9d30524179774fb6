"""Colours for angles that come back to where they began."""

from __future__ import annotations

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize

from pbrdf.report.figures import Float
from pbrdf.report.scales import LEVELS, Scale

CHROMA = 40.0
LIGHTNESS, SWING = 61.0, 20.0
"""Within what a screen can show, all around."""

_WHITE = np.array([0.95047, 1.0, 1.08883])
_XYZ_TO_LINEAR = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)


def half_turn(label: str) -> Scale:
    """Scale of axes in degrees, 0° and 180° being the same."""
    mappable = ScalarMappable(Normalize(0.0, 180.0), ListedColormap(hues(LEVELS), name="axes"))
    return Scale(mappable, label, tuple(range(0, 181, 30)))


def hues(levels: int) -> Float:
    """A closed ring of colours, shape (levels, 3), sRGB in 0…1.

    All have the same chroma in CIELAB, so that none is the grey of a pixel left out. Lightness rises
    from red to green, the two that dichromats confuse, so that theirs is a ring as well: of
    lightness, and of yellow and blue.
    """
    turn = 2 * np.pi * np.arange(levels) / levels
    lightness = LIGHTNESS - SWING * np.cos(turn)
    return _screen_colours(lightness, CHROMA * np.cos(turn), CHROMA * np.sin(turn))


def _screen_colours(lightness: Float, a: Float, b: Float) -> Float:
    """SRGB (IEC 61966-2-1) of CIELAB colours under D65."""
    fy = (lightness + 16) / 116
    f = np.stack([fy + a / 500, fy, fy - b / 200], axis=-1)
    xyz = _WHITE * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    linear = np.clip(xyz @ _XYZ_TO_LINEAR.T, 0.0, 1.0)
    encoded: Float = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return encoded
