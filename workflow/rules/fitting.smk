# Analytic models fitted to tables.


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
    resources:
        **asks("fit"),
    params:
        options=fit_options(),
        code=fit_code,
    script:
        "../scripts/fit.py"


rule compare_fits:
    input:
        receipt="<results>/{material}/table.json",
        table=ancient("<results>/{material}/table.zarr"),
        fits=expand(
            "<results>/{{material}}/fit/{model}.json",
            model=SETTINGS["fitting"]["models"],
        ),
    output:
        document="<results>/{material}/comparison.json",
        rows=report(
            "<results>/{material}/comparison.csv",
            category="Models",
            caption="../../reports/models.rst",
            labels={"of": "{material}"},
        ),
    log:
        "<logs>/compare_fits/{material}.log",
    benchmark:
        "<benchmarks>/compare_fits/{material}.tsv"
    conda:
        "../../envs/fitting.yaml"
    resources:
        **asks("fit"),
    params:
        code=source_digest("pbrdf.fitting.comparison"),
    script:
        "../scripts/compare_fits.py"


rule compare_materials:
    input:
        expand("<results>/{material}/comparison.json", material=tabulated()),
    output:
        document="<results>/comparison.json",
        rows=report(
            "<results>/comparison.csv",
            category="Models",
            caption="../../reports/models.rst",
            labels={"of": "all materials"},
        ),
    log:
        "<logs>/compare_materials.log",
    benchmark:
        "<benchmarks>/compare_materials.tsv"
    conda:
        "../../envs/fitting.yaml"
    params:
        code=source_digest("pbrdf.fitting.comparison"),
    script:
        "../scripts/compare_materials.py"
