"""Write where a material's sphere stands: the user's file, or a copy of the virtual rig's values."""

from job import job

from pbrdf.calibration.documents import write_given_sphere, write_nominal_sphere

with job(snakemake.log[0]):
    if snakemake.input.given:
        write_given_sphere(snakemake.input.given[0], snakemake.params.radius_mm, snakemake.output[0])
    else:
        write_nominal_sphere(snakemake.params.rig, snakemake.params.radius_mm, snakemake.output[0])
