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
from pbrdf.settings.rig import read_rig, sphere_files
from pbrdf.settings.targets import AMBIENT, ambient_plan, board_names, session_plans
from pbrdf.models.table import count_bands, require_known_kind

SESSION = "[A-Za-z0-9][A-Za-z0-9_-]*"
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
    RIG = read_rig(RIG_FILE).with_files_at(placed) if RIG_FILE else None
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


def measured(kind, names=SESSION):
    """Pattern of what a calibration is measured for: nothing where the config gives a file."""
    return "(?!)" if kind in SETTINGS["calibration"] else names


def taken(kind, names=SESSION):
    """Pattern of what a calibration is taken from a file for."""
    return names if kind in SETTINGS["calibration"] else "(?!)"


def is_available(kind, material):
    """Whether the config gives a calibration of a material, or its targets are there or can be photographed."""
    if kind in SETTINGS["calibration"]:
        return True
    session = MATERIALS[material].session
    photographs = {
        "camera": [board_manifests(session)],
        "polarimeter": [reference_manifests(session)],
        "lights": [
            session_manifests("chrome", session),
            session_manifests("chrome_ambient", session),
        ],
        "flat": [session_manifests("flat", session)],
        "radiometry": [
            session_manifests("flat", session),
            session_manifests("spectralon", session),
        ],
        "sphere": [ambient_photographs(material)],
    }[kind]
    earlier = {
        "lights": ["camera", "polarimeter"],
        "radiometry": ["camera", "polarimeter", "lights"],
        "sphere": ["camera"],
    }.get(kind, [])
    return all(photographs) and all(is_available(each, material) for each in earlier)


def image_calibrations(wildcards):
    """What a light's reconstruction needs, by kind."""
    sphere = has_sphere(wildcards.material)
    kinds = ["polarimeter", *(["camera"] if sphere else [])]
    optional = ("radiometry", "flat")
    kinds += [kind for kind in optional if is_available(kind, wildcards.material)]
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
    """Tables to write for renderers: pairs of files of five bands, or folders of such pairs."""
    counts = {name: exported_bands(name) for name in MATERIALS}
    pairs = expand(
        "<results>/{material}/{material}{kind}.pbsdf",
        material=[name for name, count in counts.items() if count == 5],
        kind=["", "_filled"],
    )
    many = [name for name, count in counts.items() if count > 5]
    return pairs + expand("<results>/{material}/pbsdf", material=many)


def bands(material):
    """Bands of a material's photographs, nm."""
    source = MATERIALS[material].source
    if source == "rig":
        return PLAN.bands_nm
    if source == "images":
        return {setting.band_nm for setting in IMAGES[material]} - {None}
    return read_manifest(manifest_path(material, lights(material)[0]))["bands_nm"]


def exported_bands(material):
    """Bands of a table that is to be written for Mitsuba; 0 where it could load the source already."""
    origin = MATERIALS[material]
    if origin.source == "table":
        count = count_bands(origin.path)
        loadable = origin.path.suffix == ".pbsdf" and origin.details is None
        return 0 if loadable and count == 5 else count
    return len(bands(material)) if has_sphere(material) else 0


def tabulated():
    """Materials with a table."""
    return [n for n, m in MATERIALS.items() if m.source == "table" or has_sphere(n)]


def tables():
    """Every table."""
    return expand("<results>/{material}/table.zarr", material=tabulated())


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


def takes_photographs():
    """Whether anything drives the rig."""
    return RIG is not None and RIG["kind"] == "virtual"


def photographed_sessions():
    """Sessions whose polarimeter the rig can put to the test."""
    return sorted({m.session for m in MATERIALS.values() if m.source == "rig"})


def planned_manifests(material="{material}"):
    """Manifests of all lights of a sphere that the rig photographs."""
    planned = [light.id for light in PLAN.lights] if PLAN else ["none"]
    return [f"captures/{material}/lights/{light}/manifest.json" for light in planned]


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


def session_manifests(target, session):
    """Manifests of a target: those that the rig will take, or those that are there."""
    if takes_photographs() and session in photographed_sessions():
        return target_manifests(target, session)
    folder = Path(SESSION_FOLDER.format(session=session))
    return sorted(map(str, folder.glob(f"{target}/lights/*/manifest.json")))


def truth_files(wildcards):
    """Input function: the table or Mitsuba's files that a material's virtual sphere is made of."""
    return sphere_files(RIG.get("spheres", {}).get(wildcards.material))


def board_manifests(session):
    """Manifests of a session's views of the board."""
    if takes_photographs() and session in photographed_sessions():
        return [path for board in boards() for path in target_manifests(board, session)]
    return session_manifests("board_*", session)


def reference_manifests(session):
    """Manifests of the elements that a session's polarimeter is calibrated with; none if one is missing."""
    names = SETTINGS["session"]["polarimeter_references"]
    manifests = [session_manifests(name, session) for name in names]
    return sum(manifests, []) if all(manifests) else []


def ambient_photographs(material):
    """Manifest of a material's sphere under ambient light, in a list; none if there is none."""
    if takes_photographs() and MATERIALS[material].source == "rig":
        return [ambient_manifest(material)]
    folder = capture_folder(material) / "ambient"
    return sorted(map(str, folder.glob("lights/*/manifest.json")))[:1]


def element_manifests(wildcards):
    """Input function: the manifests of a session's elements, by element."""
    return {
        element: target_manifests(element, wildcards.session)[0] for element in IDEAL
    }


def validation_pages():
    """A page a session."""
    return expand(
        "<results>/pages/validation_{session}.html", session=photographed_sessions()
    )


def closed_loops():
    """Materials that can be compared with what they were photographed from."""
    names = [n for n, m in MATERIALS.items() if m.source == "rig" and has_sphere(n)]
    whole = PLAN is not None and len(PLAN.bands_nm) == 5
    return names if whole and RIG["kind"] == "virtual" else []


def paths_to_open():
    """What a person wants to see after a run, of all that is there."""
    pages = [*validation_pages(), "<results>/pages/closed_loop.html"]
    paths = ["<results>/report/index.html", *exports(), *pages]
    paths += [f"<results>/comparisons/{'_and_'.join(compared_tables())}.html"]
    here = [Path(workflow.pathvars.apply(path)).resolve() for path in paths]
    there = [str(path) for path in here if path.exists()]
    return "\n".join(["", "To open:", *there] if there else [])


def refusals():
    """The lines with which jobs refused to go on, for the end of all messages."""
    return REFUSALS.read_text(encoding="utf-8").rstrip() if REFUSALS.exists() else ""
