# What a run needs is checked before anything starts: one line says what is missing.
import math

from pbrdf.models.table import require_known_kind
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.reduction import data_reduction


def refuse(field, problem, remedy, source=None):
    """Stop before anything starts."""
    raise InputError(source or config_name(), field, problem, remedy)


def require_calibrations(name, material):
    """Refuse a material that lacks a calibration."""
    for kind in [*KINDS, "sphere"] if has_sphere(name) else ["polarimeter"]:
        field = f"calibration.{kind}"
        if not is_available(kind, name):
            refuse(
                field,
                f"{name} needs it, and neither a file nor photographs of session {material.session} give it",
                "name a file that holds it, or photograph its targets",
            )
        for path in given_calibration(kind, name, material.session):
            if not path.exists():
                refuse(field, f"there is no {path}", "correct the path")


def require_lights(name, material):
    """Refuse a material without photographs, or with too few for a table."""
    found = lights(name)
    if not found:
        refuse(
            "lights",
            "holds no light with a manifest",
            "write it with pbrdf.write_capture",
            material.path,
        )
    if has_sphere(name) and len(found) < 2:
        refuse(
            f"{name}, radius_mm",
            "a table needs two lights, there is one",
            "add lights",
            SETTINGS["materials"],
        )


def require_plan():
    """Refuse a plan whose states cannot tell all elements, and kept images of lights that nobody takes."""
    quarter_wave = Polarimeter(math.pi / 2, math.pi / 2)
    if PLAN:
        data_reduction(quarter_wave, PLAN.states_deg, config_name(), "plan.states")
    photographed = [name for name, m in MATERIALS.items() if m.source != "table"]
    taken = {light for name in photographed for light in lights(name)}
    for light in kept_lights():
        if taken and light not in taken:
            refuse(
                "reconstruction.keep_images",
                f"no light is called `{light}`",
                f"there are {', '.join(sorted(taken))}",
            )


try:
    for name, material in MATERIALS.items():
        if material.source == "rig":
            RIG.with_sphere(name, RIG_FILE)
        if material.source == "table":
            require_known_kind(material.path)
        else:
            require_lights(name, material)
            require_calibrations(name, material)
    require_plan()
except InputError as error:
    sys.exit(str(error))
