"""Drives the stage at a port with QMI's driver; prints what it says in JSON."""

import json
import sys

import qmi
from qmi.core.exceptions import QMI_TimeoutException
from qmi.instruments.thorlabs import Thorlabs_K10Cr1
from qmi.instruments.thorlabs.apt_protocol import AptChannelHomeDirection, AptChannelHomeLimitSwitch

# its driver sleeps this long whenever an answer is not there at once
Thorlabs_K10Cr1.RESPONSE_TIMEOUT = 0.05
said = {}


def wait(stage):
    """Wait for the end; its driver gives up where a notice comes between question and answer."""
    for attempt in range(5):
        try:
            stage.wait_move_complete(20.0)
        except QMI_TimeoutException:
            if attempt == 4:
                raise
        else:
            return


qmi.start("oracle", config_file=None)
stage = qmi.make_instrument("stage", Thorlabs_K10Cr1, f"serial:{sys.argv[1]}")
with stage:
    identity = stage.get_idn()
    said["identity"] = [identity.model, int(identity.serial)]
    stage.set_chan_enable_state(False)
    said["enabled"] = [stage.get_chan_enable_state()]
    stage.set_chan_enable_state(True)
    said["enabled"].append(stage.get_chan_enable_state())
    said["homed"] = [stage.get_motor_status().homed]
    stage.set_home_params(AptChannelHomeDirection.REVERSE, AptChannelHomeLimitSwitch.REVERSE, 5.0, 4.0)
    homing = stage.get_home_params()
    said["homing"] = [
        homing.home_direction.name,
        homing.limit_switch.name,
        homing.home_velocity,
        homing.offset_distance,
    ]
    stage.move_home()
    said["homing_seen"] = stage.get_motor_status().homing
    wait(stage)
    said["homed"].append(stage.get_motor_status().homed)
    stage.set_velocity_params(8.0, 15.0)
    stage.set_backlash_distance(1.5)
    said["rates"] = [stage.get_velocity(), stage.get_acceleration(), stage.get_backlash_distance()]
    said["places"] = []
    for order, angle in (
        (stage.move_absolute, 90.0),
        (stage.move_relative, -100.0),
        (stage.move_absolute, 400.0),
    ):
        order(angle)
        wait(stage)
        said["places"].append(stage.get_absolute_position())
    stage.move_absolute(0.0)
    said["moving"] = stage.get_motor_status().moving_forward
    stage.move_stop()
    wait(stage)
    said["stopped"] = stage.get_absolute_position()
qmi.stop()
json.dump(said, sys.stdout)
