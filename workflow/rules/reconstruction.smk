# Raw frames to Mueller images, a light a job. Images go when their slice is made, unless they are kept.
KEPT = "|".join(map(re.escape, kept_lights())) or "(?!)"


rule reconstruct:
    input:
        unpack(image_calibrations),
        manifest=manifest,
    output:
        images=temp(directory("<results>/{material}/mueller/{light}")),
        receipt="<results>/{material}/mueller/{light}.json",
    log:
        "<logs>/reconstruct/{material}/{light}.log",
    benchmark:
        "<benchmarks>/reconstruct/{material}/{light}.tsv"
    wildcard_constraints:
        material=spheres(),
        light=f"(?!{KEPT}){LIGHT}",
    conda:
        "../../envs/reconstruction.yaml"
    threads: threads_of("reconstruct")
    resources:
        **asks("reconstruct"),
    params:
        margin_px=SETTINGS["reconstruction"]["margin_px"],
        code=source_digest("pbrdf.reconstruction.light"),
    script:
        "../scripts/reconstruct.py"


use rule reconstruct as reconstruct_kept with:
    output:
        images=directory("<results>/{material}/mueller/{light}"),
        receipt="<results>/{material}/mueller/{light}.json",
    wildcard_constraints:
        material=spheres(),
        light=KEPT,


use rule reconstruct as reconstruct_flat with:
    output:
        images=directory("<results>/{material}/mueller/{light}"),
        receipt="<results>/{material}/mueller/{light}.json",
    wildcard_constraints:
        material="|".join(
            n
            for n, m in MATERIALS.items()
            if m.source != "table" and not has_sphere(n)
        )
        or "(?!)",
        light=LIGHT,
