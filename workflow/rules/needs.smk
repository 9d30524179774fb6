# What jobs ask for, from the size of their problem: memory (MiB), disk (MB), time (min), threads. And whether there is room.
import os
from dataclasses import replace
from functools import cache

from pbrdf.instruments.interface import FrameFormat
from pbrdf.settings.needs import Problem, needs
from pbrdf.settings.room import require_room

LEAST_NODE_BYTES = 55
"""Of a table in any format, squeezed."""


def problem_of(nodes=None, **counts):
    """A problem of the config's table and fits."""
    fitting = SETTINGS["fitting"]
    return Problem(
        **counts,
        nodes=nodes or NODES,
        fitted_share=fitting["downsample"] ** -3,
        fits=fitting["starts"] + fitting["held_out"],
    )


def planned_problem(plan):
    """Size of what the rig photographs by a plan."""
    form = FrameFormat.of_camera(RIG["camera"])
    return problem_of(
        lights=len(plan.lights),
        bands=len(plan.bands_nm),
        states=len(plan.states_deg),
        exposures=len(plan.exposures_s),
        frames_per_light=plan.frames_per_light(),
        pixels=form.rows * form.columns,
        word_bytes=1 if form.dtype == "uint8" else 2,
    )


def captured_problem(material):
    """Size of what is photographed already, as one light tells it."""
    taken = read_manifest(manifest_path(material, lights(material)[0]))
    return problem_of(
        lights=len(lights(material)),
        bands=len(taken["bands_nm"]),
        states=len(taken["states_deg"]),
        exposures=len(taken["exposures_s"]),
        frames_per_light=taken["frames"],
        pixels=taken["rows"] * taken["columns"],
        word_bytes={"uint8": 1, "uint16": 2}.get(taken["dtype"], 4),
    )


def folder_problem(material):
    """Size of a folder of images, the first of which stands for all: noise fills a byte of a pixel and more."""
    settings = [setting for setting in IMAGES[material] if setting.band_nm]
    of_band = [s for s in settings if s.band_nm == settings[0].band_nm]
    exposures = len({setting.exposure_s for setting in settings})
    return problem_of(
        lights=len(lights(material)),
        bands=len(bands(material)),
        states=len(of_band) // (exposures * len(lights(material))),
        exposures=exposures,
        frames_per_light=len(IMAGES[material]) // len(lights(material)),
        pixels=(MATERIALS[material].path / settings[0].file).stat().st_size,
        word_bytes=4,
    )


def table_problem(path):
    """Size of a finished table, from the bytes of its files."""
    files = path.rglob("*") if path.is_dir() else [path]
    stored = sum(file.stat().st_size for file in files if file.is_file())
    found = count_bands(path)
    nodes = (max(stored // (LEAST_NODE_BYTES * found), 1), 1, 1)
    none = dict.fromkeys(["lights", "states", "exposures", "frames_per_light"], 1)
    return problem_of(**none, bands=found, pixels=1, word_bytes=2, nodes=nodes)


@cache
def material_problem(material):
    """Size of a material's problem."""
    source = MATERIALS[material].source
    if source == "rig":
        return planned_problem(PLAN)
    if source == "capture":
        return captured_problem(material)
    if source == "images":
        return folder_problem(material)
    return table_problem(MATERIALS[material].path)


def of_material(wildcards):
    """Problem of a job's material."""
    return material_problem(wildcards.material)


def of_largest(wildcards):
    """The largest frames of any material stand for those of its session."""
    sizes = [material_problem(name) for name in MATERIALS]
    return max(sizes, key=lambda size: size.pixels)


def to_photograph(wildcards):
    """Problem of what a material's capture lacks."""
    problem = of_material(wildcards)
    paths = [manifest_path(wildcards.material, id) for id in lights(wildcards.material)]
    return replace(problem, lights=sum(not path.exists() for path in paths))


def of_targets(*names):
    """Function that tells the problem of photographing some targets of a session."""

    def problem(wildcards):
        plans = [TARGET_PLANS[name] for name in names or [wildcards.target]]
        frames = sum(plan.frames_per_light() * len(plan.lights) for plan in plans)
        return replace(planned_problem(plans[0]), lights=1, frames_per_light=frames)

    return problem


def of_ambient(wildcards):
    """Problem of a photograph under ambient light."""
    return planned_problem(AMBIENT_PLAN)


def asks(step, problem=of_material):
    """Resources of a rule, each a function of its wildcards."""

    def told_by(name):
        return lambda wildcards: getattr(needs(step, problem(wildcards)), name)

    return {name: told_by(name) for name in ("mem_mb", "disk_mb", "runtime")}


def threads_of(step):
    """Threads of a rule, a function of its wildcards."""
    return lambda wildcards: needs(step, of_material(wildcards)).threads


def bytes_to_write(jobs):
    """Bytes that jobs leave on each disk, by a folder there; of what goes again, as much as there is at a time."""
    machine = workflow.resource_settings
    at_once = 2 * max(machine.cores or 1, machine.nodes or 1)
    lasting, passing = {}, {}
    for job in jobs:
        place = Path(job.output[0] if job.output else ".").absolute()
        place = next(path for path in place.parents if path.exists())
        sizes = passing if job.temp_output else lasting
        sizes.setdefault(os.stat(place).st_dev, []).append(
            (job.resources.get("disk_mb", 0), place)
        )
    written = {}
    for disk in {*lasting, *passing}:
        brief = sorted(passing.get(disk, []), reverse=True)[:at_once]
        found = lasting.get(disk, []) + brief
        written[min(place for _, place in found)] = 1e6 * sum(size for size, _ in found)
    return written


def tell_room():
    """Tell how much this run writes; refuse where there is too little room."""
    try:
        for folder, needed in bytes_to_write(workflow.dag.needrun_jobs()).items():
            print(require_room(folder, needed), file=sys.stderr, flush=True)
    except InputError as error:
        atexit.register(print, str(error), file=sys.stderr)
        sys.exit(1)
