"""Write where a material's sphere stands."""

from job import job

from pbrdf.calibration.documents import write_nominal_sphere

with job(snakemake.log[0]):
    write_nominal_sphere(snakemake.params.rig, snakemake.params.radius_mm, snakemake.output[0])
