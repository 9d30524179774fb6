# Spheres in an environment, by Mitsuba where it is installed: `snakemake renders`. No part of a bare run.


def filled_table(wildcards):
    """Input function: a table that Mitsuba loads, its gaps filled."""
    material = wildcards.material
    if exported_bands(material) == 5:
        return f"<results>/{material}/{material}_filled.pbsdf"
    return MATERIALS[material].path


def loadable():
    """Materials whose tables Mitsuba loads: written for it, or its own already."""
    own = [name for name in tabulated() if MATERIALS[name].source == "table"]
    return [
        name
        for name in tabulated()
        if exported_bands(name) == 5 or (name in own and exported_bands(name) == 0)
    ]


rule render:
    input:
        filled_table,
    output:
        multiext("<results>/renders/{material}", ".pdf", ".svg", ".png"),
    log:
        "<logs>/render/{material}.log",
    benchmark:
        "<benchmarks>/render/{material}.tsv"
    wildcard_constraints:
        material="|".join(map(re.escape, loadable())) or "(?!)",
    conda:
        "../../envs/report.yaml"
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
