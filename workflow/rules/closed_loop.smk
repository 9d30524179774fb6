# Materials whose truth is known, taken around: photographed, tabulated, exported, loaded by Mitsuba, compared.
# `snakemake closed_loop`, at its full size with `--configfile config/closed_loop.yaml`. No part of a bare `snakemake`.


rule write_sixteen_elements:
    output:
        "<results>/closed_loop/sixteen_elements.pbsdf",
    log:
        "<logs>/write_sixteen_elements.log",
    conda:
        "../../envs/mitsuba.yaml"
    params:
        code=source_digest("pbrdf.models.sixteen_elements"),
    script:
        "../scripts/write_sixteen_elements.py"


rule compare_with_truth:
    input:
        truth_files,
        measured="<results>/{material}/{material}.pbsdf",
        filled="<results>/{material}/{material}_filled.pbsdf",
    output:
        "<results>/closed_loop/{material}.json",
    log:
        "<logs>/compare_with_truth/{material}.log",
    benchmark:
        "<benchmarks>/compare_with_truth/{material}.tsv"
    wildcard_constraints:
        material=named("rig"),
    conda:
        "../../envs/mitsuba.yaml"
    params:
        sphere=lambda wildcards: RIG["spheres"][wildcards.material],
        bands_nm=lambda wildcards: list(bands(wildcards.material)),
        code=source_digest("pbrdf.tabulation.closed_loop"),
    script:
        "../scripts/compare_with_truth.py"


rule closed_loop_page:
    input:
        expand("<results>/closed_loop/{material}.json", material=closed_loops()),
    output:
        report(
            "<results>/pages/closed_loop.html",
            category="Validation",
            caption="../../reports/closed_loop.rst",
            labels={"session": "closed loop"},
        ),
    log:
        "<logs>/closed_loop_page.log",
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.closed_loop"),
    script:
        "../scripts/closed_loop_page.py"


if closed_loops():

    localrules:
        closed_loop,

    rule closed_loop:
        input:
            "<results>/pages/closed_loop.html",

else:

    rule closed_loop:
        log:
            "<logs>/closed_loop.log",
        params:
            config=config_name(),
        script:
            "../scripts/refuse_no_truth.py"
