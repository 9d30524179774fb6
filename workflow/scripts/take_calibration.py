"""Take a calibration from the file that the user gives."""

from job import job

from pbrdf.calibration.documents import write_given, write_given_sphere

with job(snakemake.log[0]):
    given = snakemake.input[0]
    if snakemake.params.kind == "sphere":
        write_given_sphere(given, snakemake.params.radius_mm, snakemake.output[0])
    else:
        write_given(snakemake.params.kind, given, snakemake.output[0])
