"""Commands on tables: ``pbrdf fit``, ``pbrdf info``, ``pbrdf convert``, ``pbrdf compare``."""

from __future__ import annotations

import argparse
from importlib.metadata import version
from pathlib import Path

from pbrdf.commands.command import Command
from pbrdf.errors import InputError
from pbrdf.formats.receipt import digest
from pbrdf.models import MODELS, CostKind
from pbrdf.models.table import open_table

FULL_GRID = 46
"""Nodes of the shortest axis from which a fit looks at every fourth: a coarser table has none to spare."""


def _add_axes(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--axes",
        type=Path,
        metavar="FILE",
        help="for a .pbsdf whose axis fields are empty: YAML with theta_h_deg, theta_d_deg, phi_d_deg "
        "(lists of degrees); for a .mat without axes: the .mat that holds them",
    )


def _add_fit(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, help="a table: .pbsdf, .mat or .zarr")
    parser.add_argument("--model", default="baek2018", help=f"{', '.join(MODELS)} (default: %(default)s)")
    parser.add_argument(
        "--downsample",
        type=int,
        metavar="N",
        help=f"use every N-th node of each axis (default: 4, or 1 if an axis has fewer than {FULL_GRID})",
    )
    parser.add_argument(
        "--cost", default="norms", help=f"{', '.join(CostKind)}: what is summed (default: %(default)s)"
    )
    parser.add_argument("--blocks", action="store_true", help="average blocks of nodes, not every N-th")
    parser.add_argument("--solid-angle", action="store_true", help="weigh nodes by solid angle")
    parser.add_argument(
        "--held-out", action="store_true", help="fit again without every tenth θd and tell the error there"
    )
    parser.add_argument(
        "--starts", type=int, default=3, metavar="N", help="searches to make (default: %(default)s)"
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the starts (default: %(default)s)"
    )
    _add_axes(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to write (default: beside FILE)")


def _run_fit(arguments: argparse.Namespace) -> None:
    # these take a second to import, which no other command should wait for
    from pbrdf.fitting import fit
    from pbrdf.fitting.comparison import compare
    from pbrdf.report.pages import material_page, write_page

    path: Path = arguments.file
    table = open_table(path, arguments.axes)
    axes = (table.data.theta_h, table.data.theta_d, table.data.phi_d)
    downsample = arguments.downsample
    if downsample is None:
        downsample = 4 if min(len(axis) for axis in axes) >= FULL_GRID else 1
    source = digest([path])
    result = fit(
        table,
        arguments.model,
        downsample=downsample,
        thinning="blocks" if arguments.blocks else "nodes",
        cost=arguments.cost,
        solid_angle=arguments.solid_angle,
        held_out=arguments.held_out,
        starts=arguments.starts,
        seed=arguments.seed,
        digest=source,
    )
    provenance = {"table": path.name, "SHA-256 of the table": source, "pbrdf": version("pbrdf")}
    if arguments.axes is not None:
        provenance |= {"axes": arguments.axes.name, "SHA-256 of the axes": digest([arguments.axes])}
    page = material_page(
        path.stem,
        table.data,
        [result],
        calibration_sources={},
        provenance=provenance,
        comparison=compare(path.stem, table.data, [result]).content(),
    )
    folder: Path = path.parent if arguments.out is None else arguments.out
    fitted, shown = folder / f"{path.stem}.fit.json", folder / f"{path.stem}.html"
    write_page(shown, page)
    try:
        result.write(fitted)
    except BaseException:
        shown.unlink()
        raise
    print(fitted, shown, sep="\n")


def _add_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file",
        type=Path,
        help="any file of pbrdf: table (.zarr, .pbsdf, .mat), slice or frames (.zarr), Mueller image or flat "
        "field (.exr), document (.json), journal (.jsonl), rows of values (.csv), page (.html), script of "
        "the pages (.js), picture (.png, .svg, .pdf)",
    )
    _add_axes(parser)


def _run_info(arguments: argparse.Namespace) -> None:
    from pbrdf.report.file_summary import file_summary

    lines = file_summary(arguments.file, arguments.axes)
    width = max(len(name) for name in lines)
    for name, value in lines.items():
        print(f"{name:<{width}}  {value}")


def _add_convert(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", type=Path, metavar="IN", help="a table: .pbsdf, .mat or .zarr")
    parser.add_argument("output", type=Path, metavar="OUT", help="where to write: .pbsdf or .zarr")
    _add_axes(parser)


def _run_convert(arguments: argparse.Namespace) -> None:
    from pbrdf.formats.pbsdf import write_pbsdf
    from pbrdf.formats.table_zarr import write_table

    output: Path = arguments.output
    if output.suffix not in (".pbsdf", ".zarr"):
        raise InputError(output, "kind", f"{output.suffix!r} cannot be written", "name it .pbsdf or .zarr")
    if output.resolve() == arguments.input.resolve():
        raise InputError(output, "OUT", "is the input itself", "give another name")
    table = open_table(arguments.input, arguments.axes).data
    output.parent.mkdir(parents=True, exist_ok=True)
    if output.suffix == ".pbsdf":
        write_pbsdf(output, table)
    else:
        made_from = {"table": arguments.input.name, "digest": digest([arguments.input])}
        write_table(output, table, {"inputs": made_from})
    print(output)


def _add_compare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("first", type=Path, metavar="A", help="a table: .pbsdf, .mat or .zarr")
    parser.add_argument("other", type=Path, metavar="B", help="another, on any grid")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="write a page and its figures there too (default: only print)"
    )


def _run_compare(arguments: argparse.Namespace) -> None:
    from pbrdf.report.comparison_page import verdict, write_comparison_page
    from pbrdf.report.table_comparison import compare_tables

    paths: tuple[Path, Path] = (arguments.first, arguments.other)
    # the folders of our own tables are all called table.zarr
    names = [path.resolve().parent.name if path.stem == "table" else path.stem for path in paths]
    first, other = names if names[0] != names[1] else (names[0], f"{names[1]} (2)")
    found = compare_tables(*(open_table(path).data for path in paths))
    for band in found:
        print(
            verdict((first, other), band) if band.nodes else f"{band.wavelength_nm:g} nm: nothing in common"
        )
    if arguments.out is not None:
        page = arguments.out / f"{first}_and_{other}.html"
        document = page.with_suffix(".json")
        write_comparison_page(dict(zip((first, other), paths, strict=True)), page, document)
        print(page, document, sep="\n")


COMMANDS = (
    Command(
        "fit",
        "fit an analytic model to a table, and write the fit and a page that shows it",
        "  pbrdf fit 1_spectralon.pbsdf\n"
        "  pbrdf fit gold.zarr --starts 8 --out fits\n"
        "  pbrdf fit subsampled.pbsdf --axes axes.yaml --downsample 1",
        _add_fit,
        _run_fit,
    ),
    Command(
        "info",
        "tell what a file is: kind, shape, units, ranges, coverage, what made it",
        "  pbrdf info 1_spectralon.pbsdf\n"
        "  pbrdf info subsampled.pbsdf --axes axes.yaml\n"
        "  pbrdf info results/gold/table.zarr\n"
        "  pbrdf info results/gold/mueller/080.00/550nm.exr\n"
        "  pbrdf info captures/gold/lights/080.00/frames.zarr\n"
        "  pbrdf info results/gold/fit/baek2018.json",
        _add_info,
        _run_info,
    ),
    Command(
        "convert",
        "convert a table between kinds of file",
        "  pbrdf convert table.zarr gold.pbsdf\n"
        "  pbrdf convert 6_gold_matlab.mat gold.zarr --axes pbrdf_table_info.mat",
        _add_convert,
        _run_convert,
    ),
    Command(
        "compare",
        "tell by how much two tables differ where both are known",
        "  pbrdf compare results/gold/table.zarr 6_gold.pbsdf\n"
        "  pbrdf compare friday/table.zarr monday/table.zarr --out difference",
        _add_compare,
        _run_compare,
    ),
)
