"""Time left of a run, from how long its jobs took so far."""

from __future__ import annotations

import pytest

from snakemake_logger_plugin_timeleft import Estimate


def test_nothing_is_said_before_the_first_job_is_done() -> None:
    estimate = Estimate()
    estimate.plan({"slice": 4, "total": 4})
    estimate.start(1, 0.0)
    assert estimate.seconds_left(3.0) is None


def test_jobs_of_a_rule_take_as_long_as_those_done() -> None:
    estimate = Estimate()
    estimate.plan({"slice": 4, "merge": 1, "total": 5})
    for job in range(3):
        estimate.name(job, "slice")
        estimate.start(job, 10.0 * job)
        estimate.finish(job, 10.0 * (job + 1))
    # one slice of 10 s, and a rule not met yet at the mean of 10 s, one at a time
    assert estimate.seconds_left(30.0) == pytest.approx(20.0)


def test_jobs_side_by_side_halve_the_time() -> None:
    estimate = Estimate()
    estimate.plan({"slice": 6, "total": 6})
    for job in range(4):
        estimate.name(job, "slice")
        estimate.start(job, 10.0 * (job // 2))
        estimate.finish(job, 10.0 * (job // 2 + 1))
    assert estimate.seconds_left(20.0) == pytest.approx(10.0)


def test_running_jobs_count_for_what_they_have_done() -> None:
    estimate = Estimate()
    estimate.plan({"slice": 2, "total": 2})
    for job in range(2):
        estimate.name(job, "slice")
    estimate.start(0, 0.0)
    estimate.finish(0, 10.0)
    estimate.start(1, 10.0)
    assert estimate.seconds_left(16.0) == pytest.approx(4.0)
