# A job that is killed loses its outputs and Snakemake's record of them. Where only the last results are asked for,
# those made from the lost ones before would count as up to date, whatever has changed since: so all are asked for.


def intermediate_results():
    """A result of every job between the photographs and the report."""
    made = [name for name, m in MATERIALS.items() if m.source != "table"]
    images = [
        f"<results>/{name}/mueller/{light}.json"
        for name in made
        for light in lights(name)
    ]
    slices = [
        f"<results>/{name}/slices/{light}.json"
        for name in filter(has_sphere, made)
        for light in lights(name)
    ]
    of_tables = expand(
        [
            "<results>/{material}/table.json",
            "<results>/{material}/comparison.json",
            "<results>/{material}/fit/{model}.json",
        ],
        material=tabulated(),
        model=SETTINGS["fitting"]["models"],
    )
    pages = expand("<results>/pages/parts/{material}.json", material=MATERIALS)
    pages += [*calibration_entries(), "<results>/pages/index.html"]
    return [*calibrations_in_use(), *images, *slices, *dict.fromkeys(of_tables), *pages]
