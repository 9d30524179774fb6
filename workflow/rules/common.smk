# What the rules share: the checked config, materials, rig and plan, and the digests of the code.
import re
import sys


from pbrdf.capture.images import lights_of, read_image_settings
from pbrdf.errors import InputError
from pbrdf.provenance import source_digest
from pbrdf.settings.checked import check
from pbrdf.settings.materials import placed_materials, read_materials, select
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import read_rig

LIGHT = r"[0-9]{3}\.[0-9]{2}"
KINDS = ("camera", "polarimeter", "lights", "radiometry")


def placed(path):
    """A path of the config: from the working folder, or else from the project's."""
    here = Path(path)
    project = Path(workflow.basedir) / here
    return here if here.exists() or not project.exists() else project


def config_name():
    """The config's file, for messages."""
    files = workflow.config_settings.configfiles
    return files[-1] if files else "config/config.yaml"


try:
    SETTINGS = check(dict(config), "config", config_name())
    TABLE = read_materials(placed(SETTINGS["materials"]), SETTINGS["data"])
    MATERIALS = placed_materials(
        select(TABLE, SETTINGS["only"], config_name()), placed, SETTINGS["materials"]
    )
    RIG_FILE = placed(SETTINGS["rig"]) if SETTINGS["rig"] else None
    RIG = read_rig(RIG_FILE) if RIG_FILE else None
    PLAN = (
        capture_plan(SETTINGS["plan"], RIG, config_name())
        if RIG and "plan" in SETTINGS
        else None
    )
    IMAGE_LIGHTS = {
        name: lights_of(read_image_settings(material.details))
        for name, material in MATERIALS.items()
        if material.source == "images"
    }
    for name, material in MATERIALS.items():
        if material.source == "rig" and PLAN is None:
            raise InputError(
                config_name(),
                "plan",
                f"is missing, and {name} is to be photographed",
                "give `rig` and `plan`",
            )
except InputError as error:
    sys.exit(str(error))


def named(*sources):
    """Pattern of the materials of these sources."""
    names = [name for name, m in MATERIALS.items() if m.source in sources]
    return "|".join(names) or "(?!)"


def has_sphere(material):
    """Whether a material's photographs become a table."""
    return MATERIALS[material].radius_mm is not None


def spheres():
    """Pattern of the materials whose photographs become tables."""
    names = [
        name
        for name, m in MATERIALS.items()
        if m.source != "table" and has_sphere(name)
    ]
    return "|".join(names) or "(?!)"


def capture_folder(material):
    """Where the capture of a material lies."""
    if MATERIALS[material].source == "capture":
        return MATERIALS[material].path
    return Path("captures") / material


def lights(material):
    """Ids of the lights of a material."""
    source = MATERIALS[material].source
    if source == "rig":
        return [light.id for light in PLAN.lights]
    if source == "images":
        return IMAGE_LIGHTS[material]
    manifests = capture_folder(material).glob("lights/*/manifest.json")
    return sorted(manifest.parent.name for manifest in manifests)


def manifest(wildcards):
    """Manifest of a light."""
    folder = capture_folder(wildcards.material)
    return folder / "lights" / wildcards.light / "manifest.json"


def session_document(kind):
    """Input function: a calibration of a material's session."""

    def document(wildcards):
        session = MATERIALS[wildcards.material].session
        return f"<results>/calibration/{session}/{kind}.json"

    return document


def given_calibration(kind, material=""):
    """The file that the config gives for a calibration, in a list; none where it gives none."""
    path = SETTINGS["calibration"].get(kind)
    return [placed(path.replace("{material}", material))] if path else []


def is_available(kind):
    """Whether the rig or the config can give a calibration."""
    virtual = RIG is not None and RIG["kind"] == "virtual"
    return virtual or kind in SETTINGS["calibration"]


def image_calibrations(wildcards):
    """What a light's reconstruction needs, by kind."""
    sphere = has_sphere(wildcards.material)
    kinds = ["polarimeter", *(["camera"] if sphere else [])]
    kinds += ["radiometry"] if is_available("radiometry") else []
    documents = {kind: session_document(kind)(wildcards) for kind in kinds}
    if sphere:
        documents["sphere"] = f"<results>/{wildcards.material}/sphere.json"
    return documents


def calibration_documents(wildcards):
    """All calibrations behind a material's page."""
    material = wildcards.material
    if MATERIALS[material].source == "table":
        return []
    if not has_sphere(material):
        return list(image_calibrations(wildcards).values())
    session = [session_document(kind)(wildcards) for kind in KINDS]
    return [*session, f"<results>/{material}/sphere.json"]


def exports():
    """Tables to write for renderers."""
    names = [name for name in MATERIALS if exportable(name)]
    return expand(
        "<results>/{material}/{material}{kind}.pbsdf",
        material=names,
        kind=["", "_filled"],
    )


def exportable(material):
    """Whether a table is to be written for Mitsuba: one of five bands that it could not load already."""
    origin = MATERIALS[material]
    if origin.source == "table":
        return origin.path.suffix != ".pbsdf" or origin.details is not None
    return has_sphere(material) and (PLAN is None or len(PLAN.bands_nm) == 5)


def kept_images():
    """Receipts of the Mueller images that the config keeps, and of those that are the end of the way."""
    keep = set(SETTINGS["reconstruction"]["keep_images"])
    return [
        f"<results>/{name}/mueller/{light}.json"
        for name, material in MATERIALS.items()
        if material.source != "table"
        for light in lights(name)
        if light in keep or not has_sphere(name)
    ]


def paths_to_open():
    """What a person wants to see after a run."""
    paths = ["<results>/report/index.html", *exports()]
    here = [Path(workflow.pathvars.apply(path)).resolve() for path in paths]
    return "\n".join(
        ["", "Open the report and the tables for Mitsuba:", *map(str, here)]
    )


def require_calibrations():
    """Refuse a run that lacks a calibration, before anything starts."""
    for name, material in MATERIALS.items():
        needed = [*KINDS, "sphere"] if has_sphere(name) else ["polarimeter"]
        for kind in needed if material.source != "table" else []:
            if not is_available(kind):
                raise InputError(
                    config_name(),
                    f"calibration.{kind}",
                    f"{name} needs it, and no virtual rig gives it",
                    "name a file that holds it",
                )
            for path in given_calibration(kind, name):
                if not path.exists():
                    raise InputError(
                        config_name(),
                        f"calibration.{kind}",
                        f"there is no {path}",
                        "correct the path",
                    )


try:
    require_calibrations()
except InputError as error:
    sys.exit(str(error))
