"""What an operator does before a target is photographed."""

from __future__ import annotations

BEAM = "Turn the arm's lamp to look into the camera through the modules, with {} between them."

OF_TARGET = {
    "air": BEAM.format("nothing"),
    "LPH": BEAM.format("the horizontal linear polariser"),
    "LPV": BEAM.format("the vertical linear polariser"),
    "CPL": BEAM.format("the left circular polariser"),
    "CPR": BEAM.format("the right circular polariser"),
    "chrome": "Put the chrome ball in the sphere's place; lamp on, room dark.",
    "chrome_ambient": "Leave the chrome ball where it is; lamp off, room light on.",
    "flat": "Fill the camera's view with the evenly bright field; lamp off, room dark.",
    "spectralon": "Put the white tile in the sphere's place, facing the camera; lamp on, room dark.",
}


def task(target: str) -> str:
    """What to do for a target of a session."""
    if target in OF_TARGET:
        return OF_TARGET[target]
    view = target.removeprefix("board_").lstrip("0")
    return f"Hold the chessboard in its pose number {view}, tilted another way each time; room light on."


def sphere_task(material: str, *, ambient: bool) -> str:
    """What to do for a material's sphere."""
    light = "lamp off, room light on" if ambient else "lamp on and warm, room dark"
    return f"Put the sphere of {material} in its place; {light}."
