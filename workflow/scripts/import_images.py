"""Bring the images of a light into the capture store."""

from job import job

from pbrdf.capture.images import import_images

with job(snakemake.log[0]):
    import_images(
        snakemake.params.folder,
        snakemake.input.details,
        snakemake.wildcards.light,
        snakemake.wildcards.material,
        snakemake.params.capture,
    )
