"""One light, from its Mueller images to its slice or share of the table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.lights import read_lights
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.calibration.sphere import Sphere
from pbrdf.capture.frames import read_manifest
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import band_name
from pbrdf.formats.mueller_exr import read_mueller_exr
from pbrdf.formats.receipt import write_receipt
from pbrdf.reconstruction.noise import NoiseModel
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.inverse_map import Slip, paper_axes
from pbrdf.tabulation.paper import make_share
from pbrdf.tabulation.sampling import make_slice
from pbrdf.tabulation.shares import write_share
from pbrdf.tabulation.slices import write_slice
from pbrdf.tabulation.view import BandImage, Viewpoint


def slice_light(
    images: str | Path,
    images_receipt: str | Path,
    manifest: str | Path,
    calibrations: Mapping[str, str | Path],
    path: str | Path,
    receipt: str | Path,
    *,
    nodes: tuple[int, int, int],
    grazing_deg: float,
    code: str,
) -> None:
    """Make the slice of a light and its receipt.

    Parameters
    ----------
    images, images_receipt : str or Path
        Folder of the light's Mueller images, and its receipt.
    manifest : str or Path
        The light's manifest, which knows the arm's angle.
    calibrations : mapping
        Documents by kind: ``camera``, ``sphere``, ``lights``, ``polarimeter``, ``radiometry``.
    path, receipt : str or Path
        Where the slice and its receipt go.
    nodes : tuple of int
        Numbers of nodes of θh, θd, φd of the table.
    grazing_deg : float
        Angle of incidence or view from which on nodes are left out, degrees.
    code : str
        Digest of the code.

    Raises
    ------
    InputError
        If an input is missing, damaged, or does not say what is needed.
    """
    view, band_images = _photographed(images, manifest, calibrations)
    part = make_slice(view, band_images, table_axes(*nodes), grazing_deg)
    write_slice(path, part)
    write_receipt(
        receipt,
        outputs=[path],
        inputs={"images": [images_receipt], **{kind: [document] for kind, document in calibrations.items()}},
        settings={"nodes": list(nodes), "grazing_deg": grazing_deg, "code": code},
        summary={"seen_share": float(part.count.mean())},
    )


def share_light(
    images: str | Path,
    images_receipt: str | Path,
    manifest: str | Path,
    calibrations: Mapping[str, str | Path],
    path: str | Path,
    receipt: str | Path,
    *,
    angles_deg: Sequence[float],
    nodes: tuple[int, int, int],
    grazing_deg: float,
    widest_gap_deg: float,
    slips: Sequence[Slip],
    code: str,
) -> None:
    """Make the share of a light, as the supplement divides the table, and its receipt.

    Parameters
    ----------
    images, images_receipt, manifest, calibrations, path, receipt, nodes, grazing_deg, code
        As for `slice_light`.
    angles_deg : sequence of float
        Angles of the arm of all lights of the material.
    widest_gap_deg : float
        Widest step of θd between two lights; a bin lies at most half of it from its light.
    slips : sequence of Slip
        Those of the supplement to reproduce.

    Raises
    ------
    InputError
        If an input is missing, damaged, or does not say what is needed.
    """
    view, band_images = _photographed(images, manifest, calibrations)
    widest = np.radians(widest_gap_deg)
    share = make_share(view, angles_deg, band_images, paper_axes(nodes, slips), grazing_deg, widest, slips)
    write_share(path, share)
    write_receipt(
        receipt,
        outputs=[path],
        inputs={"images": [images_receipt], **{kind: [document] for kind, document in calibrations.items()}},
        settings={
            "angles_deg": list(angles_deg),
            "nodes": list(nodes),
            "grazing_deg": grazing_deg,
            "widest_gap_deg": widest_gap_deg,
            "slips": list(slips),
            "code": code,
        },
        summary={"bins": len(share.nodes), "seen_share": float((share.count > 0).mean())},
    )


def _photographed(
    images: str | Path, manifest: str | Path, calibrations: Mapping[str, str | Path]
) -> tuple[Viewpoint, Iterator[tuple[int, BandImage]]]:
    """Where a light's photographs were taken from, and their images band by band."""
    taken = read_manifest(manifest)
    radiometry = Radiometry.read(calibrations["radiometry"])
    polarimeter = PolarimeterCalibration.read(calibrations["polarimeter"])
    view = Viewpoint(
        Camera.read(calibrations["camera"]),
        Sphere.read(calibrations["sphere"]),
        read_lights(calibrations["lights"]),
        taken["angle_deg"],
        polarimeter.analyser_axis,
    )

    def band_image(band_nm: int) -> BandImage:
        image = read_mueller_exr(Path(images) / f"{band_name(band_nm)}.exr")
        solution = data_reduction(
            polarimeter.at(band_nm, calibrations["polarimeter"]), taken["states_deg"], manifest
        )
        noise = NoiseModel(
            solution,
            np.array(taken["exposures_s"]),
            min(taken["saturation"], radiometry.saturation_dn),
            radiometry.dn_per_electron,
            radiometry.read_noise_dn,
            taken["darks"],
        )
        return BandImage(image.mueller, image.variance, image.first, noise, radiometry.scale[band_nm])

    for band_nm in taken["bands_nm"]:
        if band_nm not in radiometry.scale:
            field = f"scale.{band_nm}"
            raise InputError(calibrations["radiometry"], field, "is missing", "calibrate that band too")
    # nothing here holds an image, so that one is in memory at a time
    return view, ((band_nm, band_image(band_nm)) for band_nm in taken["bands_nm"])
