"""The cost of Baek's model with a real index and its gradient, as one writes them in NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.frames import angle_between, normalised, table_axis

Float = NDArray[np.float64]


def _transmission(c: Float, s2: Float, eta: float) -> tuple[Float, Float, Float, Float]:
    """Mean and half difference of Ts and Tp, and their slopes by the index."""
    w = np.sqrt(eta**2 - s2)
    w_slope = eta / w
    u = 1 / (c * w + s2)
    ts = 4 * c * w / (c + w) ** 2
    ts_slope = 4 * c * (c - w) / (c + w) ** 3 * w_slope
    ratio = (eta * u) ** 2
    ratio_slope = 2 * eta * u**2 * (1 - eta * u * c * w_slope)
    tp, tp_slope = ts * ratio, ts_slope * ratio + ts * ratio_slope
    return (ts + tp) / 2, (ts - tp) / 2, (ts_slope + tp_slope) / 2, (ts_slope - tp_slope) / 2


class NumpyBaek:
    """Nodes with their geometry; `cost_gradient` compares the model with one band."""

    def __init__(self, to_light: Float, to_camera: Float) -> None:
        normal = np.array([0.0, 0.0, 1.0])
        half = normalised(to_light + to_camera)
        s = table_axis(to_light, to_camera)
        turn_i = 2 * angle_between(normalised(np.cross(normal, -to_light)), s, -to_light)
        turn_o = 2 * angle_between(normalised(np.cross(normal, to_camera)), s, to_camera)
        self.cos_i, self.cos_o = to_light[:, 2].copy(), to_camera[:, 2].copy()
        self.cos2_h, self.cos_d = half[:, 2] ** 2, np.sum(half * to_light, axis=-1)
        self.sin2_i, self.sin2_o, self.sin2_h, self.sin2_d = (
            1 - c2 for c2 in (self.cos_i**2, self.cos_o**2, self.cos2_h, self.cos_d**2)
        )
        self.turn_i, self.turn_o = (np.stack([np.cos(t), -np.sin(t)]) for t in (turn_i, turn_o))

    def _lobe(self, alpha: float) -> tuple[Float, Float]:
        a2 = alpha**2
        root_i = np.sqrt(self.cos_i**2 + a2 * self.sin2_i)
        root_o = np.sqrt(self.cos_o**2 + a2 * self.sin2_o)
        mask_i, mask_o = 1 / (self.cos_i + root_i), 1 / (self.cos_o + root_o)
        q = 1 / (a2 * self.cos2_h + self.sin2_h)
        lobe = a2 / np.pi * q**2 * mask_i * mask_o
        falls = 4 * self.cos2_h * q + self.sin2_i * mask_i / root_i + self.sin2_o * mask_o / root_o
        return lobe, lobe * (2 / alpha - alpha * falls)

    def _mirror(self, eta: float) -> tuple[Float, Float]:
        """Even, odd and cross part of Fresnel's matrix and their slopes by the index, each (3, n)."""
        c, s2 = self.cos_d, self.sin2_d
        w = np.sqrt(eta**2 - s2)
        w_slope = eta / w
        rs, rs_slope = (c - w) / (c + w), -2 * c / (c + w) ** 2 * w_slope
        u = 1 / (s2 + c * w)
        ratio, ratio_slope = (s2 - c * w) * u, -2 * c * s2 * u**2 * w_slope
        rp, rp_slope = rs * ratio, rs_slope * ratio + rs * ratio_slope
        ss, pp = rs * rs_slope, rp * rp_slope
        values = np.stack([(rs**2 + rp**2) / 2, (rs**2 - rp**2) / 2, rs * rp])
        return values, np.stack([ss + pp, ss - pp, rs_slope * rp + rs * rp_slope])

    @staticmethod
    def _stokes(c: Float, s2: Float, turn: Float, eta: float) -> tuple[Float, Float]:
        mean, difference, mean_slope, difference_slope = _transmission(c, s2, eta)
        return (
            np.stack([mean, *(difference * turn)]),
            np.stack([mean_slope, *(difference_slope * turn)]),
        )

    def cost_gradient(
        self, mueller: Float, parameters: dict[str, float], epsilon: float
    ) -> tuple[float, Float]:
        """Sum of norms against matrices (4, 4, n) and its gradient by alpha, eta, specular and albedo."""
        specular, diffuse = parameters["specular"], parameters["albedo"] / np.pi
        lobe, lobe_slope = self._lobe(parameters["alpha"])
        mirror, mirror_slope = self._mirror(parameters["eta"])
        stokes_in, in_slope = self._stokes(self.cos_i, self.sin2_i, self.turn_i, parameters["eta"])
        stokes_out, out_slope = self._stokes(self.cos_o, self.sin2_o, self.turn_o, parameters["eta"])

        residual = -mueller
        even, odd, cross = specular * lobe * mirror
        residual[0, 0] += even
        residual[1, 1] += even
        residual[0, 1] += odd
        residual[1, 0] += odd
        residual[2, 2] += cross
        residual[3, 3] += cross
        residual[:3, :3] += diffuse * stokes_out[:, None] * stokes_in[None]
        norm = np.sqrt(np.einsum("ijn,ijn->n", residual, residual) + epsilon**2)
        residual /= norm
        parts = np.stack(
            [
                residual[0, 0] + residual[1, 1],
                residual[0, 1] + residual[1, 0],
                residual[2, 2] + residual[3, 3],
            ]
        )
        on_mirror = np.einsum("kn,kn->n", mirror, parts)
        on_mirror_slope = np.einsum("kn,kn->n", mirror_slope, parts)
        to_out = np.einsum("ijn,jn->in", residual[:3, :3], stokes_in)
        to_in = np.einsum("ijn,in->jn", residual[:3, :3], stokes_out)
        on_diffuse = np.einsum("in,in->", to_out, stokes_out)
        on_diffuse_slope = np.einsum("in,in->", to_out, out_slope) + np.einsum("jn,jn->", to_in, in_slope)
        gradient = np.array(
            [
                specular * np.dot(lobe_slope, on_mirror),
                specular * np.dot(lobe, on_mirror_slope) + diffuse * on_diffuse_slope,
                np.dot(lobe, on_mirror),
                on_diffuse / np.pi,
            ]
        )
        return float(norm.sum()), gradient
