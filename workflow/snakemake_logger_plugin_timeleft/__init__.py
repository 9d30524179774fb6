"""A Snakemake logger plugin that tells how long a run still takes: `logger: timeleft` in a profile.

It only adds a line now and then to Snakemake's own messages. Jobs of a rule are taken to last as
long as those of the rule that are done, and rules not met yet as long as the mean job.
"""

from __future__ import annotations

import sys
import time
from collections import Counter, defaultdict
from logging import LogRecord

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

SECONDS_BETWEEN_LINES = 5.0


class Estimate:
    """Seconds left of a run, from how long its jobs took so far."""

    def __init__(self) -> None:
        self._planned: Counter[str] = Counter()
        self._rules: dict[int, str] = {}
        self._started: dict[int, float] = {}
        self._durations: dict[str, list[float]] = defaultdict(list)
        self._begun: float | None = None

    def plan(self, jobs: dict[str, int]) -> None:
        """Take in how many jobs of each rule there are."""
        self._planned = Counter({rule: count for rule, count in jobs.items() if rule != "total"})

    def name(self, job: int, rule: str) -> None:
        """Take in which rule a job belongs to."""
        self._rules[job] = rule

    def start(self, job: int, now: float) -> None:
        """Take in that a job begins at `now`, seconds."""
        self._begun = now if self._begun is None else self._begun
        self._started[job] = now

    def finish(self, job: int, now: float) -> None:
        """Take in that a job ends at `now`, seconds."""
        started = self._started.pop(job, now)
        self._durations[self._rules.get(job, "")].append(now - started)

    def seconds_left(self, now: float) -> float | None:
        """Seconds until the end; None before the first job is done."""
        finished = [seconds for times in self._durations.values() for seconds in times]
        if not finished or self._begun is None:
            return None
        mean = sum(finished) / len(finished)
        work = 0.0
        for rule, count in self._planned.items():
            times = self._durations.get(rule, [])
            each = sum(times) / len(times) if times else mean
            work += each * max(count - len(times), 0)
        elapsed = max(now - self._begun, 1e-9)
        running = sum(now - started for started in self._started.values())
        parallel = max((sum(finished) + running) / elapsed, 1.0)
        return max(work - running, 0.0) / parallel


class LogHandler(LogHandlerBase):
    """Prints ``37 of 130 jobs, 1 min 12 s left`` as jobs end."""

    def __post_init__(self) -> None:
        self._estimate = Estimate()
        self._last = 0.0

    def emit(self, record: LogRecord) -> None:
        """Follow the events of the scheduler."""
        event, now = getattr(record, "event", None), time.monotonic()
        if event == LogEvent.RUN_INFO:
            self._estimate.plan(record.__dict__.get("stats", {}))
        elif event == LogEvent.JOB_INFO:
            self._estimate.name(record.__dict__["jobid"], record.__dict__["rule_name"])
        elif event == LogEvent.JOB_STARTED:
            for job in record.__dict__["jobs"]:
                self._estimate.start(job, now)
        elif event == LogEvent.JOB_FINISHED:
            self._estimate.finish(record.__dict__["job_id"], now)
        elif event == LogEvent.PROGRESS and now - self._last >= SECONDS_BETWEEN_LINES:
            left = self._estimate.seconds_left(now)
            if left is not None:
                self._last = now
                minutes, seconds = divmod(round(left), 60)
                done, total = record.__dict__["done"], record.__dict__["total"]
                print(f"{done} of {total} jobs, {minutes} min {seconds} s left", file=sys.stderr, flush=True)

    @property
    def writes_to_stream(self) -> bool:
        """False: Snakemake goes on writing its own messages."""
        return False

    @property
    def writes_to_file(self) -> bool:
        """False."""
        return False

    @property
    def has_filter(self) -> bool:
        """True: every event is looked at, whatever is shown."""
        return True

    @property
    def has_formatter(self) -> bool:
        """True."""
        return True

    @property
    def needs_rulegraph(self) -> bool:
        """False."""
        return False
