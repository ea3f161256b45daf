"""What a model returns, and whether what it returned is that."""

from __future__ import annotations

import json
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from comparison.files import plain
from comparison.tables.columns import check_cycle_extrema
from comparison.tables.pulses import check_pulses
from comparison.tables.record import check_record


class Result(Protocol):
    """Interface of a model's result; each model has its own class.

    It may also have ``pulses``, a dict of arrays or None: see `comparison.tables.pulses`; and
    ``cycle_extrema``, one as well: see `comparison.tables.table.Table`.
    """

    @property
    def columns(self) -> dict[str, NDArray[np.float64]]: ...  # noqa: D102
    @property
    def events(self) -> dict[str, NDArray[Any]]: ...  # noqa: D102
    @property
    def extrema(self) -> dict[str, dict[str, float]]: ...  # noqa: D102
    @property
    def provenance(self) -> dict[str, Any]: ...  # noqa: D102
    @property
    def status(self) -> str: ...  # noqa: D102
    @property
    def remedy(self) -> str: ...  # noqa: D102


_RESULT = {
    "columns": dict, "events": dict, "extrema": dict, "provenance": dict, "status": str, "remedy": str
}  # fmt: skip


def check_result(result: Result) -> None:
    """Reject what lacks an attribute of a `Result`, or whose record is none.

    Raises
    ------
    TypeError, ValueError
        Which part of the result, and what it must be.
    """
    for name, kind in _RESULT.items():
        part = getattr(result, name, None)
        if not isinstance(part, kind):
            raise TypeError(f"result: {name} must be a {kind.__name__}, not {type(part).__name__}")
    for name in ("pulses", "cycle_extrema"):
        part = getattr(result, name, None)
        if part is not None and not isinstance(part, dict):
            raise TypeError(f"result: {name} must be a dict or None, not {type(part).__name__}")
    if pulses := getattr(result, "pulses", None):
        check_pulses(pulses)
    if cycle_extrema := getattr(result, "cycle_extrema", None):
        check_cycle_extrema(cycle_extrema)
    record = {"extrema": result.extrema, "provenance": result.provenance}
    try:
        check_record({**result.provenance, "extrema": result.extrema})
        json.dumps(plain(record))
    except (TypeError, ValueError) as error:
        raise ValueError(f"extrema or provenance: {error}") from error
