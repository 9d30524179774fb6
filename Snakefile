# From polarised photographs of spheres to polarimetric BRDFs: `snakemake` runs config/config.yaml.
import atexit
from pathlib import Path

from snakemake.utils import min_version

min_version("9.20")

if not workflow.config_settings.configfiles:

    configfile: Path(workflow.basedir) / "config/config.yaml"


report: "reports/workflow.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/capture.smk"
include: "workflow/rules/calibration.smk"
include: "workflow/rules/reconstruction.smk"
include: "workflow/rules/tabulation.smk"
include: "workflow/rules/fitting.smk"
include: "workflow/rules/report.smk"


localrules:
    all,


rule all:
    input:
        "<results>/report/index.html",
        exports(),
        kept_images(),


onsuccess:
    # at exit, after Snakemake's own last words
    atexit.register(print, paths_to_open())
