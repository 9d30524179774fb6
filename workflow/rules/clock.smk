# Snakemake refuses an output that is older than an input, as they all are after a clock was set back.
import os
import time


def bring_to_now():
    """Give results that lie in the future the present time: what counts is their content."""
    made = {Path(path) for job in workflow.dag.jobs for path in job.output}
    for path in made:
        # the second is what Snakemake takes as the time of a folder
        for file in (path, path / ".snakemake_timestamp"):
            if file.exists() and file.stat().st_mtime > time.time():
                os.utime(file)
