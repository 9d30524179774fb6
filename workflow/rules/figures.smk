# Figures for papers: `snakemake figures`. No part of a bare run.


rule retardance_figure:
    input:
        "<results>/calibration/{session}/polarimeter.json",
    output:
        multiext("<results>/figures/session_{session}_retardance", ".pdf", ".png"),
        report(
            "<results>/figures/session_{session}_retardance.svg",
            category="Figures",
            caption="../../reports/figures.rst",
            labels={"of": "{session}", "figure": "retardance"},
        ),
    log:
        "<logs>/retardance_figure/{session}.log",
    wildcard_constraints:
        session=SESSION,
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.paper_figures"),
    script:
        "../scripts/retardance_figure.py"


rule elements_figure:
    input:
        "<results>/validation/{session}.json",
    output:
        multiext("<results>/figures/session_{session}_elements", ".pdf", ".png"),
        report(
            "<results>/figures/session_{session}_elements.svg",
            category="Figures",
            caption="../../reports/figures.rst",
            labels={"of": "{session}", "figure": "elements"},
        ),
    log:
        "<logs>/elements_figure/{session}.log",
    wildcard_constraints:
        session=SESSION,
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.paper_figures"),
    script:
        "../scripts/elements_figure.py"


rule material_figures:
    input:
        receipt="<results>/{material}/table.json",
        table=ancient("<results>/{material}/table.zarr"),
        fits=expand(
            "<results>/{{material}}/fit/{model}.json",
            model=SETTINGS["fitting"]["models"],
        ),
    output:
        expand(
            "<results>/figures/{{material}}_{figure}.{format}",
            figure=MATERIAL_FIGURES,
            format=["pdf", "png"],
        ),
        *[
            report(
                f"<results>/figures/{{material}}_{figure}.svg",
                category="Figures",
                caption="../../reports/material_figures.rst",
                labels={"of": "{material}", "figure": figure.replace("_", " ")},
            )
            for figure in MATERIAL_FIGURES
        ],
    log:
        "<logs>/material_figures/{material}.log",
    wildcard_constraints:
        material="|".join(map(re.escape, tabulated())) or "(?!)",
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.paper_figures"),
    script:
        "../scripts/material_figures.py"


localrules:
    figures,


rule figures:
    input:
        figures(),
