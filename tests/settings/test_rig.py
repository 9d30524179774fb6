from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
import yaml

from pbrdf.errors import InputError
from pbrdf.settings.checked import read_checked
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import read_rig

CONFIG = Path(__file__).resolve().parents[2] / "config"
TABLE_1 = """\
1|Machine vision camera|1|GS3-U3-91S6M|FLIR
2|Imaging lens|1|CoastalOpt apochromatic lens|Jenoptik
3|Light source|1|MCWHLP1|Thorlabs
4|Achromatic doublet|1|AC254-040-A-ML|Thorlabs
5|Automatic filter wheel|1|#59-769|Edmund Optics
6|Automatic turntable|1|Platinum MID turntable|Iconasys
7|Motorized rotary stage|2|K10CR1/M|Thorlabs
8|Manual rotary stage|2|RSP1|Thorlabs
9|Linear polarizer|2|#47-215|Edmund Optics
10|Quarter-wave retarder|2|AQWP10M-580|Thorlabs
11|Visible bandpass filter set|1|#88-299|Edmund Optics
"""


@pytest.fixture
def virtual() -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load((CONFIG / "rig/virtual.yaml").read_text(encoding="utf-8"))
    return content


def _refusal(folder: Path, content: dict[str, Any]) -> InputError:
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_rig(path)
    assert refused.value.source == str(path)
    return refused.value


@pytest.mark.parametrize("path", sorted((CONFIG / "rig").glob("*.yaml")), ids=lambda path: path.name)
def test_every_rig_of_the_project_reads(path: Path) -> None:
    assert read_rig(path)["schema"] == "pbrdf/rig/1"


@pytest.mark.parametrize("path", sorted(CONFIG.glob("*.yaml")), ids=lambda path: path.name)
def test_every_config_of_the_project_reads_and_plans_what_its_rig_can_do(path: Path) -> None:
    settings = read_checked(path, "config")
    if settings["rig"]:
        plan = capture_plan(settings["plan"], read_rig(CONFIG.parent / settings["rig"]), path)
        assert plan.frames_per_light() > 0


def test_the_rig_of_2020_is_the_supplements_table_1() -> None:
    rig = read_rig(CONFIG / "rig/kaist2020.yaml")
    names = ("item", "part", "quantity", "model", "company")
    rows = ["|".join(str(part[name]) for name in names) for part in rig["components"]]
    assert rows == TABLE_1.splitlines()
    assert rig["filters_nm"] == [450, 500, 550, 600, 650]


@pytest.mark.parametrize(
    "field",
    [
        "polarimeter.generator_retardance_waves",
        "polarimeter.analyser_retardance_waves",
        "lamp_electrons_per_s",
        "spheres.gold.bands",
    ],
)
def test_a_virtual_rig_that_lacks_a_band_is_refused(
    tmp_path: Path, virtual: dict[str, Any], field: str
) -> None:
    table = virtual
    for part in field.split("."):
        table = table[part]
    del table["600"]
    refused = _refusal(tmp_path, virtual)
    assert refused.field == field
    assert refused.problem == "says nothing of 600 nm"


def test_a_sphere_may_be_a_table_or_mitsubas(tmp_path: Path, virtual: dict[str, Any]) -> None:
    plastic = {"type": "pplastic", "alpha": 0.1}
    by_band = {str(nm): plastic for nm in virtual["filters_nm"]}
    virtual["spheres"] = {"a": {"table": "a.pbsdf"}, "b": {"mitsuba": plastic}, "c": {"mitsuba": by_band}}
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(virtual), encoding="utf-8")
    assert read_rig(path)["spheres"] == virtual["spheres"]


@pytest.mark.parametrize(
    ("sphere", "field", "problem"),
    [
        ({"table": "a.pbsdf", "model": "baek2018"}, "spheres.a", "has too many properties"),
        ({"roughness": 0.1}, "spheres.a.model", "is missing"),
        ({"mitsuba": {}}, "spheres.a.mitsuba", "should be non-empty"),
        ({"mitsuba": {"550": {"alpha": 0.1}}}, "spheres.a.mitsuba.550.type", "is missing"),
        ({"mitsuba": {"550": {"type": "diffuse"}}}, "spheres.a.mitsuba", "says nothing of 450 nm"),
    ],
)
def test_a_sphere_told_twice_or_by_halves_is_refused(
    tmp_path: Path, virtual: dict[str, Any], sphere: dict[str, Any], field: str, problem: str
) -> None:
    virtual["spheres"] = {"a": sphere}
    refused = _refusal(tmp_path, virtual)
    assert refused.field == field
    assert problem in refused.problem


@pytest.mark.parametrize(
    "name", ["arm", "distance_mm", "polarimeter", "lamp_electrons_per_s", "spheres", "camera"]
)
def test_a_virtual_rig_without_one_of_its_parts_is_refused(
    tmp_path: Path, virtual: dict[str, Any], name: str
) -> None:
    del virtual[name]
    refused = _refusal(tmp_path, virtual)
    assert (refused.field, refused.problem) == (name, "is missing")


def test_a_word_too_long_for_its_store_is_refused(tmp_path: Path, virtual: dict[str, Any]) -> None:
    virtual["camera"] |= {"adc_bits": 14, "shift": 3}
    assert _refusal(tmp_path, virtual).field == "camera.shift"


def test_a_band_written_as_a_number_is_told_to_be_quoted(tmp_path: Path, virtual: dict[str, Any]) -> None:
    virtual["lamp_electrons_per_s"] = {450: 2900000}
    refused = _refusal(tmp_path, virtual)
    assert refused.field == "lamp_electrons_per_s"
    assert refused.remedy == 'write it as "450"'


def test_a_band_that_is_no_number_is_refused(tmp_path: Path, virtual: dict[str, Any]) -> None:
    virtual["lamp_electrons_per_s"]["45O"] = 1
    refused = _refusal(tmp_path, virtual)
    assert (refused.field, refused.problem) == ("lamp_electrons_per_s", "unknown key `45O`")
    assert refused.remedy == "keys look like ^[0-9]+$"


def test_an_exponent_without_sign_gets_its_own_advice(tmp_path: Path, virtual: dict[str, Any]) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(virtual).replace("2900000", "2.9e6"), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_rig(path)
    assert refused.value.field == "lamp_electrons_per_s.450"
    assert refused.value.remedy == "YAML takes it for text: write 2900000.0, without quotes"


def test_a_rig_prints_its_content_in_short(tmp_path: Path, virtual: dict[str, Any]) -> None:
    printed = set()
    for seed in (1, 2, 1):
        path = tmp_path / f"{len(printed)}.yaml"
        path.write_text(yaml.safe_dump(deepcopy(virtual) | {"seed": seed}), encoding="utf-8")
        printed.add(repr(read_rig(path)))
    assert len(printed) == 2
    assert all(len(text) < 60 for text in printed)
