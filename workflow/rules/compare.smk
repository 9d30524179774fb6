# Two tables and their difference: `snakemake compare --config 'compare=[gold,other.pbsdf]'`. No part of a bare run.


rule compare_tables:
    input:
        unpack(comparison_inputs),
    output:
        page=report(
            "<results>/comparisons/{names}.html",
            category="Comparisons",
            caption="../../reports/tables.rst",
            labels={"tables": "{names}"},
        ),
        document="<results>/comparisons/{names}.json",
    log:
        "<logs>/compare/{names}.log",
    conda:
        "../../envs/report.yaml"
    params:
        names=list(compared_tables()),
        code=source_digest("pbrdf.report.comparison_page"),
    script:
        "../scripts/compare_tables.py"


if len(SETTINGS["compare"]) == 2:

    localrules:
        compare,

    rule compare:
        input:
            "<results>/comparisons/" + "_and_".join(compared_tables()) + ".html",

else:

    rule compare:
        log:
            "<logs>/compare.log",
        conda:
            "../../envs/report.yaml"
        params:
            config=config_name(),
        script:
            "../scripts/refuse_no_comparison.py"
