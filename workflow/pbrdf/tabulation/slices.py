"""What one light says of the table: a slice over θh and φd at nearly constant θd.

The camera and the light stand still during a light's photographs, so the half vector hardly changes
over the image, and every pixel shows nearly the same θd: one light is one slice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
import zarr.codecs
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder
from pbrdf.optics.arm import Arm, Vector
from pbrdf.optics.frames import change_frames
from pbrdf.optics.mueller import rotator
from pbrdf.reconstruction.noise import NoiseModel
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.surface import SurfacePoints, node_points

SCHEMA = "pbrdf/slice/1"
_ARRAYS = ("mueller", "variance", "count", "theta_d")
_MAKE_AGAIN = "make the slice again"
Float = NDArray[np.float64]


@dataclass(frozen=True)
class Slice:
    """One light's share of the table.

    Attributes
    ----------
    angle_deg : float
        Angle of the arm.
    bands_nm : tuple of int
    mueller, variance : ndarray, shape (B, H, P, 4, 4), float32
        1/sr, table frames; NaN where the light shows nothing of the node.
    count : ndarray, shape (B, H, P), uint16
        1 where the node is seen.
    theta_d : ndarray, shape (H, P), float64
        θd at which the node is actually seen, radians.
    """

    angle_deg: float
    bands_nm: tuple[int, ...]
    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    count: NDArray[np.uint16]
    theta_d: Float


@dataclass(frozen=True)
class Viewpoint:
    """Everything geometric about one light: who looks from where at what."""

    camera: Camera
    sphere: Sphere
    arm: Arm
    angle_deg: float
    analyser_axis: Vector


@dataclass(frozen=True)
class BandImage:
    """Mueller image of a band (`pbrdf.formats.mueller_exr`), its noise, and what turns DN/s into 1/sr."""

    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    first: tuple[int, int]
    noise: NoiseModel
    scale: float


def make_slice(view: Viewpoint, images: Mapping[int, BandImage], axes: Axes, grazing_deg: float) -> Slice:
    """Slice of one light.

    Parameters
    ----------
    view : Viewpoint
    images : mapping of int to BandImage
        By band centre, nm.
    axes : Axes
        Nodes of the table.
    grazing_deg : float
        Nodes whose light or camera stands lower than this from the normal are left out, degrees.

    Notes
    -----
    Turning the frames mixes elements whose noise is correlated: the images' variances say how large
    it is, their noise model how the elements hang together.
    """
    light = view.arm.light_position(view.angle_deg)
    points = node_points(view.sphere, light, axes.theta_h[:, None], axes.phi_d[None, :])
    limit = np.cos(np.deg2rad(grazing_deg))
    seen = (points.cos_light > limit) & (points.cos_camera > limit)
    angle_in, angle_out = points.frame_angles(view.arm.generator_x(view.angle_deg), view.analyser_axis)
    column, row = view.camera.project(points.position_mm)
    shape = (len(images), *seen.shape)
    mueller = np.full((*shape, 4, 4), np.nan, np.float32)
    variance = np.full((*shape, 4, 4), np.nan, np.float32)
    for index, image in enumerate(images.values()):
        sample = _bilinear(image, row[seen], column[seen])
        gain = _inverse_irradiance(points, seen)[:, None, None] / image.scale
        angles = (angle_in[seen], angle_out[seen])
        mueller[index][seen] = change_frames(sample.mueller.reshape(-1, 4, 4), *angles) * gain
        variance[index][seen] = _turned_variance(sample, image.noise, *angles) * gain**2
    count = np.isfinite(mueller[..., 0, 0]).astype(np.uint16)
    return Slice(view.angle_deg, tuple(images), mueller, variance, count, points.theta_d)


def write_slice(path: str | Path, part: Slice) -> None:
    """Write a slice as a Zarr store, beside and then renamed."""
    with replace_folder(path) as beside:
        attributes: dict[str, Any] = {
            "schema": SCHEMA,
            "angle_deg": part.angle_deg,
            "bands_nm": list(part.bands_nm),
        }
        group = zarr.open_group(beside, mode="w", attributes=attributes)
        squeeze = [zarr.codecs.ZstdCodec(level=1), zarr.codecs.Crc32cCodec()]
        for name in _ARRAYS:
            array = getattr(part, name)
            chunk = array.shape if name == "theta_d" else (1, *array.shape[1:])
            # a chunk that is always there is one whose loss can be noticed
            group.create_array(
                name, data=array, chunks=chunk, compressors=squeeze, config={"write_empty_chunks": True}
            )


def read_slice(path: str | Path) -> Slice:
    """Read a slice; raises `InputError` if it is missing or damaged."""
    group = _opened(path)
    angle_deg, bands_nm = _header(path, group)
    arrays = {name: _content(path, group, name) for name in _ARRAYS}
    grid = (len(bands_nm), *arrays["theta_d"].shape)
    for name, shape in (("mueller", (*grid, 4, 4)), ("variance", (*grid, 4, 4)), ("count", grid)):
        if arrays[name].shape != shape:
            problem = f"has shape {arrays[name].shape} where bands and nodes say {shape}"
            raise InputError(path, name, problem, _MAKE_AGAIN)
    return Slice(angle_deg, bands_nm, **arrays)


def slice_angle_deg(path: str | Path) -> float:
    """Angle of the arm of a slice, degrees; raises `InputError` if there is no slice."""
    return _header(path, _opened(path))[0]


def _opened(path: str | Path) -> zarr.Group:
    try:
        group = zarr.open_group(Path(path), mode="r")
    except (OSError, ValueError) as error:
        raise InputError(path, "store", f"cannot be opened ({error})", _MAKE_AGAIN) from None
    if group.attrs.get("schema") != SCHEMA:
        raise InputError(path, "schema", f"is not {SCHEMA}", _MAKE_AGAIN)
    return group


def _header(path: str | Path, group: zarr.Group) -> tuple[float, tuple[int, ...]]:
    """Angle of the arm and bands."""
    angle_deg, bands_nm = group.attrs.get("angle_deg"), group.attrs.get("bands_nm")
    if not isinstance(angle_deg, int | float) or not np.isfinite(angle_deg):
        raise InputError(path, "angle_deg", f"is {angle_deg}, not an angle", _MAKE_AGAIN)
    if not isinstance(bands_nm, list) or not all(isinstance(nm, int) for nm in bands_nm):
        raise InputError(path, "bands_nm", f"is {bands_nm}, not a list of whole nm", _MAKE_AGAIN)
    return float(angle_deg), tuple(bands_nm)


def _content(path: str | Path, group: zarr.Group, name: str) -> NDArray[Any]:
    """All values of an array whose chunks are all there."""
    try:
        array = group[name]
        if not isinstance(array, zarr.Array):
            raise TypeError("not an array")
        lost = array.nchunks - array.nchunks_initialized
        content: NDArray[Any] = np.asarray(array[...])
    # a missing array, JSON, Zarr's metadata, the codec and the checksum each raise a type of their own
    except Exception as error:
        problem = f"is damaged ({type(error).__name__}: {error})"
        raise InputError(path, name, problem, _MAKE_AGAIN) from error
    if lost:
        raise InputError(path, name, f"has lost {lost} of {array.nchunks} chunks", _MAKE_AGAIN)
    return content


def _inverse_irradiance(points: SurfacePoints, seen: NDArray[np.bool_]) -> Float:
    """d² / cosθi, m²: what the light's distance and slant took away."""
    metres = points.light_distance_mm[seen] * 1e-3
    inverse: Float = metres**2 / points.cos_light[seen]
    return inverse


@dataclass(frozen=True)
class _Sample:
    """Matrices and variances (n, 16) between pixels, and those pixels' mean weighted as variances are."""

    mueller: Float
    variance: Float
    behind: Float


def _bilinear(image: BandImage, row: Float, column: Float) -> _Sample:
    """Between the four pixels around each place; NaN beyond the window."""
    _, rows, columns = image.mueller.shape
    row, column = row - image.first[0], column - image.first[1]
    inside = (row >= 0) & (column >= 0) & (row <= rows - 1) & (column <= columns - 1)
    r = np.clip(np.floor(row).astype(np.intp), 0, rows - 2)
    c = np.clip(np.floor(column).astype(np.intp), 0, columns - 2)
    fr, fc = row - r, column - c
    values, spread, behind = np.zeros((3, 16, row.size))
    squares = np.zeros(row.size)
    for dr, dc, weight in (
        (0, 0, (1 - fr) * (1 - fc)),
        (0, 1, (1 - fr) * fc),
        (1, 0, fr * (1 - fc)),
        (1, 1, fr * fc),
    ):
        pixel = image.mueller[:, r + dr, c + dc]
        values += weight * pixel
        behind += weight**2 * pixel
        spread += weight**2 * image.variance[:, r + dr, c + dc]
        squares += weight**2
    values[:, ~inside] = np.nan
    spread[:, ~inside] = np.nan
    return _Sample(values.T, spread.T, (behind / squares).T)


def _turned_variance(sample: _Sample, noise: NoiseModel, angle_in: Float, angle_out: Float) -> Float:
    """Variances (n, 4, 4) of the sampled matrices in turned frames."""
    turned = np.full(sample.variance.shape, np.nan)
    known = np.isfinite(sample.variance).all(axis=1)
    covariance = noise.covariance(sample.behind[known])
    modelled = np.einsum("pkk->pk", covariance)
    # rows of the turn of a matrix written as a vector: out ⊗ in
    turn = np.einsum("pij,pkl->pikjl", rotator(angle_out[known]), rotator(angle_in[known])).reshape(
        -1, 16, 16
    )
    turn *= np.sqrt(sample.variance[known] / modelled)[:, None, :]
    turned[known] = np.einsum("pkl,pkl->pk", turn @ covariance, turn)
    return turned.reshape(-1, 4, 4)
