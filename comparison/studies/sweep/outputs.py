"""Named quantities of a run: what a sweep's table holds of it."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from comparison.metrics.signals import rms
from comparison.reliability.errors import slider_errors
from comparison.studies.sweep.points import SweepError
from comparison.tables.channels import channels
from comparison.tables.table import Table

OF_CHANNELS = {
    "min": "smallest value over the integration steps",
    "max": "largest value over the integration steps",
    "rms": "root of the mean square over time",
    "end": "last sample",
}
OF_ERRORS = {"slider_y": "displacement", "slider_vy": "velocity", "slider_ay": "acceleration"}
"""Channels whose error against the ideal mechanism the paper shows."""
OF_CONTACTS = ("normal_speed", "impulse", "peak_force", "largest_depth")
USUAL = (
    "peak_error:slider_y",
    "peak_error:slider_vy",
    "peak_error:slider_ay",
    "contacts",
    "impulse",
    "largest:peak_force",
)


def names() -> list[str]:
    """List every quantity that a run may be asked for; no model writes channels of the crank."""
    written = [name for name, channel in channels().items() if channel.group != "crank"]
    return [
        *(f"{what}:{channel}" for what in OF_CHANNELS for channel in written),
        *(f"peak_error:{channel}" for channel in OF_ERRORS),
        "contacts",
        "impulse",
        *(f"largest:{column}" for column in OF_CONTACTS),
        "steps",
    ]


def check_names(asked: Sequence[str]) -> None:
    """Refuse a quantity that there is not.

    Raises
    ------
    SweepError
        Naming the nearest one.
    """
    known = names()
    for name in asked:
        if name not in known:
            close = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {close[0]!r}?" if close else "such as " + ", ".join(USUAL)
            raise SweepError(f"--output {name!r} is not a quantity of a run; {hint}")


def needs_ideal(asked: Sequence[str]) -> bool:
    """Return whether a quantity is an error against the ideal mechanism."""
    return any(name.startswith("peak_error:") for name in asked)


def measure(run: Table, ideal: Table | None, period: float, asked: Sequence[str]) -> dict[str, float | None]:
    """Return the quantities of a run, of `names`, None where it has not what they need.

    The ideal mechanism's run is there where `needs_ideal`. The period of the crank is in s. A peak error is
    the size of the largest one over the second cycle as in the paper; over all where there is no second.
    ``contacts`` counts them, ``impulse`` is their sum, N s.
    """
    return {name: _one(name, run, ideal, period) for name in asked}


def _one(name: str, run: Table, ideal: Table | None, period: float) -> float | None:
    what, _, of = name.partition(":")
    if what == "peak_error" and ideal is not None:
        if of not in run.names:
            return None
        second = (period, 2 * period) if run.time[-1] >= 2 * period * (1 - 1e-9) else ()
        return abs(slider_errors(run, ideal, period, names=(of,)).peak(of, *second).value)
    if what in OF_CHANNELS:
        return _of_channel(what, of, run)
    if what == "steps":
        steps = run.provenance.get("counters", {}).get("steps")
        return None if steps is None else float(steps)
    contacts = run.events
    if contacts is None:
        return None
    if what == "contacts":
        return float(len(contacts))
    if what == "impulse":
        return float(contacts["impulse"].to_numpy().sum())
    column = contacts[of]
    return float(column.max()) if column.size else 0.0


def _of_channel(what: str, channel: str, run: Table) -> float | None:
    if channel not in run.names:
        return None
    values = run.values(channel)
    if what == "end":
        return float(values[-1])
    if what == "rms":
        return rms(run.time, values)
    if channel in run.extrema:
        return float(run.extrema[channel][what])
    return float(values.min() if what == "min" else values.max())
