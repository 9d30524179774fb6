"""Drives the table at a port with pygrbl-streamer; prints what it says in JSON."""

import json
import queue
import sys

from pygrbl_streamer import GrblStreamer

said = {"alarms": [], "errors": []}


def status():
    """The next status report; callbacks run in a thread of their own."""
    found = queue.Queue()
    table.receive_callback = lambda line: found.put(line) if line.startswith("<") else None
    table.sync()
    return found.get(timeout=5.0)


table = GrblStreamer(sys.argv[1])
table.log_callback = lambda level, message: None
table.alarm_callback = said["alarms"].append
table.error_callback = said["errors"].append
with table:
    said["connected"] = table.is_connected
    said["state"] = [table.sync().name]
    said["homed"] = table.home(wait_idle=True)
    said["settings"] = [table.command("$110=6000"), table.command("$120=500")]
    said["streamed"] = table.stream(f"G21G90G94G1X{-199 + angle}F6000" for angle in (90, 45, 30.5, 120))
    said["place"] = status()
    said["refused"] = table.command("G77")
    said["many"] = table.stream(f"G1X{-199 + n % 7}" for n in range(200))
    said["reset"] = table.reset()
    said["state"].append(table.sync().name)
print(json.dumps(said))
