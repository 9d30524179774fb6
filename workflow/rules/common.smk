# What the rules share: the checked config, materials, rig and plan, and the digests of the code.
import math
import re
import sys


from pbrdf.capture.images import lights_of, read_image_settings
from pbrdf.capture.frames import read_manifest
from pbrdf.errors import InputError
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.provenance import source_digest
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.settings.checked import check
from pbrdf.settings.materials import placed_materials, read_materials, select
from pbrdf.settings.plan import capture_plan, light_id
from pbrdf.settings.rig import read_rig
from pbrdf.settings.targets import AMBIENT, ambient_plan, board_names, session_plans
from pbrdf.tabulation.table import require_known_kind

LIGHT = r"[0-9]{3}\.[0-9]{2}"
REFUSALS = Path(".snakemake/refusals.txt")
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
    TARGET_PLANS = session_plans(PLAN, SETTINGS, config_name()) if PLAN else {}
    AMBIENT_PLAN = (
        ambient_plan(PLAN, SETTINGS["session"], config_name()) if PLAN else None
    )
    IMAGES = {
        name: read_image_settings(material.details)
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
        return lights_of(IMAGES[material])
    manifests = capture_folder(material).glob("lights/*/manifest.json")
    return sorted(manifest.parent.name for manifest in manifests)


def manifest_path(material, light):
    """Where the manifest of a light lies."""
    return capture_folder(material) / "lights" / light / "manifest.json"


def manifest(wildcards):
    """Input function: the manifest of a light."""
    return manifest_path(wildcards.material, wildcards.light)


def image_files(material, light):
    """Images of a light in a folder of images."""
    return [
        MATERIALS[material].path / setting.file
        for setting in IMAGES[material]
        if light_id(setting.light_deg) == light
    ]


def session_document(kind):
    """Input function: a calibration of a material's session."""

    def document(wildcards):
        session = MATERIALS[wildcards.material].session
        return f"<results>/calibration/{session}/{kind}.json"

    return document


def given_calibration(kind, material="", session=""):
    """The file that the config gives for a calibration, in a list; none where it gives none."""
    path = SETTINGS["calibration"].get(kind)
    if not path:
        return []
    return [placed(path.replace("{material}", material).replace("{session}", session))]


def is_available(kind):
    """Whether the rig or the config can give a calibration."""
    virtual = RIG is not None and RIG["kind"] == "virtual"
    return virtual or kind in SETTINGS["calibration"]


def takes_flat(material):
    """Whether the rig that photographs a material can give the flat field of its camera."""
    return (
        MATERIALS[material].source == "rig"
        and RIG is not None
        and RIG["kind"] == "virtual"
    )


def image_calibrations(wildcards):
    """What a light's reconstruction needs, by kind."""
    sphere = has_sphere(wildcards.material)
    kinds = ["polarimeter", *(["camera"] if sphere else [])]
    kinds += ["radiometry"] if is_available("radiometry") else []
    if "flat" in SETTINGS["calibration"] or takes_flat(wildcards.material):
        kinds.append("flat")
    documents = {kind: session_document(kind)(wildcards) for kind in kinds}
    if "flat" in kinds:
        documents["flat_image"] = ancient(documents["flat"].replace(".json", ".exr"))
    if sphere:
        documents["sphere"] = f"<results>/{wildcards.material}/sphere.json"
    return documents


def calibration_documents(wildcards):
    """All calibrations behind a material's page."""
    material = wildcards.material
    if MATERIALS[material].source == "table":
        return []
    if not has_sphere(material):
        documents = image_calibrations(wildcards)
        return [path for kind, path in documents.items() if kind != "flat_image"]
    kinds = [*KINDS, *(["flat"] if "flat" in image_calibrations(wildcards) else [])]
    session = [session_document(kind)(wildcards) for kind in kinds]
    return [*session, f"<results>/{material}/sphere.json"]


def exports():
    """Tables to write for renderers."""
    names = [name for name in MATERIALS if exportable(name)]
    return expand(
        "<results>/{material}/{material}{kind}.pbsdf",
        material=names,
        kind=["", "_filled"],
    )


def bands(material):
    """Bands of a material's photographs, nm."""
    source = MATERIALS[material].source
    if source == "rig":
        return PLAN.bands_nm
    if source == "images":
        return {setting.band_nm for setting in IMAGES[material]} - {None}
    return read_manifest(manifest_path(material, lights(material)[0]))["bands_nm"]


def exportable(material):
    """Whether a table is to be written for Mitsuba: one of five bands that it could not load already."""
    origin = MATERIALS[material]
    if origin.source == "table":
        return origin.path.suffix != ".pbsdf" or origin.details is not None
    return has_sphere(material) and len(bands(material)) == 5


def tables():
    """Every table."""
    names = [n for n, m in MATERIALS.items() if m.source == "table" or has_sphere(n)]
    return expand("<results>/{material}/table.zarr", material=names)


def kept_images():
    """The Mueller images that the config keeps, and those that are the end of the way."""
    keep = set(SETTINGS["reconstruction"]["keep_images"])
    return [
        f"<results>/{name}/mueller/{light}"
        for name, material in MATERIALS.items()
        if material.source != "table"
        for light in lights(name)
        if light in keep or not has_sphere(name)
    ]


SESSION_FOLDER = "captures/_sessions/{session}"


def photographed_sessions():
    """Sessions whose polarimeter the rig can put to the test."""
    return sorted({m.session for m in MATERIALS.values() if m.source == "rig"})


def target_manifests(target, session="{session}"):
    """Manifests of a target of a session, one a light."""
    folder = f"{SESSION_FOLDER}/{target}".format(session=session)
    plan = TARGET_PLANS.get(target)
    return [
        f"{folder}/lights/{light.id}/manifest.json"
        for light in (plan.lights if plan else [])
    ] or [f"{folder}/lights/none/manifest.json"]


def plain_plans(targets):
    """Plans of targets as parameters."""
    return {
        name: TARGET_PLANS[name].plain() for name in targets if name in TARGET_PLANS
    }


def session_sections(*names):
    """What of the config's `session` a target depends on: another's change is no reason to go to the rig."""
    return {
        name: SETTINGS["session"][name] for name in names if name in SETTINGS["session"]
    }


def boards():
    """Targets that show the chessboard."""
    return board_names(SETTINGS["session"]["board"]["views"])


def ambient_manifest(material="{material}"):
    """Manifest of a material's sphere under ambient light."""
    return f"captures/{material}/ambient/lights/{AMBIENT.id}/manifest.json"


def element_manifests(wildcards):
    """Input function: the manifests of a session's elements, by element."""
    return {
        element: target_manifests(element, wildcards.session)[0] for element in IDEAL
    }


def validation_pages():
    """A page a session."""
    return expand(
        "<results>/report/validation_{session}.html", session=photographed_sessions()
    )


def paths_to_open():
    """What a person wants to see after a run, of all that is there."""
    paths = ["<results>/report/index.html", *exports(), *validation_pages()]
    here = [Path(workflow.pathvars.apply(path)).resolve() for path in paths]
    there = [str(path) for path in here if path.exists()]
    return "\n".join(["", "To open:", *there] if there else [])


def refusals():
    """The lines with which jobs refused to go on, for the end of all messages."""
    return REFUSALS.read_text(encoding="utf-8").rstrip() if REFUSALS.exists() else ""


def refuse(field, problem, remedy, source=None):
    """Stop before anything starts."""
    raise InputError(source or config_name(), field, problem, remedy)


def require_calibrations(name, material):
    """Refuse a material that lacks a calibration."""
    for kind in [*KINDS, "sphere"] if has_sphere(name) else ["polarimeter"]:
        field = f"calibration.{kind}"
        if not is_available(kind):
            refuse(
                field,
                f"{name} needs it, and no virtual rig gives it",
                "name a file that holds it",
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
    for light in SETTINGS["reconstruction"]["keep_images"]:
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
