# From polarised photographs of spheres to polarimetric BRDFs: `snakemake` runs config/config.yaml.
import atexit
import os
import sys
from pathlib import Path

from snakemake.utils import min_version

min_version("9.20")

if not workflow.config_settings.configfiles:

    configfile: Path(workflow.basedir) / "config/config.yaml"


# Jobs end with the process that began them.
os.environ |= {"PBRDF_SNAKEMAKE": str(os.getpid())}


report: "reports/workflow.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/session_inputs.smk"
include: "workflow/rules/calibration_inputs.smk"
include: "workflow/rules/needs.smk"
include: "workflow/rules/requirements.smk"
include: "workflow/rules/clock.smk"
include: "workflow/rules/capture.smk"
include: "workflow/rules/session.smk"
include: "workflow/rules/calibration.smk"
include: "workflow/rules/radiometry.smk"
include: "workflow/rules/reconstruction.smk"
include: "workflow/rules/table_inputs.smk"
include: "workflow/rules/tabulation.smk"
include: "workflow/rules/fitting.smk"
include: "workflow/rules/report_inputs.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/intermediate_results.smk"
include: "workflow/rules/validation.smk"
include: "workflow/rules/compare.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/renders.smk"
include: "workflow/rules/closed_loop.smk"


localrules:
    all,


rule all:
    input:
        "<results>/report",
        tables(),
        comparisons(),
        exports(),
        kept_images(),
        intermediate_results(),


onstart:
    REFUSALS.unlink(missing_ok=True)
    tell_room()
    bring_to_now()


# At exit, after Snakemake's own last words.
onsuccess:
    atexit.register(print, paths_to_open())


onerror:
    atexit.register(print, refusals(), file=sys.stderr)
