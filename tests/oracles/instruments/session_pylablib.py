"""Drives the stage behind a socket with pylablib's driver; prints what it says in JSON."""

import json
import sys

from pylablib.devices import Thorlabs

said = {}
with Thorlabs.KinesisMotor(("serial", sys.argv[1]), scale="stage") as stage:
    information = stage.get_device_info()
    said["identity"] = [
        information.model_no,
        information.serial_no,
        information.fw_ver,
        information.nchannels,
    ]
    said["scale"] = [stage.get_scale()[0], stage.get_scale_units()]
    said["settings"] = sorted(stage.get_settings())
    said["homed"] = [stage.is_homed()]
    stage.home(sync=True, timeout=20.0)
    said["homed"].append(stage.is_homed())
    said["rates"] = list(stage.setup_velocity(max_velocity=8.0, acceleration=15.0))
    said["homing"] = list(stage.get_homing_parameters())
    said["backlash"] = stage.setup_gen_move(1.5)
    said["places"] = []
    for order, angle in ((stage.move_to, 90.0), (stage.move_by, -100.0), (stage.move_to, 400.0)):
        order(angle)
        stage.wait_move(timeout=20.0)
        said["places"].append(stage.get_position())
    stage.move_to(0.0)
    said["status"] = stage.get_status()
    stage.stop(timeout=20.0)
    said["stopped"] = stage.get_position()
    stage.set_position_reference(123.0)
    said["reference"] = stage.get_position()
json.dump(said, sys.stdout)
