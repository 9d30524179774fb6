# Spheres in an environment, by Mitsuba where it is installed: `snakemake renders`. No part of a bare run.


rule render:
    input:
        filled_table,
    output:
        multiext("<results>/renders/{material}", ".pdf", ".svg"),
        report(
            "<results>/renders/{material}.png",
            category="Figures",
            caption="../../reports/renders.rst",
            labels={"of": "{material}", "figure": "render"},
        ),
    log:
        "<logs>/render/{material}.log",
    benchmark:
        "<benchmarks>/render/{material}.tsv"
    wildcard_constraints:
        material="|".join(map(re.escape, loadable())) or "(?!)",
    conda:
        "../../envs/mitsuba.yaml"
    params:
        code=source_digest("pbrdf.report.environment_render"),
    script:
        "../scripts/render.py"


localrules:
    renders,


rule renders:
    input:
        expand(
            "<results>/renders/{material}.{format}",
            material=loadable(),
            format=["pdf", "svg", "png"],
        ),
