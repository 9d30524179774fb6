"""Commands on photographs and the rig: ``pbrdf capture``, ``pbrdf status``, ``pbrdf rig``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pbrdf.commands.command import Command
from pbrdf.errors import InputError

if TYPE_CHECKING:
    from pbrdf.capture.status import LightStatus

CONFIG = Path("config/config.yaml")
CAPTURES = Path("captures")


def _add_config(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--config",
        type=Path,
        default=CONFIG,
        metavar="FILE",
        help="the config of the run (default: %(default)s)",
    )


def _add_capture(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("material", nargs="+", help="names in the config's table of materials")
    _add_config(parser)
    parser.add_argument(
        "--captures",
        type=Path,
        default=CAPTURES,
        metavar="DIR",
        help="where to (default: %(default)s)",
    )
    parser.add_argument(
        "--retake",
        action="append",
        default=[],
        metavar="ID",
        help="keep a light, such as 041.00, under another name and take it anew; may be given again",
    )
    parser.add_argument(
        "--preview", action="store_true", help="tell frames, hours and room, and take nothing"
    )


def _run_capture(arguments: argparse.Namespace) -> None:
    # drivers and renderers take a second to import, which no other command should wait for
    from pbrdf.capture.configured import Configured
    from pbrdf.capture.retake import archive_light

    run, captures = Configured.read(arguments.config), arguments.captures
    for name, told in run.previews(arguments.material, captures).items():
        print(f"{name}: {told}", file=sys.stdout if arguments.preview else sys.stderr)
    if arguments.preview:
        return
    for name in arguments.material:
        for light in arguments.retake:
            print(f"kept: {archive_light(captures / name, light)}", file=sys.stderr)
    for folder in run.capture(arguments.material, captures):
        print(folder)


def _add_status(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", nargs="*", type=Path, help="captures/<material> (default: all of them)")
    parser.add_argument(
        "--verify", action="store_true", help="read every frame and hold it against its checksum"
    )


def _run_status(arguments: argparse.Namespace) -> None:
    from pbrdf.capture.status import capture_status

    # sessions lie a level deeper
    every = {path.parents[2] for path in CAPTURES.rglob("lights/*/frames.zarr")}
    for folder in arguments.folder or sorted(every) or [CAPTURES]:
        lights = list(capture_status(folder))
        whole = sum(light.whole for light in lights)
        print(f"{folder}: {whole} of {len(lights)} lights begun are whole{_how_taken(lights)}")
        for light in lights:
            if not light.whole:
                share = 100 * light.taken / light.wanted
                print(
                    f"  {light.light}: {light.taken} of {light.wanted} frames ({share:.0f} %) {light.ended}"
                )
        if arguments.verify:
            _verify(folder)


def _verify(folder: Path) -> None:
    """Refuse photographs that are not what was taken (`InputError`)."""
    from pbrdf.capture.status import damaged_frames

    for light, frames in damaged_frames(folder):
        if frames:
            problem = f"{len(frames)} of its frames are gone or changed, the first {frames[0]}"
            remedy = f"restore them, or take it anew: pbrdf capture {folder.name} --retake {light}"
            raise InputError(folder, f"lights/{light}", problem, remedy)
    print("  every frame is what its journal says")


def _how_taken(lights: Sequence[LightStatus]) -> str:
    """What is to be known of exposures and dark frames, in words."""
    told = ""
    metered_ms = [1e3 * exposure_s for light in lights for exposure_s in light.metered_s]
    if metered_ms:
        told += f"; exposures were metered: {min(metered_ms):g} to {max(metered_ms):g} ms"
    if any(light.darks_at_ends for light in lights):
        told += "; dark frames are from start and end of the run only"
    return told


def _add_rig(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("action", choices=["check"], help="find every instrument, move each, take a frame")
    _add_config(parser)
    parser.add_argument(
        "--exposure-ms", type=float, default=10.0, metavar="MS", help="(default: %(default)s)"
    )


def _run_rig(arguments: argparse.Namespace) -> None:
    from pbrdf.capture.configured import Configured

    for line in Configured.read(arguments.config).check(arguments.exposure_ms / 1e3):
        print(line, flush=True)


COMMANDS = (
    Command(
        "capture",
        "photograph materials as a config plans it; what is there already is kept",
        "  pbrdf capture gold\n"
        "  pbrdf capture plastic gold --config config/config.yaml\n"
        "  pbrdf capture gold --preview\n"
        "  pbrdf capture gold --retake 041.00",
        _add_capture,
        _run_capture,
    ),
    Command(
        "status",
        "tell how far the photographs are",
        "  pbrdf status\n  pbrdf status captures/gold",
        _add_status,
        _run_status,
    ),
    Command(
        "rig",
        "check the rig that a config names",
        "  pbrdf rig check\n  pbrdf rig check --config config/lab.yaml --exposure-ms 40",
        _add_rig,
        _run_rig,
    ),
)
