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
    params:
        downsample=SETTINGS["fitting"]["downsample"],
        starts=SETTINGS["fitting"]["starts"],
        seed=SETTINGS["fitting"]["seed"],
        code=source_digest("pbrdf.fitting.material"),
    script:
        "../scripts/fit.py"
