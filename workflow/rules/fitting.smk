# Analytic models fitted to tables.


def fit_options():
    """How tables are fitted, whatever the model."""
    return {key: value for key, value in SETTINGS["fitting"].items() if key != "models"}


rule fit:
    input:
        receipt="<results>/{material}/table.json",
        table=ancient("<results>/{material}/table.zarr"),
    output:
        "<results>/{material}/fit/{model}.json",
    log:
        "<logs>/fit/{material}/{model}.log",
    benchmark:
        "<benchmarks>/fit/{material}/{model}.tsv"
    conda:
        "../../envs/fitting.yaml"
    params:
        options=fit_options(),
        code=source_digest("pbrdf.fitting.material"),
    script:
        "../scripts/fit.py"
