# What is made from tables, and which there are.

from pbrdf.models import FAMILIES

FIGURE_FORMATS = ["pdf", "svg", "png"]
MATERIAL_FIGURES = [
    "mueller_table",
    "mueller_fit",
    "mueller_difference",
    "curves",
    "sphere",
]


def paper_mapping(wildcards):
    """What a light's share by the supplement's map depends on besides; None where slices are made."""
    if SETTINGS["tabulation"]["mapping"] != "paper":
        return None
    return {
        "angles_deg": [float(light) for light in lights(wildcards.material)],
        "widest_gap_deg": SETTINGS["tabulation"]["widest_gap_deg"],
        "slips": SETTINGS["tabulation"]["slips"],
    }


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


def figures():
    """Every figure of this run."""
    drawn = expand(
        "<results>/figures/{material}_{figure}.{format}",
        material=tabulated(),
        figure=MATERIAL_FIGURES,
        format=FIGURE_FORMATS,
    )
    return drawn + expand(
        "<results>/figures/session_{session}_{figure}.{format}",
        session=photographed_sessions(),
        figure=["retardance", "elements"],
        format=FIGURE_FORMATS,
    )


def fit_options():
    """How tables are fitted, whatever the model."""
    return {key: value for key, value in SETTINGS["fitting"].items() if key != "models"}


def fit_code(wildcards):
    """Digest of the code of one fit: what another family of models is does not count."""
    others = [
        f"pbrdf.models.{family}"
        for family, models in FAMILIES.items()
        if wildcards.model not in {model.name for model in models}
    ]
    return source_digest("pbrdf.fitting.material", without=others)


def comparisons():
    """The comparison of all fits, if there are any."""
    return ["<results>/comparison.json"] if tabulated() else []
