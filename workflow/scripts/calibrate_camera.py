"""Measure a session's camera."""

from pathlib import Path

from job import job

from pbrdf.calibration.chessboard import Board
from pbrdf.calibration.session_camera import calibrate_camera

with job(snakemake.log[0]):
    board = snakemake.params.board
    calibrate_camera(
        {Path(manifest).parents[2].name: manifest for manifest in snakemake.input},
        Board(tuple(board["corners"]), board["square_mm"]),
        snakemake.output[0],
    )
