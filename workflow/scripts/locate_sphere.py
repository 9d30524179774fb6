"""Find where a material's sphere stands."""

from job import job

from pbrdf.calibration.session_sphere import locate_sphere

with job(snakemake.log[0]):
    locate_sphere(
        snakemake.input.ambient[0],
        snakemake.input.camera,
        snakemake.params.radius_mm,
        snakemake.output[0],
    )
