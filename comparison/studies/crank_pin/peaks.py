"""Peaks of the slider's errors with clearance at the crank pin, beside the published ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from comparison.execution.run import Outcome
from comparison.formatting import number, quantity, table
from comparison.reliability.errors import Peak, slider_errors
from comparison.studies.shared.published import published
from comparison.studies.shared.rates import rate
from comparison.tables.table import Table

WORDS = {"slider_y": "displacement", "slider_vy": "velocity", "slider_ay": "acceleration"}
PRINTED = {channel: published(f"F7-R-{word[0]}") for channel, word in WORDS.items()}
REACH = 0.01
"""s; a peak this close to the published instant (2.5 % of a crank cycle) counts as the same passage."""


@dataclass(frozen=True)
class Case:
    """Runs that differ by a nudge only."""

    peaks: dict[tuple[str, bool], list[Peak]]
    """(channel, whether only near the published instant) -> the peak of each run that succeeded."""
    stopped: list[str]
    """What became of the others."""


def summarise(outcomes: Sequence[Outcome], still: Table, period: float) -> Case:
    """Return the peaks of runs against the ideal mechanism's run ``still``; period of the crank in s."""
    errors = [slider_errors(outcome.table, still, period) for outcome in outcomes if outcome.table]
    peaks: dict[tuple[str, bool], list[Peak]] = {}
    for channel, printed in PRINTED.items():
        close = printed.time - REACH, printed.time + REACH
        peaks[channel, False] = [of.peak(channel, period, 2 * period) for of in errors]
        peaks[channel, True] = [of.peak(channel, *close) for of in errors]
    messages = [
        f"not simulated: {o.message}" if o.status == "bad input" else f"{o.status}: {o.message}"
        for o in outcomes
        if o.table is None
    ]
    return Case(peaks, messages)


def peaks_table(cases: dict[str, Case]) -> str:
    """Return a table: a row a quantity, a column a case; median, and range where the runs are several."""
    stopped = [
        f"{', '.join(label for label, case in cases.items() if message in case.stopped)}: {message}."
        for message in dict.fromkeys(text for case in cases.values() for text in case.stopped)
    ]
    run = {label: case for label, case in cases.items() if case.peaks["slider_y", True]}
    if not run:
        return "\n\n".join(stopped)
    rows = []
    for (channel, close), _ in next(iter(run.values())).peaks.items():
        printed = PRINTED[channel]
        where = f"within {REACH * 1e3:g} ms of the published instant" if close else "second cycle"
        peaks = [case.peaks[channel, close] for case in run.values()]
        name, size = f"{WORDS[channel]}, {where}", quantity(abs(printed.value), printed.unit, 4)
        rows.append([name, size, *(_sizes(each, printed.unit) for each in peaks)])
        rows.append(["of the published one", "1", *(_ratio(each, printed.value) for each in peaks)])
        if close:
            rows.append(["at", f"{printed.time:.4f} s", *(_times(each) for each in peaks)])
    counts = [
        f"{len(case.peaks['slider_y', True])} of {len(case.peaks['slider_y', True]) + len(case.stopped)}"
        for case in run.values()
    ]
    rows.append(["runs that reached the end", "", *counts])
    return "\n\n".join([table(("largest error", "published", *run), rows), *stopped])


def powers(cases: dict[float, Case]) -> str:
    """Return the exponents of the median peaks in what is varied, from a straight line in logs."""
    found = []
    for channel, word in WORDS.items():
        sizes = [np.median([abs(p.value) for p in case.peaks[channel, True]]) for case in cases.values()]
        found.append(f"{word} {number(rate(list(cases), sizes), 2)}")
    return ", ".join(found)


def met(cases: dict[float, Case], channel: str) -> str:
    """Return the modulus at which the median peak near the instant passes the published one, by logs."""
    sizes = [np.median([abs(p.value) for p in case.peaks[channel, True]]) for case in cases.values()]
    above = np.log(np.array(sizes) / abs(PRINTED[channel].value))
    crossings = np.flatnonzero(above[:-1] * above[1:] <= 0)
    if not crossings.size:
        return "no modulus"
    n = crossings[0]
    logs = np.log(list(cases))
    passed = logs[n] + (logs[n + 1] - logs[n]) * above[n] / (above[n] - above[n + 1])
    return f"{number(float(np.exp(passed)) / 1e9, 2)} GPa"


def _sizes(peaks: list[Peak], unit: str) -> str:
    low, middle, high = np.quantile([abs(p.value) for p in peaks], (0.0, 0.5, 1.0))
    spread = f" ({quantity(low, unit)} … {quantity(high, unit)})" if len(peaks) > 1 else ""
    return quantity(float(middle), unit, 4) + spread


def _ratio(peaks: list[Peak], printed: float) -> str:
    return number(float(np.median([abs(p.value / printed) for p in peaks])))


def _times(peaks: list[Peak]) -> str:
    low, high = min(p.time for p in peaks), max(p.time for p in peaks)
    return f"{low:.4f} … {high:.4f} s" if low < high else f"{low:.4f} s"
