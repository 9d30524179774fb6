# Two tables and their difference: `snakemake compare --config 'compare=[gold,other.pbsdf]'`. No part of a bare run.


def compared_tables():
    """The two tables that the config names, by the names that pages and files give them."""
    tables = {}
    for given in SETTINGS["compare"]:
        known = given in MATERIALS
        path = f"<results>/{given}/table.zarr" if known else placed(given)
        name = given if known else Path(given).stem
        tables[f"{name}_2" if name in tables else name] = path
    return tables


def comparison_inputs(wildcards):
    """Input function: tables of materials go by their receipts, others by their files."""
    inputs = {}
    for place, (name, path) in zip(["first", "other"], compared_tables().items()):
        if name in MATERIALS and path == f"<results>/{name}/table.zarr":
            inputs[f"{place}_receipt"] = f"<results>/{name}/table.json"
            path = ancient(path)
        inputs[place] = path
    return inputs


rule compare_tables:
    input:
        unpack(comparison_inputs),
    output:
        page="<results>/comparisons/{names}.html",
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
        params:
            config=config_name(),
        script:
            "../scripts/refuse_no_comparison.py"
