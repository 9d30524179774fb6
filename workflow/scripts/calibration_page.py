"""Write the page of a calibration."""

from job import job

from pbrdf.calibration.chessboard import Board
from pbrdf.report.calibration_page import write_calibration_page

with job(snakemake.log[0]):
    board, camera = snakemake.params.board, snakemake.input.get("camera")
    write_calibration_page(
        snakemake.wildcards.kind,
        snakemake.wildcards.subject,
        snakemake.input.document,
        snakemake.input.get("photographs", []),
        {"camera": camera} if camera else {},
        Board(tuple(board["corners"]), board["square_mm"]),
        snakemake.output.page,
        snakemake.output.entry,
    )
