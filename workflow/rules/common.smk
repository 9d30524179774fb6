# What the rules share: the checked config, materials, rig and plan, and the digests of the code.
import re
import sys


from pbrdf.capture.images import lights_of, read_image_settings
from pbrdf.capture.frames import read_manifest
from pbrdf.errors import REFUSALS, InputError
from pbrdf.provenance import source_digest
from pbrdf.settings.checked import check
from pbrdf.settings.materials import placed_materials, read_materials, select
from pbrdf.settings.plan import capture_plan, light_id
from pbrdf.settings.rig import read_rig
from pbrdf.settings.targets import ambient_plan, session_plans
from pbrdf.models.table import count_bands

SESSION = "[A-Za-z0-9][A-Za-z0-9_-]*"
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


NODES = tuple(SETTINGS["tabulation"][axis] for axis in ("theta_h", "theta_d", "phi_d"))


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


def kept_lights():
    """Ids of the lights whose Mueller images are kept."""
    keep = SETTINGS["reconstruction"]["keep_images"]
    if isinstance(keep, list):
        return keep
    photographed = [name for name, m in MATERIALS.items() if m.source != "table"]
    chosen = [
        light for name in photographed for light in lights(name)[:: keep["every"]]
    ]
    return sorted(set(chosen))


def kept_images():
    """The Mueller images that the config keeps, and those that are the end of the way."""
    keep = set(kept_lights())
    return [
        f"<results>/{name}/mueller/{light}"
        for name, material in MATERIALS.items()
        if material.source != "table"
        for light in lights(name)
        if light in keep or not has_sphere(name)
    ]


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
