"""The camera's driver against the cameras that the Aravis project itself emulates.

They run where Debian's PyGObject and Aravis are installed, in a process of their own that sees of Debian's
packages `gi` alone.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

DEBIAN = Path("/usr/lib/python3/dist-packages/gi")
CAMERA = "arv-fake-gv-camera-0.8"
CONTROL_PORT = 3956
PACKAGES = "apt-get install aravis-tools gir1.2-aravis-0.8 python3-gi"

BEGIN = """
import json, socket, subprocess, sys, time
from pbrdf.errors import InstrumentError
from pbrdf.instruments.aravis_camera import AravisCamera
from pbrdf.instruments.interface import FrameFormat

FORMAT = FrameFormat(48, 64, "uint16", 16, 0, 65535.0)

def told(call):
    try:
        call()
        return ["", ""]
    except InstrumentError as error:
        return [error.field, error.problem]

def plugged_in(*options):
    command = ["arv-fake-gv-camera-0.8", "-i", "127.0.0.1", "-s", "GVTEST", *options]
    device = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for _ in range(200):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("127.0.0.1", 3956))
            except OSError:
                return device
        time.sleep(0.05)
    raise RuntimeError("the camera does not start")

def features(camera, *names):
    return [camera._port.read(name, kind) for name, kind in names]
"""


@pytest.fixture(scope="session")
def gi_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder that holds `gi` and nothing else."""
    folder = tmp_path_factory.mktemp("gi")
    built_for = f"_gi.cpython-{sys.version_info.major}{sys.version_info.minor}-*"
    if not any(DEBIAN.glob(built_for)):
        pytest.skip(f"there is no PyGObject for this Python in {DEBIAN}: {PACKAGES}")
    (folder / "gi").symlink_to(DEBIAN)
    probe = "import gi; gi.require_version('Aravis', '0.8')"
    environment = os.environ | {"PYTHONPATH": str(folder)}
    if subprocess.run([sys.executable, "-c", probe], env=environment, capture_output=True).returncode:
        pytest.skip(f"Aravis 0.8 is not installed: {PACKAGES}")
    return folder


@pytest.fixture
def network(gi_folder: Path) -> Path:
    """As `gi_folder`, where a camera can also be started on this machine's own network."""
    if shutil.which(CAMERA) is None:
        pytest.skip(f"{CAMERA} is not installed: {PACKAGES}")
    for _ in range(100):
        if not _in_use(CONTROL_PORT):
            return gi_folder
        # The camera of the test before may still be on its way out.
        time.sleep(0.05)
    pytest.skip(f"another program has the camera's port {CONTROL_PORT}")


def _in_use(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return True
    return False


def run(gi_folder: Path, program: str) -> Any:
    """What a program prints last, as JSON; nothing that it started outlives it."""
    process = subprocess.Popen(
        [sys.executable, "-c", BEGIN + program],
        env=os.environ | {"PYTHONPATH": str(gi_folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        printed, complaint = process.communicate(timeout=60)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    assert process.returncode == 0, complaint
    return json.loads(printed.splitlines()[-1])


def test_a_camera_in_process_takes_frames_as_asked(gi_folder: Path) -> None:
    found = run(
        gi_folder,
        """
import gi
gi.require_version("Aravis", "0.8")
from gi.repository import Aravis
Aravis.enable_interface("Fake")
with AravisCamera.open("Fake_1", "camera", frame_format=FORMAT, corner_px=(16, 32), model="Fake") as camera:
    kinds = dict(PixelFormat=str, OffsetX=int, OffsetY=int, Width=int, Height=int, TriggerMode=str,
                 TriggerSource=str, GainAuto=str, GainRaw=int)
    settings = features(camera, *kinds.items())
    taken = [camera.expose(exposure_s) for exposure_s in (0.01, 0.02, 0.02, 0.1)]
    again = told(lambda: camera.expose(11.0))
twice = AravisCamera.open("Fake_1", "camera", frame_format=FORMAT).expose(0.01).number
print(json.dumps(dict(
    settings=settings, identity=[camera.identity.model, camera.identity.serial],
    range_s=camera.exposure_range_s, refused=again,
    exposures=[one.exposure_s for one in taken], numbers=[one.number for one in taken],
    shapes=[one.frame.shape for one in taken], kinds=[str(one.frame.dtype) for one in taken],
    temperatures=[one.temperature_c for one in taken], brightest=[int(one.frame.max()) for one in taken],
    wrong_model=told(lambda: AravisCamera.open("Fake_1", "camera", frame_format=FORMAT, model="GS3")),
    no_sensor=told(lambda: AravisCamera.open(
        "Fake_1", "camera", frame_format=FrameFormat(2704, 3376, "uint16", 14, 2, 65532.0))),
    absent=told(lambda: AravisCamera.open("Nobody-1", "camera", frame_format=FORMAT)),
)))
""",
    )
    assert found["settings"] == ["Mono16", 16, 32, 64, 48, "On", "Software", "Off", 0]
    assert found["identity"] == ["Fake", "1"]
    assert found["range_s"] == [1e-5, 10.0]
    assert found["exposures"] == [0.01, 0.02, 0.02, 0.1]
    assert all(
        0 < (b - a) % 65536 < 1000 for a, b in zip(found["numbers"], found["numbers"][1:], strict=False)
    )
    assert found["shapes"] == [[48, 64]] * 4
    assert found["kinds"] == ["uint16"] * 4
    assert found["temperatures"] == [None] * 4
    assert min(found["brightest"]) > 0
    assert found["refused"] == ["exposure", "is 11 s"]
    assert found["wrong_model"] == ["model", "is 'Fake', not 'GS3'"]
    assert found["no_sensor"][0] == "Width"
    assert found["absent"][0] == "address"
    assert "Aravis finds" in found["absent"][1]


def test_a_camera_on_the_network_answers_each_trigger_with_one_frame(network: Path) -> None:
    """The large frame fits into the socket's buffer; the emulated camera sends no packet again."""
    found = run(
        network,
        """
plugged_in()
with AravisCamera.open("127.0.0.1", "camera", frame_format=FORMAT, serial="GVTEST") as camera:
    numbers = [camera.expose(exposure_s).number for exposure_s in (0.01, 0.02) * 10]
    nothing = camera._port.take(0.2) is None
    second = told(lambda: AravisCamera.open("127.0.0.1", "camera", frame_format=FORMAT))
    after = camera.expose(0.01).number
large = FrameFormat(1024, 1024, "uint16", 16, 0, 65535.0)
with AravisCamera.open("127.0.0.1", "camera", frame_format=large) as camera:
    shape = camera.expose(0.01).frame.shape
print(json.dumps(dict(numbers=numbers, after=after, nothing=nothing, second=second, shape=shape)))
""",
    )
    assert found["numbers"] == list(range(found["numbers"][0], found["numbers"][0] + 20))
    assert found["after"] == found["numbers"][-1] + 1
    assert found["nothing"]
    assert found["second"] == ["address", "is in use by another program"]
    assert found["shape"] == [1024, 1024]


def test_a_camera_whose_cable_was_pulled_is_refused_and_opened_again(network: Path) -> None:
    found = run(
        network,
        """
device = plugged_in()
camera = AravisCamera.open("127.0.0.1", "camera", frame_format=FORMAT)
camera.expose(0.01)
device.kill()
device.wait()
lost = told(lambda: camera.expose(0.01))
closed = told(lambda: camera.expose(0.01))
plugged_in()
again = AravisCamera.open("127.0.0.1", "camera", frame_format=FORMAT).expose(0.01).frame.shape
print(json.dumps(dict(lost=lost, closed=closed, again=again)))
""",
    )
    assert found["lost"][0] == "control"
    assert found["closed"] == ["camera", "is closed"]
    assert found["again"] == [48, 64]


def test_lost_packets_never_make_a_frame(network: Path) -> None:
    found = run(
        network,
        """
plugged_in("-r", "500")
large = FrameFormat(512, 512, "uint16", 16, 0, 65535.0)
camera = AravisCamera.open("127.0.0.1", "camera", frame_format=large, reply_timeout_s=1.0)
print(json.dumps(told(lambda: camera.expose(0.01))))
""",
    )
    assert found[0] == "frame"
    assert "did not arrive whole" in found[1] or "has not come within" in found[1]
