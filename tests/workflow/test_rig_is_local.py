"""Whatever drives the rig runs where Snakemake runs, one at a time."""

from __future__ import annotations

import re

from small_workflow import ROOT

BLOCK = re.compile(
    r"^ *((?:use )?rule (\w+).*?)(?=^ *(?:use )?rule |^ *localrules:|\Z)", re.MULTILINE | re.DOTALL
)
LOCAL = re.compile(r"^ *localrules:\n((?: +\w+,\n)+)", re.MULTILINE)


def test_rules_of_the_rig_are_local_and_exclusive() -> None:
    text = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "workflow/rules").glob("*.smk"))
    blocks = {name: block for block, name in BLOCK.findall(text)}
    local = {name for names in LOCAL.findall(text) for name in re.findall(r"\w+", names)}
    drives = {name for name, block in blocks.items() if "scripts/capture" in block}
    exclusive = {name for name, block in blocks.items() if "rig=1" in block}
    assert drives
    assert drives <= exclusive
    heirs = {name for name, block in blocks.items() if re.match(rf"use rule ({'|'.join(drives)}) ", block)}
    assert drives | heirs <= local
